//! The commands of the pages in `docs`, and of the class on a pendulum, work as printed, one after the other, in one folder.

use integration_tests::{Finished, Process, Program, Sandbox};

const FIRST_STEPS: &str = include_str!("../../../docs/first-steps.md");
const ROBOTICS: &str = include_str!("../../../docs/robotics.md");
const GAMES: &str = include_str!("../../../docs/games.md");
const RUST_AND_C: &str = include_str!("../../../docs/rust-and-c.md");
const TEACHING: &str = include_str!("../../../docs/teaching.md");
const INDEX: &str = include_str!("../../../docs/README.md");
const CLASS: &str = include_str!("../../../examples/pendulum/README.md");

/// Runs the examples of the contract as the test has built them.
const CARGO: &str = r#"cargo() {
    [ "$1 $2 $3 $4 $5" = "run --release -p sim-contract --example" ] && [ "$7" = -- ]
    "$PROGRAMS/examples/$6" "${@:8}"
}"#;

/// A page with commands, in a folder of its own.
struct Page {
    text: &'static str,
    left_out: &'static [&'static str],
    sandbox: Sandbox,
}

impl Page {
    fn new(text: &'static str) -> Self {
        Self { text, left_out: &[], sandbox: Sandbox::new() }
    }

    /// Leaves out the commands with these beginnings.
    fn without(self, left_out: &'static [&'static str]) -> Self {
        Self { left_out, ..self }
    }

    /// Returns the contents of the fenced blocks of a language.
    fn blocks(&self, language: &str) -> impl Iterator<Item = &'static str> {
        let parts = self.text.split("\n```").skip(1).step_by(2);
        parts.filter_map(move |part| part.strip_prefix(language)?.strip_prefix('\n'))
    }

    /// Runs all commands, except those in Python, which its own tests run. Returns what they printed. Programs that run
    /// until Ctrl-C end with the page, the last one first, or before the command that comes after that Ctrl-C.
    fn run(&self) -> Vec<(&'static str, String)> {
        let lines = self.blocks("sh").flat_map(str::lines);
        let lines = lines.map(|line| line.split_once("  # ").unwrap_or((line, "")));
        let lines = lines.filter(|(command, _)| {
            !command.starts_with("python")
                && !self.left_out.iter().any(|one| command.starts_with(one))
        });
        let mut running = Vec::new();
        let mut done = Vec::new();
        for (command, comment) in lines {
            let command = command.trim_end();
            let is_viewer = command.starts_with("viewer-bridge");
            if is_viewer || comment.contains("in a terminal of its own, until Ctrl-C") {
                running.push(self.start(command));
                continue;
            }
            if comment.contains("after that Ctrl-C") {
                running.pop().map(Process::interrupt).unwrap().success();
            }
            done.push((command, self.run_command(command)));
        }
        for process in running.into_iter().rev() {
            process.interrupt().success();
        }
        done
    }

    fn run_command(&self, command: &str) -> String {
        let script = self.script(command);
        let Finished { code, stdout, stderr, .. } =
            Process::run(Program::Bash, &self.sandbox, &["-e", "-c", &script]);
        let expected = if command.starts_with("recorder diff") { 3 } else { 0 };
        assert_eq!(code, Some(expected), "{command}: {stdout}{stderr}");
        stdout
    }

    /// Starts a program that runs until Ctrl-C, and waits until it is ready.
    fn start(&self, command: &str) -> Process {
        let is_viewer = command.starts_with("viewer-bridge");
        let is_recorder = command.starts_with("recorder");
        // Another program of this host may have the port.
        let command = if is_viewer && !command.contains(":8081") {
            format!("{command} --listen 127.0.0.1:0")
        } else {
            command.replace(":8081", ":0")
        };
        let script = self.script(&format!("exec {command}"));
        let mut process = Process::start(Program::Bash, &self.sandbox, &["-e", "-c", &script]);
        process.wait_for_line(if is_recorder { "recording from step " } else { "ready" });
        process
    }

    fn script(&self, command: &str) -> String {
        let program = Program::SimNode.path();
        let programs = program.parent().unwrap().display();
        let folder = self.sandbox.path("");
        format!(
            "PROGRAMS='{programs}'; PATH=\"$PROGRAMS:$PATH\"; cd '{folder}'; {CARGO}\n{command}"
        )
    }
}

/// Returns what the only command with this beginning printed.
fn printed<'a>(done: &'a [(&str, String)], start: &str) -> &'a str {
    let found: Vec<_> = done.iter().filter(|(command, _)| command.starts_with(start)).collect();
    assert_eq!(found.len(), 1, "commands {start}");
    &found[0].1
}

