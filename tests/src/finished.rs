//! Programs that have ended.

/// The exit code and output of a program that has ended.
#[derive(Debug, Clone)]
pub struct Finished {
    /// Exit code, or `None` if a signal ended the program.
    pub code: Option<i32>,
    /// Number of the signal that ended the program, if one did.
    pub signal: Option<i32>,
    /// Everything on stdout.
    pub stdout: String,
    /// Everything on stderr.
    pub stderr: String,
}

impl Finished {
    /// Returns the stdout of a program that must have succeeded.
    ///
    /// # Panics
    /// If its exit code is not 0.
    pub fn success(self) -> String {
        assert_eq!(self.code, Some(0), "stdout: {}\nstderr: {}", self.stdout, self.stderr);
        self.stdout
    }

    /// Returns the stdout of a recorder of a running node. On a busy machine it may lose snapshots, which it
    /// declares.
    ///
    /// # Panics
    /// If it has failed.
    pub fn recorded(self) -> String {
        let is_recorded = matches!(self.code, Some(0 | 3));
        assert!(is_recorded, "stdout: {}\nstderr: {}", self.stdout, self.stderr);
        self.stdout
    }

    /// Parses the stdout of a program that must have succeeded as JSON.
    ///
    /// # Panics
    /// If its exit code is not 0, or its stdout is not JSON.
    pub fn json(self) -> serde_json::Value {
        let text = self.success();
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error} in {text}"))
    }
}
