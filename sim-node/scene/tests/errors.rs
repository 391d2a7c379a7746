//! Errors in scenes: each names the line, the field, what is wrong and what is allowed, in the words
//! of this program. The cases are in `errors.txt`.

use sim_scene::Scene;
use sim_types::{COLLIDERS_MAX, SCENE_SIZE_BYTES_MAX};

/// Wrong scenes with their errors.
const CASES: &str = include_str!("errors.txt");

fn error(text: &str) -> String {
    match Scene::from_toml(text, "f.toml") {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.list(),
    }
}

/// Returns the scenes of the file, with the version, and their errors.
fn cases() -> impl Iterator<Item = (String, String)> {
    CASES.split("\n\n").skip(1).map(|block| {
        let (text, expected) = block.trim_end().split_once("\n=> ").unwrap();
        let expected = expected.replace("\n=> ", "\nf.toml:");
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
        for line in error.lines() {
            for word in ["f.toml", "(allowed"] {
                assert_eq!(line.matches(word).count(), 1, "{word}: {error}");
            }
        }
    }
}

#[test]
fn the_text_of_an_error_is_its_first_problem_and_the_number_of_the_others() {
    let text = "version = 1\nup = \"q\"\nunit = 3\n[solver]\nrate_hz = 0\n";
    let error = Scene::from_toml(text, "f.toml").unwrap_err();
    let expected = "f.toml:2: up: \"q\" is unknown (allowed: y, -y, z) (and 2 more errors; `sim-node check` lists all)";
    assert_eq!(error.to_string(), expected);
    assert_eq!(error.list().lines().count(), 3);
}

#[test]
fn a_list_of_errors_ends_after_a_thousand() {
    let list = error(&format!("version = 1\n{}", "[[particle]]\nposition = 1\n".repeat(5000)));
    let lines: Vec<_> = list.lines().collect();
    assert_eq!((lines.len(), lines[1000]), (1001, "f.toml: and 4000 more errors"));
    for (index, line) in lines[..1000].iter().enumerate() {
        let start = format!("f.toml:{}: particle[{index}].position: ", 3 + 2 * index);
        assert!(line.starts_with(&start), "{line}");
    }
}

#[test]
fn a_misspelt_method_has_no_consequences() {
    let text = "[solver]\nmethod = \"pdb\"\n[[generate]]\nshape = \"ragdoll\"\nheight = 1\nstiffness = { shear = 0.5 }\n";
    let expected =
        "f.toml:3: solver.method: \"pdb\" is unknown (did you mean 'pbd'?) (allowed: xpbd, pbd)";
    assert_eq!(error(&format!("version = 1\n{text}")), expected);
}

#[test]
fn a_list_in_base64_is_checked_like_another() {
    let with = |vertices: &str, faces: &str| {
        error(&format!(
            "version = 1\n[[generate]]\nshape = \"obj\"\nvertices = \"{vertices}\"\nfaces = \"{faces}\"\n"
        ))
    };
    // Three points, the first of them at infinity.
    let far = "AACAfwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/";
    let near = "AACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/";
    assert_eq!(with(near, "AwABAg=="), "accepted");
    for (vertices, faces, expected) in [
        (far, "AwABAg==", "4: generate[0].vertices: inf is out of range (allowed: -1e7 to 1e7;"),
        ("AACAfw==", "AwABAg==", "4: generate[0].vertices: is not base64 of whole elements"),
        (near, "AwABAw==", "5: generate[0].faces: face 0 is [0, 1, 3] (allowed: 3 or more"),
        (near, "BAABAg==", "5: generate[0].faces: is not base64 of whole elements"),
        (near, "Aw", "5: generate[0].faces: is not base64 of whole elements"),
    ] {
        let error = with(vertices, faces);
        assert!(error.contains(expected), "{error}");
    }
}
