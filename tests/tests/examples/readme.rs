//! The commands of the README's ten-minute paths, and of the class on a pendulum, work as printed, one after the other, in one folder,
//! beside a node as another path leaves it.

use integration_tests::{Finished, Process, Program, Sandbox};

const README: &str = include_str!("../../../README.md");
const CLASS: &str = include_str!("../../../examples/pendulum/README.md");

/// Runs the examples of the contract as the test has built them.
const CARGO: &str = r#"cargo() {
    [ "$1 $2 $3 $4 $5" = "run --release -p sim-contract --example" ] && [ "$7" = -- ]
    "$PROGRAMS/examples/$6" "${@:8}"
}"#;

/// A path of the README, in a folder of its own, beside a node.
struct TenMinutes {
    text: &'static str,
    left_out: &'static [&'static str],
    _node: Process,
    sandbox: Sandbox,
}

impl TenMinutes {
    fn new(heading: &str) -> Self {
        let (_, text) = README.split_once(&format!("\n## Ten minutes for {heading}\n")).unwrap();
        Self::of(text.split("\n## ").next().unwrap(), &[])
    }

    /// Leaves out the commands with these beginnings.
    fn of(text: &'static str, left_out: &'static [&'static str]) -> Self {
        let sandbox = Sandbox::new();
        let node = Process::start_ready(Program::SimNode, &sandbox, &["run", "pendulum"]);
        Self { text, left_out, _node: node, sandbox }
    }

    /// Returns the contents of the fenced blocks of a language.
    fn blocks(&self, language: &str) -> impl Iterator<Item = &'static str> {
        let parts = self.text.split("\n```").skip(1).step_by(2);
        parts.filter_map(move |part| part.strip_prefix(language)?.strip_prefix('\n'))
    }

    /// Runs all commands, except those in Python, which its own tests run. Returns what they printed.
    fn run(&self) -> Vec<(&'static str, String)> {
        let lines = self.blocks("sh").flat_map(str::lines);
        let lines = lines.map(|line| line.split_once("  # ").unwrap_or((line, "")));
        let lines = lines.filter(|(command, _)| {
            !command.starts_with("python")
                && !self.left_out.iter().any(|one| command.starts_with(one))
        });
        let mut recorder = None;
        let done = lines.map(|(command, comment)| {
            let command = command.trim_end();
            if comment.contains("in a terminal of its own, until Ctrl-C") {
                recorder = Some(self.start(command, "recording from step "));
                return (command, String::new());
            }
            if comment.contains("after that Ctrl-C") {
                recorder.take().map(Process::interrupt).unwrap().success();
            }
            if command.starts_with("viewer-bridge ") {
                // Another program of this host may have the port.
                let command = command.replace(":8081", ":0");
                return ("viewer-bridge", self.start(&command, "ready").interrupt().success());
            }
            (command, self.run_command(command))
        });
        done.collect()
    }

    fn run_command(&self, command: &str) -> String {
        let script = self.script(command);
        let Finished { code, stdout, stderr, .. } =
            Process::run(Program::Bash, &self.sandbox, &["-e", "-c", &script]);
        let expected = if command.starts_with("recorder diff") { 3 } else { 0 };
        assert_eq!(code, Some(expected), "{command}: {stdout}{stderr}");
        stdout
    }

    /// Starts a program, and waits for its line.
    fn start(&self, command: &str, line: &str) -> Process {
        let script = self.script(&format!("exec {command}"));
        let mut process = Process::start(Program::Bash, &self.sandbox, &["-e", "-c", &script]);
        process.wait_for_line(line);
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
fn the_path_for_robotics_grabs_records_proves_and_compares() {
    let path = TenMinutes::new("robotics and simulation");
    let done = path.run();
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
fn the_path_for_games_brings_a_mesh_in_and_out() {
    let path = TenMinutes::new("games and effects");
    std::fs::create_dir(path.sandbox.path("examples")).unwrap();
    path.sandbox.write("examples/shirt.obj", include_str!("../../../examples/shirt.obj"));
    let done = path.run();
    let frames = printed(&done, "recorder export shirt.mcap --pc2");
    assert!(frames.contains(" frames at 25 per second "), "{frames}");
    assert!(frames.contains(" interpolated between snapshots"), "{frames}");
}

#[test]
fn the_path_for_iceoryx2_runs_the_examples_of_the_contract() {
    let done = TenMinutes::new("iceoryx2 and Rust").run();
    assert_eq!(
        printed(&done, "cargo run --release -p sim-contract --example watch").lines().count(),
        100
    );
    assert!(printed(&done, "sim-node bench").contains("lockstep"));
}

#[test]
fn the_path_for_teaching_checks_and_loads_the_printed_scene() {
    let path = TenMinutes::new("teaching");
    path.sandbox.write("my.toml", path.blocks("toml").next().unwrap());
    let done = path.run();
    assert!(printed(&done, "sim-node lesson euler").contains("500"));
    assert!(printed(&done, "sim-node check my.toml").starts_with("my: 402 particles, "));
}

#[test]
fn the_class_on_a_pendulum_measures_what_its_page_says() {
    // The node runs already, and nobody looks at a browser.
    let class = TenMinutes::of(CLASS, &["sim-node run", "viewer-bridge --open"]);
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
