//! Child processes that end with their guard.

use std::fmt;
use std::io::{BufRead, BufReader, Read, Write, empty};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use rustix::process::{Pid, Resource, Rlimit, Signal, getrlimit, kill_process, prlimit, setrlimit};
use sim_contract::DOMAIN_VARIABLE;
use sim_host::console;

use crate::finished::Finished;
use crate::programs::Program;
use crate::sandbox::Sandbox;
use crate::signals::signal_mask;
use crate::streams::Streams;
use crate::wait::wait_for;

/// Exit code of `sim-node ctl` for a rejected command.
const EXIT_REJECTED: i32 = 4;

/// A running program. Dropping it kills the process, and prints its output if the test is failing.
pub struct Process {
    title: String,
    child: Child,
    /// The keyboard of a program on a terminal.
    stdin: Option<ChildStdin>,
    stdout: Captured,
    stderr: Captured,
}

impl fmt::Debug for Process {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Process").field("title", &self.title).finish_non_exhaustive()
    }
}

/// Runs `sim-node ctl --json` with these arguments and returns the object that it prints. A rejected
/// command is an answer as well.
///
/// # Panics
/// If there is no answer, or if the exit code does not fit the answer.
pub fn ctl(sandbox: &Sandbox, args: &[&str]) -> serde_json::Value {
    let args: Vec<_> = ["ctl", "--json"].iter().chain(args).copied().collect();
    let mut finished = Process::run(Program::SimNode, sandbox, &args);
    let is_rejected = finished.code == Some(EXIT_REJECTED);
    if is_rejected {
        finished.code = Some(0);
    }
    let answer = finished.json();
    assert_eq!(answer["status"] == "rejected", is_rejected, "{answer}");
    answer
}

/// Starts a recorder in the lockstep, so that it loses nothing on a loaded machine, and waits until the recording has begun.
///
/// # Panics
/// If the recorder ends before, or the deadline passes.
pub fn record(sandbox: &Sandbox, file: &str) -> Process {
    let mut recorder =
        Process::start_ready(Program::Recorder, sandbox, &["record", "--lockstep", "-o", file]);
    recorder.wait_for_line("recording from step ");
    recorder
}

/// Lets this process open as many files as the system allows, for tests with many sockets.
///
/// # Panics
/// If the system refuses its own limit.
pub fn allow_many_open_files() {
    let limit = getrlimit(Resource::Nofile);
    let raised = Rlimit { current: limit.maximum, ..limit };
    setrlimit(Resource::Nofile, raised).expect("the limit of the system");
}

impl Process {
    /// Starts a program in the domain of a sandbox.
    ///
    /// # Panics
    /// If the program does not start.
    pub fn start(program: Program, sandbox: &Sandbox, args: &[&str]) -> Self {
        Self::start_with(Streams::default(), program, sandbox, args)
    }

    /// Starts a program with other output streams than captured ones.
    ///
    /// # Panics
    /// If the program does not start.
    pub fn start_with(
        streams: Streams,
        program: Program,
        sandbox: &Sandbox,
        args: &[&str],
    ) -> Self {
        let [stdout, stderr] = [streams.stdout.stdio(), streams.stderr.stdio()];
        let command = streams.command(program);
        Self::spawn(command, (program, sandbox.domain()), args, [stdout, stderr])
    }

    /// Starts a program in a domain given by name; "" is the default domain.
    ///
    /// # Panics
    /// If the program does not start.
    pub fn start_in(program: Program, domain: &str, args: &[&str]) -> Self {
        let command = Streams::default().command(program);
        Self::spawn(command, (program, domain), args, [Stdio::piped(), Stdio::piped()])
    }

