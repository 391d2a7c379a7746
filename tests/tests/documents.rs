//! The reference documents agree with the programs: their examples run, and they list every scene key,
//! every kind of command, every built-in scene and every recorded topic.

use std::collections::BTreeSet;
use std::path::Path;

use integration_tests::{Process, Program, Sandbox};
use recording::Topic;
use sim_contract::PARAMETERS;

const README: &str = include_str!("../../README.md");
const FIRST_STEPS: &str = include_str!("../../docs/first-steps.md");
const ROBOTICS: &str = include_str!("../../docs/robotics.md");
const GAMES: &str = include_str!("../../docs/games.md");
const RUST_AND_C: &str = include_str!("../../docs/rust-and-c.md");
const TEACHING: &str = include_str!("../../docs/teaching.md");
const SCENES: &str = include_str!("../../sim-node/scenes/README.md");
const SOLVER: &str = include_str!("../../sim-node/solver/README.md");
const CONTRACT: &str = include_str!("../../sim-node/contract/README.md");
const RECORDER: &str = include_str!("../../recorder/README.md");
const DICTIONARY: &str = include_str!("../fuzz/dictionaries/scene.dict");
const JSON_DICTIONARY: &str = include_str!("../fuzz/dictionaries/json.dict");
const VIEWER: &str = include_str!("../../viewer-bridge/README.md");

/// Returns the fenced blocks of a language, each with the number of its first line.
fn blocks(document: &str, language: &str) -> Vec<(usize, String)> {
    let mut blocks: Vec<(usize, String)> = Vec::new();
    let mut fence = None;
    for (number, line) in (1..).zip(document.lines()) {
        match (line.strip_prefix("```"), fence) {
            (Some(_), Some(_)) => fence = None,
            (Some(opened), None) => {
                fence = Some(opened);
                if opened == language {
                    blocks.push((number + 1, String::new()));
                }
            }
            (None, Some(opened)) if opened == language => {
                let (_, text) = blocks.last_mut().unwrap();
                text.push_str(line);
                text.push('\n');
            }
            (None, _) => {}
        }
    }
    assert!(fence.is_none(), "a fence is not closed");
    blocks
}

/// Returns the values that an error message lists as allowed.
fn allowed(error: &str) -> Vec<&str> {
    let (_, list) = error.split_once("(allowed: ").unwrap();
    list.split_once(')').unwrap().0.split(", ").collect()
}

#[test]
fn every_scene_in_a_document_is_accepted_without_a_warning_and_runs() {
    let sandbox = Sandbox::new();
    let mut count = 0;
    for (name, document) in [("teaching", TEACHING), ("scenes", SCENES), ("solver", SOLVER)] {
        for (line, text) in blocks(document, "toml") {
            let scene = sandbox.write(&format!("{name}-line-{line}.toml"), &text);
            let checked = Process::run(Program::SimNode, &sandbox, &["check", "--json", &scene]);
            let warnings = checked.json()["warnings"].clone();
            assert_eq!(warnings.as_array().map(Vec::len), Some(0), "{scene}: {warnings}");
            let args = ["simulate", &scene, "--steps", "10"];
            Process::run(Program::Recorder, &sandbox, &args).success();
            count += 1;
        }
    }
    assert!(count >= 7, "found only {count} scenes");
}

#[test]
fn the_program_for_rust_checks_the_outcome_of_its_command() {
    let programs = blocks(RUST_AND_C, "rust,no_run");
    assert_eq!(programs.len(), 1);
    let (_, after) = programs[0].1.split_once(".request(").unwrap();
    assert!(after.contains(".is_applied()"), "a rejection is an outcome, not an error");
}

#[test]
fn the_scene_reference_and_the_dictionary_of_the_fuzzer_name_every_key() {
    let sandbox = Sandbox::new();
    let shapes = [
        ("collider", ["plane", "box", "sphere", "capsule", "bounds", "mesh"].as_slice()),
        ("generate", &["cloth", "mesh", "rope", "web", "bridge", "ragdoll", "obj"]),
    ];
    let shaped = shapes.into_iter().flat_map(|(table, shapes)| {
        shapes.iter().map(move |shape| format!("[[{table}]]\nshape = \"{shape}\""))
    });
    let tables = [
        "",
        "[solver]",
        "[wind]",
        "[contact]",
        "[[particle]]\nposition = [0, 0, 0]",
        "[[constraint]]\nparticles = [0, 1]",
        "[[bend]]\nparticles = [0, 1, 2]",
        "[[anchor]]\nparticles = []",
        "[[anchor]]\nparticles = []\n[[anchor.path]]\ntime = 0",
        "[[generate]]\nshape = \"obj\"\n[generate.compliance]",
        "[[generate]]\nshape = \"obj\"\n[[generate.groups]]",
    ];
    for table in tables.map(str::to_owned).into_iter().chain(shaped) {
        let scene = sandbox.write("wrong.toml", &format!("version = 1\n{table}\nnonsense = 1\n"));
        let checked = Process::run(Program::SimNode, &sandbox, &["check", &scene]);
        assert_eq!(checked.code, Some(1), "{table}");
        let (_, unknown) = checked.stderr.split_once("nonsense: unknown key").unwrap();
        for key in allowed(unknown) {
            assert!(SCENES.contains(&format!("`{key}`")), "{table}: {key} is not documented");
            let is_known = DICTIONARY.contains(&format!("\"{key}\"\n"));
            assert!(is_known, "{table}: {key} is not in the dictionary of the fuzzer");
        }
    }
}

