//! The structure and the prose of the repository: dependencies between crates and between files, the
//! first words of doc comments, and phrases to avoid.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use cargo_metadata::MetadataCommand;

mod module_graph;

/// The allowed dependencies: each crate with the workspace crates and restricted libraries it may use.
/// Every crate also uses `build-features`, which has no code.
const ARROWS: [(&str, &[&str]); 15] = [
    ("sim-types", &[]),
    ("sim-host", &["sim-types"]),
    ("sim-messages", &["sim-types"]),
    ("sim-scene", &["sim-types"]),
    ("sim-solver", &["sim-scene", "sim-types"]),
    ("sim-contract", &["iceoryx2", "sim-host", "sim-messages"]),
    ("sim-c", &["sim-contract", "sim-host"]),
    ("catenary-python", &["recording", "sim-contract", "sim-host", "sim-solver"]),
    ("sim-cli", &["sim-host", "sim-types"]),
    ("sim-lessons", &["sim-solver"]),
    ("sim-node", &["sim-cli", "sim-contract", "sim-host", "sim-lessons", "sim-solver"]),
    ("recorder", &["mcap", "recording", "sim-cli", "sim-contract", "sim-host", "sim-solver"]),
    ("recording", &["mcap", "sim-host", "sim-messages", "sim-solver"]),
    (
        "viewer-bridge",
        &["foxglove", "recording", "sim-cli", "sim-contract", "sim-host", "sim-solver"],
    ),
    (
        "integration-tests",
        &["recording", "sim-contract", "sim-host", "sim-solver", "viewer-bridge"],
    ),
];

/// Words that do not begin a doc comment. It begins with a noun phrase or a third-person verb.
const OPENINGS: [&str; 5] = ["What", "How", "Whether", "Who", "That"];

/// Phrases that a native engineer would not write, in lower case. A bar in each keeps this table from
/// matching itself.
const PHRASES: &[&str] = &[
    "who|ever",
    "who comes l|ate",
    "so m|any",
    "no n|umber",
    "other o|nes",
    "that there is n|ot",
    "is none o|f",
    "of no m|eaning",
    "what is f|ree",
    "made w|hole",
    "big p|ages",
    "gives b|ack",
    "worked o|ut",
    "works o|ut",
    "is t|old",
    "are t|old",
    "it is s|aid",
    "has w|hat",
    "have w|hat",
    "any m|ore.",
    "for e|ver",
    "in v|ain",
    "in good o|rder",
    "lets g|o",
    "let g|o of",
    "letting g|o",
    "nobody w|ho",
    "to be h|ad",
    "passed o|ver",
    "takes b|ack",
    "a place is t|aken",
    "written a|new",
    "read a|new",
    "is no r|ecording",
    "is no s|cene",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// Returns all files of the repository with one of these extensions, relative to its root.
fn files(extensions: &[&str]) -> Vec<PathBuf> {
    let root = root();
    let mut folders = vec![root.clone()];
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in folder.read_dir().unwrap().map(|entry| entry.unwrap().path()) {
            let name = entry.file_name().and_then(|name| name.to_str()).unwrap();
            if entry.is_dir() && !["target", "node_modules", ".git", ".venv"].contains(&name) {
                folders.push(entry);
            } else if extensions.iter().any(|one| entry.extension().is_some_and(|it| it == *one)) {
                files.push(entry.strip_prefix(&root).unwrap().to_owned());
            }
        }
    }
    files.sort();
    assert!(files.len() > 30, "found only {} files", files.len());
    files
}

/// Returns the text of a file, relative to the root of the repository.
fn read(file: &Path) -> String {
    std::fs::read_to_string(root().join(file)).unwrap()
}

#[test]
fn dependencies_between_crates_follow_the_architecture() {
    let manifest = root().join("Cargo.toml");
    let metadata = MetadataCommand::new().manifest_path(manifest).no_deps().exec().unwrap();
    let watched: BTreeSet<&str> = ARROWS
        .iter()
        .flat_map(|(name, arrows)| [*name].into_iter().chain(arrows.iter().copied()))
        .collect();
    let mut actual = BTreeMap::new();
    for package in metadata.packages.iter().filter(|package| package.name != "build-features") {
        // Dependencies of every kind: those of tests tie crates together as well.
        let names = package.dependencies.iter().map(|one| one.name.as_str());
        let names = names.filter(|name| watched.contains(name));
        actual.insert(package.name.as_str(), names.collect::<BTreeSet<_>>());
    }
    let allowed: BTreeMap<_, BTreeSet<_>> =
        ARROWS.iter().map(|(name, arrows)| (*name, arrows.iter().copied().collect())).collect();
    assert_eq!(actual, allowed);
}

/// The prose of a file as one text, so that a phrase is found across lines.
struct Prose {
    /// All lines without comment markers and repeated spaces, in lower case.
    text: String,
    /// Offset of each line in the text.
    starts: Vec<usize>,
}

impl Prose {
    fn new(content: &str) -> Self {
        let (mut text, mut starts) = (String::new(), Vec::new());
        for line in content.lines() {
            starts.push(text.len());
            let line = line.trim_start().trim_start_matches(['/', '!', '*', '#']);
            text.extend(line.split_whitespace().flat_map(|word| [word, " "]));
        }
        text.make_ascii_lowercase();
        Self { text, starts }
    }

    /// Returns the numbers of the lines on which a phrase of whole words begins.
    fn lines_with(&self, phrase: &str) -> Vec<usize> {
        let is_word = |at: char| at.is_alphanumeric() || at == '_';
        let matches = self.text.match_indices(phrase).map(|(offset, _)| offset);
        matches
            .filter(|offset| !self.text[..*offset].ends_with(is_word))
            .filter(|offset| !self.text[offset + phrase.len()..].starts_with(is_word))
            .map(|offset| self.starts.partition_point(|start| *start <= offset))
            .collect()
    }
}

