//! Options of the command line.

/// The options, and the names of the cases to run.
#[derive(Debug, Default)]
pub(crate) struct Options {
    /// Print one JSON object per line and case instead of tables.
    pub(crate) as_json: bool,
    /// Run the long cases, too.
    pub(crate) is_full: bool,
    /// Make few and short runs, to check that everything works.
    pub(crate) is_quick: bool,
    /// Names of cases; empty means all but the long ones.
    wanted: Vec<String>,
}

impl Options {
    /// # Errors
    /// An unknown option.
    pub(crate) fn parse(args: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self::default();
        for arg in args {
            match arg.as_str() {
                // Cargo adds the first. The second may separate options from names.
                "--bench" | "--" => {}
                "--json" => options.as_json = true,
                "--full" => options.is_full = true,
                "--quick" => options.is_quick = true,
                unknown if unknown.starts_with('-') => {
                    return Err(format!("{unknown}: there are --json, --full and --quick"));
                }
                _ => options.wanted.push(arg),
            }
        }
        Ok(options)
    }

    /// Returns `true` for a case to run.
    pub(crate) fn wants(&self, case: &str) -> bool {
        self.wanted.is_empty() || self.names(case)
    }

    /// Returns `true` for a long case to run.
    pub(crate) fn wants_long(&self, case: &str) -> bool {
        self.names(case) || (self.is_full && self.wanted.is_empty())
    }

    /// Returns `true` if the long part of a case is to run, which needs its full name.
    pub(crate) fn wants_all_of(&self, case: &str) -> bool {
        self.is_full || self.wanted.iter().any(|wanted| wanted == case)
    }

    /// Returns `true` if a name is the case or its beginning, as "torn" is of "torn-32".
    fn names(&self, case: &str) -> bool {
        let is_named = |wanted: &String| {
            case.strip_prefix(wanted).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
        };
        self.wanted.iter().any(is_named)
    }

    /// Returns the number of repetitions: the usual one, or 1 with `--quick`.
    pub(crate) fn count(&self, usual: usize) -> usize {
        if self.is_quick { 1 } else { usual }
    }

    /// Returns the number of steps before the measurement: half a second.
    pub(crate) fn lead_steps(&self, rate_hz: u32) -> u32 {
        if self.is_quick { 0 } else { rate_hz.div_ceil(2) }
    }

    /// Returns the number of projections in a timed run, enough for tens of milliseconds.
    pub(crate) fn projections_per_run(&self) -> u64 {
        if self.is_quick { 1_000_000 } else { 12_000_000 }
    }

    /// Returns the number of frames in a stability run: a minute.
    pub(crate) fn stability_frames(&self) -> u32 {
        if self.is_quick { 60 } else { 3_600 }
    }
}
