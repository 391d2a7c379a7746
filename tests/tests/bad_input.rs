//! The node refuses bad input with an exit code, the place of the error and the remedy.

use integration_tests::{Finished, Process, Program, Sandbox};

fn run(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::SimNode, sandbox, args)
}

/// Asserts the exit code, an empty stdout, and words in the error message.
fn assert_refused(finished: &Finished, code: i32, words: &[&str]) {
    assert_eq!(finished.code, Some(code), "{}", finished.stderr);
    assert_eq!(finished.stdout, "");
    for word in words {
        assert!(finished.stderr.contains(word), "no \"{word}\" in: {}", finished.stderr);
    }
}

#[test]
fn an_unknown_scene_or_file_is_named_with_the_alternatives() {
    let sandbox = Sandbox::new();
    assert_refused(&run(&sandbox, &["run", "courtain"]), 1, &["'courtain'", "curtain, rope"]);
    assert_refused(&run(&sandbox, &["check", "./none.toml"]), 1, &["./none.toml", "No such file"]);
    let folder = sandbox.path("");
    assert_refused(&run(&sandbox, &["run", &folder]), 1, &[&folder]);
}

#[test]
fn an_invalid_scene_file_is_refused_with_line_field_and_remedy() {
    let sandbox = Sandbox::new();
    let file = sandbox.write("wrong.toml", "version = 1\n[solver]\nrate_hz = 0\n");
    for verb in ["run", "check", "show"] {
        let finished = run(&sandbox, &[verb, &file]);
        assert_refused(&finished, 1, &[]);
        let expected =
            format!("error: {file}:3: solver.rate_hz: 0 is out of range (allowed: 1 to 100000)\n");
        assert_eq!(finished.stderr, expected);
    }
}

#[test]
fn invalid_options_exit_with_2_and_invalid_rates_name_the_range() {
    let sandbox = Sandbox::new();
    for args in
        [&["run", "--speed", "3"][..], &["run", "--every", "0"], &["ctl", "grab", "90"], &["ctl"]]
    {
        assert_eq!(run(&sandbox, args).code, Some(2), "{args:?}");
    }
    for line in [
        "set gravity 0 -1.6",
        "set gravity 0 off 0",
        "set damping much",
        "set compliance 1 --kind knot",
        "push 0 0 0 --radius 1",
        "cut -1",
        "cut-segment --from 0 0 0 --to 1 0",
        "move-anchor 0 0 0 0 --rotation 0 0 1",
        "load",
    ] {
        let args: Vec<_> = ["ctl"].into_iter().chain(line.split(' ')).collect();
        assert_refused(&run(&sandbox, &args), 2, &["--help"]);
    }
    for rate in ["0", "100001", "-5", "fast"] {
        let finished = run(&sandbox, &["run", "--rate", rate]);
        assert_refused(&finished, 2, &["--rate", rate]);
    }
    assert_refused(
        &run(&sandbox, &["run", "--rate", "0"]),
        2,
        &["a whole number from 1 to 100000"],
    );
    assert_refused(
        &run(&sandbox, &["run", "--substeps", "0"]),
        2,
        &["a whole number from 1 to 1000"],
    );
    assert_refused(&run(&sandbox, &["run", "--name", "a/b"]), 2, &["a/b"]);
    assert_refused(&run(&sandbox, &["run", "--domain", "Big Domain"]), 2, &["Big Domain"]);
    for empty in [&["run", "--domain", ""][..], &["run", "--domain="]] {
        assert_eq!(run(&sandbox, empty).code, Some(2), "{empty:?}");
    }
    assert_refused(&run(&sandbox, &["run", "--domain", ""]), 2, &["1 to 24 characters"]);
}

#[test]
fn a_missing_node_is_reported_with_its_domain_and_how_to_start_one() {
    let sandbox = Sandbox::new();
    for args in [&["ctl", "status"][..], &["ctl", "pin", "3"], &["ctl", "hash"]] {
        let finished = run(&sandbox, args);
        assert_refused(&finished, 1, &["no node runs as 'sim'", sandbox.domain(), "sim-node run"]);
    }
}

#[test]
fn check_accepts_every_scene_that_scenes_lists_and_show_prints() {
    let sandbox = Sandbox::new();
    let listed = run(&sandbox, &["scenes", "--json"]).json();
    let curtain = listed.as_array().unwrap().iter().find(|one| one["name"] == "curtain").unwrap();
    assert_eq!((&curtain["particles"], &curtain["constraints"]), (&168.into(), &596.into()));
    assert_eq!(curtain["pins"], 14);
    assert!(!curtain["text"].as_str().unwrap().is_empty());
    for name in listed.as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap()) {
        let shown = run(&sandbox, &["show", name]).success();
        let file = sandbox.write("shown.toml", &shown);
        let checked = run(&sandbox, &["check", "--json", &file]).json();
        assert_eq!(checked["name"], name);
        assert_eq!(checked["warnings"].as_array().unwrap().len(), 0);
        assert_eq!(run(&sandbox, &["show", &file]).success(), shown);
    }
}
