//! The command `luxmap`; see [`luxmap::cli`].

fn main() -> std::process::ExitCode {
    luxmap::cli::main()
}
