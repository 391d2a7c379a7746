//! Errors in scenes: each names the line, the field, what is wrong and what is allowed, in the words
//! of this program. The cases are in `scenes/errors.txt`.

use sim_solver::Scene;
use sim_types::{COLLIDERS_MAX, SCENE_SIZE_BYTES_MAX};

/// Wrong scenes with their errors.
const CASES: &str = include_str!("scenes/errors.txt");

fn error(text: &str) -> String {
    match Scene::from_toml(text, "f.toml") {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

/// Returns the scenes of the file, with the version, and their errors.
fn cases() -> impl Iterator<Item = (String, String)> {
    CASES.split("\n\n").skip(1).map(|block| {
        let (text, expected) = block.trim_end().split_once("\n=> ").unwrap();
        (format!("version = 1\n{text}"), format!("f.toml:{expected}"))
    })
}

#[test]
fn every_wrong_value_is_named_with_line_field_and_remedy() {
    let differences: Vec<_> = cases()
        .filter_map(|(text, expected)| {
            let error = error(&text);
            (error != expected)
                .then(|| format!("{text}\n  expected {expected}\n  got      {error}"))
        })
        .collect();
    assert!(differences.is_empty(), "{}", differences.join("\n\n"));
    assert!(cases().count() > 150);
}

#[test]
fn the_version_is_required_and_checked_first() {
    for (text, expected) in [
        ("", "f.toml:1: version: is missing (allowed: 1)"),
        ("name = \"x\"\nup = \"q\"", "f.toml:1: version: is missing (allowed: 1)"),
        ("version = 2\nup = \"q\"", "f.toml:1: version: 2 is out of range (allowed: 1)"),
        ("version = 1.5", "f.toml:1: version: is the number 1.5 (allowed: a whole number)"),
        ("version = \"1\"", "f.toml:1: version: is the text \"1\" (allowed: a whole number)"),
    ] {
        assert_eq!(error(text), expected);
    }
}

#[test]
fn a_scene_with_too_many_colliders_is_refused() {
    let with_colliders = |count| {
        let collider = "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\n";
        error(&format!("version = 1\n{}", collider.repeat(count)))
    };
    assert_eq!(with_colliders(COLLIDERS_MAX), "accepted");
    let expected = "f.toml:262146: collider[65536]: is one of 65537 colliders (allowed: 65536)";
    assert_eq!(with_colliders(COLLIDERS_MAX + 1), expected);
}

#[test]
fn a_scene_whose_complete_text_is_too_long_is_refused() {
    let with_unit = |length| error(&format!("version = 1\nunit = \"{}\"", "m".repeat(length)));
    assert_eq!(with_unit(SCENE_SIZE_BYTES_MAX - 1000), "accepted");
    let error = with_unit(SCENE_SIZE_BYTES_MAX - 21);
    let (size_bytes, rest) = error
        .strip_prefix("f.toml:1: scene: has ")
        .and_then(|error| error.split_once(" bytes of text "))
        .unwrap_or_else(|| panic!("{}", &error[..100.min(error.len())]));
    assert!(size_bytes.parse::<usize>().unwrap() > SCENE_SIZE_BYTES_MAX);
    assert_eq!(rest, "with every default and mesh written out (allowed: 16777216)");
}

#[test]
fn a_text_that_is_too_long_is_refused() {
    let error = error(&"#".repeat(SCENE_SIZE_BYTES_MAX + 1));
    assert_eq!(error, "f.toml:1: scene: has 16777217 bytes of text (allowed: 16777216)");
}

#[test]
fn no_error_shows_an_internal_name_or_says_a_thing_twice() {
    for (text, _) in cases() {
        let error = error(&text);
        for internal in
            ["File", "struct ", "enum ", "untagged", "variant", "i64", "f64", "u32", "$_"]
        {
            assert!(!error.contains(internal), "{internal}: {error}");
        }
        for word in ["f.toml", "(allowed"] {
            assert!(error.matches(word).count() <= 1, "{word}: {error}");
        }
    }
}
