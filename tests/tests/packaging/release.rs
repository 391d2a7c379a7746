//! The files of a release, as far as they can be checked without building one; `.ci/nightly` builds and installs it.

use cargo_metadata::MetadataCommand;
use integration_tests::{Process, Program, Sandbox};

const CONTAINER: &str = include_str!("../../../packaging/Containerfile");
const RELEASE: &str = include_str!("../../../packaging/release");

#[test]
fn the_command_of_the_container_runs_a_node_and_its_page() {
    let line = CONTAINER.lines().find_map(|line| line.strip_prefix("CMD ")).unwrap();
    let command: Vec<String> = serde_json::from_str(line).unwrap();
    let [shell, option, script] = &command[..] else { panic!("{line}") };
    assert_eq!((shell.as_str(), option.as_str()), ("/bin/sh", "-c"));
    let (node, page) = script.split_once(" & exec ").unwrap();
    // Another program of this host may have the port.
    let page = page.replace(":8080", ":0");
    let sandbox = Sandbox::new();
    let words = |line, program| -> Vec<_> {
        str::strip_prefix(line, program).unwrap().split_whitespace().collect()
    };
    let node = Process::start_ready(Program::SimNode, &sandbox, &words(node, "sim-node"));
    let page =
        Process::start_ready(Program::ViewerBridge, &sandbox, &words(&page, "viewer-bridge"));
    page.interrupt().success();
    node.interrupt().success();
}

#[test]
fn cargo_binstall_looks_for_the_archive_under_its_name() {
    assert!(RELEASE.contains("\nname=catenary-$version-$target\n"));
    assert!(RELEASE.contains("\"$out/$name.tar.gz\""));
    let metadata = MetadataCommand::new().no_deps().exec().unwrap();
    for program in ["sim-node", "recorder", "viewer-bridge"] {
        let package = metadata.packages.iter().find(|one| one.name == program).unwrap();
        let binstall = &package.metadata["binstall"];
        let url = binstall["pkg-url"].as_str().unwrap();
        assert!(url.ends_with("/catenary-{ version }-{ target }.tar.gz"), "{url}");
        assert_eq!(binstall["bin-dir"], "catenary-{ version }-{ target }/bin/{ bin }");
    }
}