#[test]
fn the_dictionary_of_the_fuzzer_names_every_parameter() {
    for parameter in PARAMETERS.map(|info| info.name) {
        let entry = format!(r#""\"{parameter}\"""#);
        assert!(JSON_DICTIONARY.contains(&entry), "{parameter} is not in the dictionary");
    }
}

#[test]
fn the_scene_reference_names_every_built_in_scene() {
    let sandbox = Sandbox::new();
    let listed = Process::run(Program::SimNode, &sandbox, &["scenes", "--json"]).json();
    for scene in listed.as_array().unwrap() {
        let name = scene["name"].as_str().unwrap();
        assert!(SCENES.contains(&format!("| `{name}` |")), "{name} is not documented");
    }
}

#[test]
fn every_command_in_the_reference_is_accepted_and_every_kind_has_an_example() {
    let sandbox = Sandbox::new();
    let simulate = |commands: &str| {
        let file = sandbox.write("commands.jsonl", commands);
        let args = ["simulate", "curtain", "--steps", "400", "--commands", &file];
        Process::run(Program::Recorder, &sandbox, &args)
    };
    let commands = blocks(CONTRACT, "json");
    assert!(!commands.is_empty());
    for (line, text) in &commands {
        let done = simulate(text);
        assert_eq!(done.code, Some(0), "block of line {line}: {}", done.stderr);
        // The curtain has no anchor, so some commands are rejected, but all of them are reached.
        assert!(!done.stderr.contains("for steps after"), "block of line {line}: {}", done.stderr);
    }
    let wrong = simulate(r#"{"step":1,"kind":"nonsense"}"#);
    for kind in allowed(&wrong.stderr) {
        let field = format!(r#""kind":"{kind}""#);
        assert!(commands.iter().any(|(_, text)| text.contains(&field)), "{kind} has no example");
    }
}

/// The cells in backticks of the first column of a document's table of topics.
fn table_topics(document: &str) -> Vec<&str> {
    let rows = document.lines().filter_map(|line| line.strip_prefix("| `/"));
    let cells = rows.map(|row| row.split_once(" |").unwrap().0);
    cells.flat_map(|cell| cell.split(", ")).map(|topic| topic.trim_matches(['`', '/'])).collect()
}

#[test]
fn the_tables_of_topics_name_those_that_exist() {
    let recorded: BTreeSet<_> =
        Topic::ALL.iter().map(|topic| topic.name().trim_start_matches('/')).collect();
    assert_eq!(table_topics(RECORDER).into_iter().collect::<BTreeSet<_>>(), recorded);
    let served = table_topics(VIEWER);
    assert!(served.len() > 5, "found only {served:?}");
    for topic in served {
        assert!(topic == "scene" || recorded.contains(topic), "{topic} does not exist");
    }
}

/// Returns the commands of a document: its blocks of `sh`, and the first cells of its tables, each with its line.
fn commands(document: &str) -> Vec<(usize, String)> {
    let rows = (1..).zip(document.lines());
    let cells = rows.filter_map(|(line, row)| {
        let (cell, _) = row.strip_prefix("| `")?.split_once('`')?;
        Some((line, cell.to_owned()))
    });
    blocks(document, "sh").into_iter().chain(cells).collect()
}

#[test]
fn every_option_in_the_commands_of_a_document_exists() {
    let sandbox = Sandbox::new();
    let documents = [README, FIRST_STEPS, ROBOTICS, GAMES, RUST_AND_C, TEACHING, RECORDER, VIEWER];
    let mut count = 0;
    for (line, text) in documents.into_iter().flat_map(commands) {
        for command in text.lines() {
            let mut words = command.split('#').next().unwrap().split_whitespace();
            let program = match words.next() {
                Some("recorder") => Program::Recorder,
                Some("viewer-bridge") => Program::ViewerBridge,
                _ => continue,
            };
            let words: Vec<_> = words.collect();
            let subcommand = words.first().filter(|word| !word.starts_with('-'));
            let args: Vec<_> = subcommand.copied().into_iter().chain(["--help"]).collect();
            let help = Process::run(program, &sandbox, &args).success();
            for option in words.iter().filter(|word| word.starts_with('-')) {
                assert!(help.contains(option), "block of line {line}: {command}: no {option}");
                count += 1;
            }
        }
    }
    assert!(count > 10, "found only {count} options");
}

/// The paths that a document names in backticks: those with a folder and an extension.
fn named_paths(document: &str) -> Vec<&str> {
    let spans = document.split('`').skip(1).step_by(2);
    let is_source = |span: &str| Path::new(span).extension().is_some_and(|one| one == "rs");
    let is_path = |span: &&str| span.contains('/') && is_source(span);
    spans.filter(is_path).collect()
}

#[test]
fn the_architecture_names_files_that_exist_and_fits_a_sitting() {
    const ARCHITECTURE: &str = include_str!("../../ARCHITECTURE.md");
    assert!(ARCHITECTURE.lines().count() <= 200, "at most 200 lines");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let paths = named_paths(ARCHITECTURE);
    assert!(paths.len() > 20, "only {} paths found", paths.len());
    for path in paths {
        // Within the section on the step, paths are relative to the solver's sources, and in the list of unsafe code to
        // its store.
        let folders = ["", "sim-node/solver/src", "sim-node/solver/src/store"];
        let is_file = |folder: &&str| root.join(folder).join(path).is_file();
        assert!(folders.iter().any(is_file), "{path} does not exist");
    }
}