#[test]
fn the_first_steps_grab_record_and_prove() {
    let done = Page::new(FIRST_STEPS).run();
    assert!(printed(&done, "sim-node ctl nearest").starts_with("particle 1175 "));
    assert!(printed(&done, "recorder verify run.mcap").contains("bit-identical"));
    assert_eq!(printed(&done, "recorder export run.mcap --png").lines().count(), 8);
}

#[test]
fn the_index_has_no_commands_of_its_own() {
    assert_eq!(Page::new(INDEX).blocks("sh").count(), 0, "move them to a page that is followed");
}

#[test]
fn the_page_for_robotics_grabs_records_proves_and_compares() {
    let done = Page::new(ROBOTICS).run();
    assert!(printed(&done, "sim-node ctl nearest").starts_with("particle 91 "));
    assert!(printed(&done, "recorder info run.mcap").contains("\n/outcomes            3 "));
    assert!(printed(&done, "recorder verify run.mcap").contains("bit-identical"));
    let difference = printed(&done, "recorder diff");
    assert!(difference.contains("states      differ from step 600 on"));
    let (_, greatest) = difference.split_once("greatest distance: ").unwrap();
    let greatest: f64 = greatest.split(' ').next().unwrap().parse().unwrap();
    assert!(greatest > 2.0, "{greatest} m");
}

#[test]
fn the_page_for_games_brings_a_mesh_in_and_out() {
    let page = Page::new(GAMES);
    page.sandbox.write("shirt.obj", include_str!("../../../examples/shirt.obj"));
    let done = page.run();
    let frames = printed(&done, "recorder export shirt.mcap --pc2");
    assert!(frames.contains(" frames at 25 per second "), "{frames}");
    assert!(frames.contains(" interpolated between snapshots"), "{frames}");
}

#[test]
fn the_page_for_rust_runs_the_examples_of_the_contract() {
    let done = Page::new(RUST_AND_C).run();
    assert_eq!(
        printed(&done, "cargo run --release -p sim-contract --example watch").lines().count(),
        100
    );
    assert!(printed(&done, "sim-node bench").contains("lockstep"));
}

#[test]
fn the_page_for_teaching_checks_and_runs_the_printed_scene() {
    let page = Page::new(TEACHING);
    page.sandbox.write("my.toml", page.blocks("toml").next().unwrap());
    let done = page.run();
    assert!(printed(&done, "sim-node lesson euler").contains("500"));
    assert!(printed(&done, "sim-node check my.toml").starts_with("my: 402 particles, "));
}

#[test]
fn the_class_on_a_pendulum_measures_what_its_page_says() {
    // The test runs the node of the class.
    let class = Page::new(CLASS).without(&["sim-node run"]);
    let _node = Process::start_ready(Program::SimNode, &class.sandbox, &["run", "pendulum"]);
    let done = class.run();
    assert!(printed(&done, "sim-node ctl status --energy").contains("J in step "));
    let report = class.blocks("").next().unwrap();
    assert_eq!(printed(&done, "recorder info swing.mcap --energy").trim_end(), report);
    let rows = CLASS.lines().filter_map(|line| line.strip_prefix("| ")?.split_once(" | "));
    let rows: Vec<_> = rows.filter(|(substeps, _)| substeps.parse::<u32>().is_ok()).collect();
    assert_eq!(rows.len(), 4);
    for (substeps, energy) in rows {
        let file = if substeps == "20" { "swing".to_owned() } else { format!("swing_{substeps}") };
        let report = printed(&done, &format!("recorder info {file}.mcap --energy"));
        let last = report.lines().nth(2).unwrap();
        let total: f64 = last.split_whitespace().last().unwrap().parse().unwrap();
        assert!(energy.starts_with(&format!("{total:.3} J")), "{energy}: {last}");
        // The bob can fall to 1 m below the pin.
        let (start, lowest) = (-5.300_366, -9.81);
        let lost = 100.0 * (start - total) / (start - lowest);
        assert!(energy.ends_with(&format!("| {lost:.1} % |")), "{energy}: {lost} %");
    }
    let table = std::fs::read_to_string(class.sandbox.path("swing.csv")).unwrap();
    let kinetic =
        table.lines().skip(1).map(|line| line.split(',').nth(2).unwrap().parse().unwrap());
    let largest: f64 = kinetic.fold(0.0, f64::max);
    assert!(CLASS.contains(&format!("The largest\n`kinetic` is {largest:.3} J")), "{largest}");
    assert!(printed(&done, "sim-node lesson dissipation --csv").contains("\nsubsteps,from_1,"));
}
