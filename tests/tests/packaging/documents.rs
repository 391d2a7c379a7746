//! Completion scripts and man pages name what the help texts name.

use std::fs;

use integration_tests::{Process, Program, Sandbox};

const PROGRAMS: [(Program, &str); 3] = [
    (Program::SimNode, "sim-node"),
    (Program::Recorder, "recorder"),
    (Program::ViewerBridge, "viewer-bridge"),
];

/// A subcommand, or the program itself, with its help text.
struct Page {
    /// Program and subcommands, such as `sim-node ctl grab`.
    words: Vec<String>,
    help: String,
}

impl Page {
    /// Returns the first words of the list of subcommands.
    fn subcommands(&self) -> Vec<String> {
        let list = self.help.split_once("\nCommands:\n").map_or("", |(_, rest)| rest);
        let lines = list.lines().take_while(|line| !line.is_empty());
        let names = lines.filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
        names.filter(|name| !["", "help"].contains(name)).map(ToOwned::to_owned).collect()
    }

    /// Returns the long options. Their lines are indented by two spaces and a short option, or by six
    /// spaces; text is indented further.
    fn options(&self) -> Vec<String> {
        let after_short =
            |line: &str| line.strip_prefix("  -").is_some_and(|rest| !rest.starts_with('-'));
        let lines =
            self.help.lines().filter(|line| line.starts_with("      --") || after_short(line));
        let long = lines.filter_map(|line| line.get("      --".len()..));
        let end = |at: char| !at.is_ascii_alphanumeric() && at != '-';
        long.map(|line| format!("--{}", line.split(end).next().unwrap())).collect()
    }
}

/// Returns the pages of a program and of all its subcommands.
fn pages(program: Program, name: &str, sandbox: &Sandbox) -> Vec<Page> {
    let mut open = vec![vec![name.to_owned()]];
    let mut pages = Vec::new();
    while let Some(words) = open.pop() {
        let args = words[1..].iter().map(String::as_str).chain(["--help"]).collect::<Vec<_>>();
        let page =
            Page { help: Process::run(program, sandbox, &args).success(), words: words.clone() };
        let children = page.subcommands().into_iter();
        open.extend(children.map(|child| [words.as_slice(), &[child]].concat()));
        pages.push(page);
    }
    pages
}

/// Completes the last word of a command line, as bash does with this script.
fn complete(script: &str, words: &[&str], sandbox: &Sandbox) -> Vec<String> {
    let call = r#"source "$0" && [[ $(complete -p "$1") =~ -F\ ([^ ]+) ]] &&
        COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) &&
        "${BASH_REMATCH[1]}" "$1" "${COMP_WORDS[-1]}" "${COMP_WORDS[-2]}" && printf '%s\n' "${COMPREPLY[@]}""#;
    let args = ["-c", call, script].iter().chain(words).copied().collect::<Vec<_>>();
    let output = Process::run(Program::Bash, sandbox, &args).success();
    output.lines().map(ToOwned::to_owned).collect()
}

#[test]
fn bash_completes_every_subcommand_and_option() {
    let sandbox = Sandbox::new();
    let mut option_count = 0;
    for (program, name) in PROGRAMS {
        let script = Process::run(program, &sandbox, &["completions", "bash"]).success();
        let script = sandbox.write(&format!("{name}.bash"), &script);
        for page in pages(program, name, &sandbox) {
            let words = page.words.iter().map(String::as_str);
            let after = |prefix| words.clone().chain([prefix]).collect::<Vec<_>>();
            let completed = complete(&script, &after(""), &sandbox);
            for subcommand in page.subcommands() {
                assert!(completed.contains(&subcommand), "{:?}: no {subcommand}", page.words);
            }
            let completed = complete(&script, &after("--"), &sandbox);
            for option in page.options() {
                assert!(completed.contains(&option), "{:?}: no {option}", page.words);
                option_count += 1;
            }
        }
    }
    assert!(option_count > 100, "found only {option_count} options");
}

#[test]
fn other_shells_have_scripts_and_unknown_ones_are_refused_with_the_list() {
    let sandbox = Sandbox::new();
    for (program, name) in PROGRAMS {
        for (shell, start) in [("zsh", format!("#compdef {name}\n")), ("fish", "# ".to_owned())] {
            let script = Process::run(program, &sandbox, &["completions", shell]).success();
            assert!(script.starts_with(&start), "{script}");
        }
        let refused = Process::run(program, &sandbox, &["completions", "csh"]);
        assert_eq!((refused.code, refused.stdout.as_str()), (Some(2), ""));
        assert!(
            refused.stderr.contains("bash, elvish, fish, powershell, zsh"),
            "{}",
            refused.stderr
        );
    }
}

#[test]
fn every_subcommand_has_a_man_page_with_its_options() {
    let sandbox = Sandbox::new();
    for (program, name) in PROGRAMS {
        let folder = sandbox.path(&format!("{name}/man1"));
        Process::run(program, &sandbox, &["man", &folder]).success();
        let version = Process::run(program, &sandbox, &["--version"]).success();
        let version = version.trim_end();
        let pages = pages(program, name, &sandbox);
        for page in &pages {
            let file = format!("{folder}/{}.1", page.words.join("-"));
            let text = fs::read_to_string(&file).unwrap_or_else(|error| panic!("{file}: {error}"));
            for option in page.options() {
                let escaped = option.replace('-', r"\-");
                assert!(text.contains(&escaped), "{file}: no {option}");
            }
            assert!(text.contains(&format!("\"{version}\"")), "{file}: no {version}");
        }
        assert_eq!(fs::read_dir(&folder).unwrap().count(), pages.len(), "{folder}");
    }
}

#[test]
fn a_folder_that_cannot_be_written_is_an_error_that_names_it() {
    let sandbox = Sandbox::new();
    let file = sandbox.write("file", "");
    for (program, _) in PROGRAMS {
        let refused = Process::run(program, &sandbox, &["man", &file]);
        assert_eq!(refused.code, Some(1));
        let start = format!("error: writing man pages to {file}: ");
        assert!(refused.stderr.starts_with(&start), "{}", refused.stderr);
    }
}

#[test]
#[ignore = "needs groff"]
fn every_man_page_is_formatted_without_a_warning() {
    let sandbox = Sandbox::new();
    for (program, name) in PROGRAMS {
        let folder = sandbox.path(name);
        Process::run(program, &sandbox, &["man", &folder]).success();
        for page in fs::read_dir(&folder).unwrap() {
            let page = page.unwrap().path().display().to_string();
            // All warnings, except of lines that cannot be justified.
            let args = ["-man", "-Tutf8", "-z", "-ww", "-W", "break", &page];
            let formatted = Process::run(Program::Groff, &sandbox, &args);
            assert_eq!((formatted.code, formatted.stderr.as_str()), (Some(0), ""), "{page}");
        }
    }
}