/// Returns the marker of a doc comment and the text after it.
fn doc_comment(line: &str) -> Option<(&str, &str)> {
    let line = line.trim_start();
    ["///", "//!", "/**", "\"\"\""]
        .iter()
        .find_map(|marker| Some((*marker, line.strip_prefix(marker)?.trim_start())))
}

/// Returns the numbers of the lines on which a doc comment begins with a word of [`OPENINGS`].
fn lines_with_openings(content: &str) -> Vec<usize> {
    let mut before = None;
    let mut lines = Vec::new();
    for (number, line) in (1..).zip(content.lines()) {
        let comment = doc_comment(line);
        let marker = comment.map(|(marker, _)| marker);
        let word = comment.and_then(|(_, text)| text.split(|at: char| !at.is_alphabetic()).next());
        if marker != before && word.is_some_and(|word| OPENINGS.contains(&word)) {
            lines.push(number);
        }
        before = marker;
    }
    lines
}

#[test]
fn prose_avoids_banned_openings_and_phrases() {
    let mut faults = Vec::new();
    for file in files(&["rs", "md", "js", "toml", "html", "py"]) {
        let content = read(&file);
        let mut add = |lines: Vec<usize>, fault: &str| {
            let path = file.display();
            faults.extend(lines.iter().map(|line| format!("{path}:{line}: {fault}")));
        };
        add(lines_with_openings(&content), "reword the first word of the doc comment");
        let prose = Prose::new(&content);
        for phrase in PHRASES.iter().map(|phrase| phrase.replace('|', "")) {
            add(prose.lines_with(&phrase), &format!("reword \"{phrase}\""));
        }
    }
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}

#[test]
fn the_prose_check_finds_faults() {
    let content = "/// What it is.\n/// How it is.\nfn a() {}\n    //! Who.\n/** That. */\n";
    assert_eq!(lines_with_openings(content), [1, 4, 5]);
    let prose = Prose::new("one\n// Two three\n// four, xthree four, three fours\n");
    assert_eq!(prose.lines_with("three four"), [2]);
}

/// Returns true if a line of code has the keyword `unsafe`.
fn is_unsafe(line: &str) -> bool {
    let code = line.split("//").next().unwrap_or(line);
    let words = ["{", "fn ", "impl ", "impl<", "trait ", "extern "];
    let follows = |rest: &str| words.iter().any(|one| rest.starts_with(one));
    code.contains("#[unsafe(") || code.split("unsafe ").skip(1).any(follows)
}

/// Returns the paths in the paragraph of ARCHITECTURE.md on unsafe code. Files come before their folder.
fn listed_as_unsafe(architecture: &str) -> BTreeSet<PathBuf> {
    let from = architecture.split_once("`unsafe` code is in ").unwrap().1;
    let paragraph = from.split("\n\n").next().unwrap_or(from);
    let (mut paths, mut files) = (BTreeSet::new(), Vec::new());
    for span in paragraph.split('`').skip(1).step_by(2) {
        if !span.ends_with('/') {
            files.push(span);
        } else if files.is_empty() {
            paths.insert(PathBuf::from(span));
        } else {
            paths.extend(files.drain(..).map(|file| Path::new(span).join(file)));
        }
    }
    paths
}

#[test]
fn unsafe_code_is_where_the_architecture_says() {
    let listed = listed_as_unsafe(&read(Path::new("ARCHITECTURE.md")));
    let is_test = |file: &Path| file.iter().any(|part| part == "tests" || part == "benches");
    let is_found = |file: &PathBuf| !is_test(file) && read(file).lines().any(is_unsafe);
    let found: Vec<_> = files(&["rs"]).into_iter().filter(is_found).collect();
    let missing: Vec<_> =
        found.iter().filter(|file| !listed.iter().any(|path| file.starts_with(path))).collect();
    let unused: Vec<_> =
        listed.iter().filter(|path| !found.iter().any(|file| file.starts_with(path))).collect();
    assert!(
        missing.is_empty() && unused.is_empty(),
        "ARCHITECTURE.md does not list {missing:?}, and lists {unused:?} without unsafe code"
    );
}

#[test]
fn the_check_for_unsafe_code_finds_it() {
    for line in [
        "unsafe { a }",
        "pub unsafe fn a()",
        "#[unsafe(no_mangle)]",
        "unsafe impl A for B {}",
        "unsafe impl<T> A for B<T> {}",
        "pub unsafe trait A {",
    ] {
        assert!(is_unsafe(line), "{line}");
    }
    for line in ["// unsafe { a }", "#![forbid(unsafe_code)]", "fn is_unsafe(a: char)"] {
        assert!(!is_unsafe(line), "{line}");
    }
    let text = "`unsafe` code is in `a/`, in `b.rs` and `c/d.rs` of\n`e/`, and in `f/`.\n\n`g/`";
    let expected = ["a/", "e/b.rs", "e/c/d.rs", "f/"].map(PathBuf::from);
    assert_eq!(listed_as_unsafe(text), BTreeSet::from(expected));
}

#[test]
fn files_within_a_crate_form_no_circle() {
    let manifest = root().join("Cargo.toml");
    let metadata = MetadataCommand::new().manifest_path(manifest).no_deps().exec().unwrap();
    for package in &metadata.packages {
        let src = package.manifest_path.parent().unwrap().join("src");
        if !src.exists() {
            continue;
        }
        let circles = module_graph::circles(src.as_std_path());
        assert!(
            circles.is_empty(),
            "files of {} use each other in a circle; move what they share into a file below them: \
             {circles:?}",
            package.name
        );
    }
}
