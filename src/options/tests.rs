use std::collections::BTreeSet;

use super::*;

/// A text that each kind takes, and one that it doesn't.
fn samples(option: &RunOption) -> [String; 2] {
    match option.kind {
        Kind::Word(words) => [words[words.len() - 1].into(), "oak".into()],
        Kind::OnOff | Kind::Switch => ["off".into(), "maybe".into()],
        Kind::Count { least, most } => [least.max(2).to_string(), (u128::from(most) + 1).to_string()],
        Kind::Amount { .. } => ["0.5".into(), "-1".into()],
    }
}

#[test]
fn every_option_can_be_set_got_and_layered() {
    let (mut upper, mut all) = (Options::default(), Options::default());
    for option in &TABLE {
        let [good, bad] = samples(option);
        assert_eq!(upper.get(option), None, "{} is open at first", option.name);
        upper.set(option.name, &good).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(upper.get(option), option.parse(&good).ok(), "{}", option.name);
        let refused = all.set(option.name, &bad).expect_err("it is bad").to_string();
        assert_eq!(refused, format!("{}: found {bad}, expected {}", option.name, option.expected()));
        all.set(option.name, &good).expect("it is good");
        // Only this one is set above: all others come from below.
        let mut one = Options::default();
        one.set(option.name, &good).expect("it is good");
        let layered = one.over(upper.clone());
        assert!(TABLE.iter().all(|other| layered.get(other) == upper.get(other)), "{}", option.name);
    }
    assert_eq!(Options::default().over(all.clone()), all);
    assert!(all.set("flavour", "1").is_err());
}

#[test]
fn upper_layers_win() {
    let upper = Options { seed: Some(2), ..Default::default() };
    let lower = Options { seed: Some(1), photons: Some(5), ..Default::default() };
    assert_eq!(upper.over(lower), Options { seed: Some(2), photons: Some(5), ..Default::default() });
}

#[test]
fn words_of_the_table_are_those_of_the_types() {
    let words = |name: &str| match RunOption::named(name).map(|option| option.kind) {
        Some(Kind::Word(words)) => words.to_vec(),
        _ => Vec::new(),
    };
    assert_eq!(words("method"), Method::ALL.map(|(name, _)| name));
    assert_eq!(words("tree"), Tree::ALL.map(|(name, _)| name));
}

/// A checkpoint's recipe has a word for each option that makes its sums, by the option's name.
#[test]
fn recipes_hold_what_the_table_says() {
    let recipe = Recipe {
        luxmap: String::new(),
        scene_sha256: String::new(),
        planes: Vec::new(),
        cameras: Vec::new(),
        method: "path".into(),
        tree: "paper".into(),
        photons: 3,
        rays: 4,
        smooth: true,
        nearest: Some(5),
        radius: Some(0.5),
        groups: true,
    };
    let json = serde_json::to_value(&recipe).expect("words");
    let of_scene = ["luxmap", "scene_sha256", "planes", "cameras"];
    let words: BTreeSet<&str> =
        json.as_object().expect("an object").keys().map(String::as_str).filter(|key| !of_scene.contains(key)).collect();
    let named: BTreeSet<&str> = TABLE.iter().filter(|option| option.in_recipe).map(|option| option.name).collect();
    assert_eq!(words, named);
    let options = Options::of_recipe(&recipe);
    assert!(TABLE.iter().all(|option| options.get(option).is_some() == option.in_recipe));
}
