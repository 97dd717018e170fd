//! Links Embree as luxmap's own programs do.

fn main() {
    let arguments = std::env::var("DEP_LUXMAP_LINK_ARGUMENTS").unwrap_or_default();
    arguments.split('\x1f').filter(|argument| !argument.is_empty()).for_each(|argument| {
        println!("cargo::rustc-link-arg={argument}");
    });
}