    /// Starts a program under a limit of the shell, such as `-n 256`: at most 256 open files.
    ///
    /// # Panics
    /// If the program does not start.
    #[allow(clippy::disallowed_methods, reason = "the harness starts processes")]
    pub fn start_limited(
        (option, value): (&str, u64),
        program: Program,
        sandbox: &Sandbox,
        args: &[&str],
    ) -> Self {
        let mut command = Command::new("sh");
        let limit = format!(r#"ulimit {option} {value} && exec "$0" "$@""#);
        command.args(["-c", &limit]).arg(program.path());
        let streams = [Stdio::piped(), Stdio::piped()];
        Self::spawn(command, (program, sandbox.domain()), args, streams)
    }

    /// Starts a program with no capability and the limits of an ordinary user: no real-time priority,
    /// and 64 KiB of locked memory. It keeps the files of its user.
    ///
    /// # Panics
    /// If the program does not start.
    #[allow(clippy::disallowed_methods, reason = "the harness starts processes")]
    pub fn start_without_privileges(program: Program, sandbox: &Sandbox, args: &[&str]) -> Self {
        let limits = r#"ulimit -r 0 && ulimit -l 64 && exec "$@""#;
        let mut command = Command::new("sh");
        command.args(["-c", limits, "sh"]);
        if rustix::process::geteuid().is_root() {
            // Root gets every capability of the bounding set with a new program.
            command.args(["setpriv", "--bounding-set", "-all", "--inh-caps", "-all"]);
        }
        command.arg(program.path());
        let streams = [Stdio::piped(), Stdio::piped()];
        Self::spawn(command, (program, sandbox.domain()), args, streams)
    }

    /// Runs a shell script with job control on a terminal of its own, with a program as `"$0"` and its
    /// arguments as `"$@"`. Everything on the terminal arrives as stderr.
    ///
    /// # Panics
    /// If the terminal or the shell does not start.
    #[allow(clippy::disallowed_methods, reason = "the harness starts processes")]
    pub fn start_on_terminal(
        script: &str,
        program: Program,
        sandbox: &Sandbox,
        args: &[&str],
    ) -> Self {
        let quoted = |text: &str| format!("'{}'", text.replace('\'', r"'\''"));
        let program_path = program.path().display().to_string();
        let words = [script, &program_path].into_iter().chain(args.iter().copied());
        let words = words.map(quoted).collect::<Vec<_>>().join(" ");
        let mut command = Command::new("sh");
        command.args(["-c", r#"exec script -qfec "$0" /dev/null >&2"#]);
        command.arg(format!("exec sh -mc {words}"));
        command.env(DOMAIN_VARIABLE, sandbox.domain()).env("SHELL", "/bin/sh").process_group(0);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        Self::spawn_command(command, (program, args))
    }

    /// Presses keys on the terminal of the program.
    ///
    /// # Panics
    /// If the program has no terminal, or its terminal is gone.
    pub fn press(&mut self, keys: &str) {
        let stdin = self.stdin.as_mut().expect("a program on a terminal");
        stdin.write_all(keys.as_bytes()).expect("a terminal");
    }

    fn spawn(
        mut command: Command,
        (program, domain): (Program, &str),
        args: &[&str],
        [stdout, stderr]: [Stdio; 2],
    ) -> Self {
        // A process group of its own, so that Ctrl-C in the terminal reaches only the parent, which
        // ends its children in order.
        command.env(DOMAIN_VARIABLE, domain).args(args).process_group(0);
        command.stdin(Stdio::null()).stdout(stdout).stderr(stderr);
        Self::spawn_command(command, (program, args))
    }

    fn spawn_command(mut command: Command, (program, args): (Program, &[&str])) -> Self {
        let title = format!("{program:?} {}", args.join(" "));
        let mut child = command.spawn().unwrap_or_else(|error| panic!("{title}: {error}"));
        let stdout = child.stdout.take().map_or_else(|| Captured::new(empty()), Captured::new);
        let stderr = child.stderr.take().map_or_else(|| Captured::new(empty()), Captured::new);
        let stdin = child.stdin.take();
        Self { title, child, stdin, stdout, stderr }
    }

    /// Starts a program and waits for its line `ready ...`.
    ///
    /// # Panics
    /// If the program ends without that line, or the deadline passes.
    pub fn start_ready(program: Program, sandbox: &Sandbox, args: &[&str]) -> Self {
        let mut process = Self::start(program, sandbox, args);
        process.wait_until_ready();
        process
    }

    /// Runs a program to its end.
    ///
    /// # Panics
    /// If the program does not end before the deadline.
    pub fn run(program: Program, sandbox: &Sandbox, args: &[&str]) -> Finished {
        Self::start(program, sandbox, args).wait()
    }

    /// Waits for a line on stderr that starts with "ready".
    ///
    /// # Panics
    /// If the program ends without that line, or the deadline passes.
    pub fn wait_until_ready(&mut self) {
        self.wait_for_line("ready");
    }

    /// Waits for a line on stderr that starts with `start`, and returns the line.
    ///
    /// # Panics
    /// If the program ends without that line, or the deadline passes.
    pub fn wait_for_line(&mut self, start: &str) -> String {
        let line =
            |text: &str| text.lines().find(|line| line.starts_with(start)).map(ToOwned::to_owned);
        wait_for(&format!("\"{start}\" from {}", self.title), || {
            if let Some(line) = line(&self.stderr.text()) {
                return Some(line);
            }
            let ended = self.child.try_wait().expect("a child");
            if ended.is_some() {
                // The line may have been written just before the end.
                self.stderr.join();
                let text = self.stderr.text();
                assert!(
                    line(&text).is_some(),
                    "{} ended before it wrote \"{start}\": {text}",
                    self.title
                );
            }
            None
        })
    }

    /// Waits for a number of lines on stdout, and returns all that there are.
    ///
    /// # Panics
    /// If the program ends before, or the deadline passes.
    pub fn wait_for_output(&mut self, line_count: usize) -> Vec<String> {
        wait_for(&format!("{line_count} lines of {}", self.title), || {
            let is_running = self.is_running();
            let text = self.stdout.text();
            let lines: Vec<_> = text.lines().map(ToOwned::to_owned).collect();
            assert!(is_running || lines.len() >= line_count, "{} ended early", self.title);
            (lines.len() >= line_count).then_some(lines)
        })
    }

    /// Waits until the program handles a signal: from then on, the signal requests its end.
    ///
    /// # Panics
    /// If the program ends before, or the deadline passes.
    pub fn wait_until_it_handles(&mut self, signal: Signal) {
        let path = format!("/proc/{}/status", self.child.id());
        let bit = 1_u64 << (signal.as_raw() - 1);
        wait_for(&format!("{} to handle {signal:?}", self.title), || {
            assert!(self.is_running(), "{} ended before it handled the signal", self.title);
            let status = std::fs::read_to_string(&path).ok()?;
            (signal_mask(&status, "SigCgt")? & bit != 0).then_some(())
        });
    }

    /// Waits until the program has started a thread with a name.
    ///
    /// # Panics
    /// If the program ends before, or the deadline passes.
    pub fn wait_for_thread(&mut self, name: &str) {
        let path = format!("/proc/{}/task", self.child.id());
        wait_for(&format!("the thread {name} of {}", self.title), || {
            assert!(self.is_running(), "{} ended before it started the thread", self.title);
            std::fs::read_dir(&path).ok()?.flatten().find(|thread| {
                let found = std::fs::read_to_string(thread.path().join("comm"));
                found.is_ok_and(|found| found.trim_end() == name)
            })
        });
    }

    /// Returns the process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends a signal.
    ///
    /// # Panics
    /// If the process has ended.
    pub fn signal(&self, signal: Signal) {
        let pid = Pid::from_child(&self.child);
        kill_process(pid, signal).unwrap_or_else(|error| panic!("{}: {error}", self.title));
    }

    /// Limits the size of the files that the program writes from now on, as `ulimit -f` does.
    ///
    /// # Panics
    /// If the process has ended.
    pub fn limit_file_size(&self, size_bytes: u64) {
        let pid = Pid::from_child(&self.child);
        // The hard limit stays that of this process, so that a later limit may be greater.
        let limit = Rlimit { current: Some(size_bytes), ..getrlimit(Resource::Fsize) };
        prlimit(Some(pid), Resource::Fsize, limit)
            .unwrap_or_else(|error| panic!("{}: {error}", self.title));
    }

    /// Returns the largest memory that the process has had, in bytes.
    ///
    /// # Panics
    /// If the process has ended.
    pub fn memory_peak_bytes(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id()));
        let status = status.expect("a running process");
        let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let peak = peak.and_then(|text| text.trim().strip_suffix(" kB")?.parse::<u64>().ok());
        peak.expect("a size in KiB") << 10
    }

    /// Sends SIGINT, as Ctrl-C does, unless the program has ended, and waits for its end.
    ///
    /// # Panics
    /// If the program does not end before the deadline.
    pub fn interrupt(mut self) -> Finished {
        if self.is_running() {
            self.signal(Signal::INT);
        }
        self.wait()
    }

    /// Waits for the end of the program.
    ///
    /// # Panics
    /// If the program does not end before the deadline.
    pub fn wait(mut self) -> Finished {
        let status: ExitStatus = wait_for(&format!("the end of {}", self.title), || {
            self.child.try_wait().expect("a child")
        });
        self.stdout.join();
        self.stderr.join();
        Finished {
            code: status.code(),
            signal: status.signal(),
            stdout: self.stdout.text(),
            stderr: self.stderr.text(),
        }
    }

    /// Returns true if the program is still running.
    ///
    /// # Panics
    /// If the state of the child cannot be read, which does not happen for a child of this process.
    pub fn is_running(&mut self) -> bool {
        self.child.try_wait().expect("a child").is_none()
    }

    /// Returns true if a line on stderr starts with `start`. Does not wait for it.
    pub(crate) fn has_written(&self, start: &str) -> bool {
        self.stderr.text().lines().any(|line| line.starts_with(start))
    }

    /// Returns true if a line on stderr contains `part`. Does not wait for it.
    pub fn has_written_part(&self, part: &str) -> bool {
        self.stderr.text().contains(part)
    }

    /// Returns the lines on stderr so far.
    pub fn text(&self) -> String {
        self.stderr.text()
    }

    /// Returns the program and its arguments.
    pub(crate) fn title(&self) -> &str {
        &self.title
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Read before the kill: they show where a program hangs.
        let threads = if std::thread::panicking() { self.threads() } else { String::new() };
        // Errors mean that the process has already ended.
        let _ended = self.child.kill();
        let _ended = self.child.wait();
        if std::thread::panicking() {
            self.stdout.join();
            self.stderr.join();
            let (title, stdout, stderr) = (&self.title, self.stdout.text(), self.stderr.text());
            // A panic within a panic would abort the test.
            console::note_lines(&format!(
                "--- {title}\n--- stdout:\n{stdout}\n--- stderr:\n{stderr}\n{threads}---"
            ));
        }
    }
}

impl Process {
    /// Describes the threads of the program: state, system call, and the stack in the kernel if this
    /// user may read it. Empty after its end.
    fn threads(&self) -> String {
        let tasks = std::fs::read_dir(format!("/proc/{}/task", self.child.id()));
        let describe = |task: std::fs::DirEntry| {
            let read = |file| std::fs::read_to_string(task.path().join(file)).unwrap_or_default();
            let status = read("status");
            let state = status.lines().find(|line| line.starts_with("State:")).unwrap_or_default();
            let (name, call, stack) = (read("comm"), read("syscall"), read("stack"));
            let (name, call) = (name.trim_end(), call.trim_end());
            format!("--- thread {name}, {state}, system call {call}\n{stack}")
        };
        tasks.into_iter().flatten().flatten().map(describe).collect()
    }
}

/// An output stream of a child. A thread reads it, so that the child never blocks on a full pipe.
struct Captured {
    text: Arc<Mutex<String>>,
    reader: Option<JoinHandle<()>>,
}

impl Captured {
    fn new(output: impl Read + Send + 'static) -> Self {
        let text = Arc::new(Mutex::new(String::new()));
        let shared = Arc::clone(&text);
        let reader = std::thread::spawn(move || {
            let mut lines = BufReader::new(output);
            let mut line = Vec::new();
            while lines.read_until(b'\n', &mut line).is_ok_and(|length| length > 0) {
                let mut text = shared.lock().unwrap_or_else(PoisonError::into_inner);
                text.push_str(&String::from_utf8_lossy(&line));
                line.clear();
            }
        });
        Self { text, reader: Some(reader) }
    }

    fn text(&self) -> String {
        self.text.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Waits for the end of the stream.
    fn join(&mut self) {
        if let Some(reader) = self.reader.take() {
            let _panicked = reader.join();
        }
    }
}
