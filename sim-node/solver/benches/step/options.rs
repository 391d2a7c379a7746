//! What the command line asks for.

/// The options, and the names of the cases that are wanted.
#[derive(Debug, Default)]
pub(crate) struct Options {
    /// One JSON object a line and case, in place of tables.
    pub(crate) as_json: bool,
    /// Long cases too.
    pub(crate) is_full: bool,
    /// Few and short runs: whether everything works, not how fast it is.
    pub(crate) is_quick: bool,
    /// None: all but the long ones.
    wanted: Vec<String>,
}

impl Options {
    /// # Errors
    /// An option that there is not.
    pub(crate) fn parse(args: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self::default();
        for arg in args {
            match arg.as_str() {
                // Cargo adds the first, and a person may separate options from names.
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

    /// Whether a case is to run.
    pub(crate) fn wants(&self, case: &str) -> bool {
        self.wanted.is_empty() || self.names(case)
    }

    /// Whether a case is to run that takes long.
    pub(crate) fn wants_long(&self, case: &str) -> bool {
        self.names(case) || (self.is_full && self.wanted.is_empty())
    }

    /// Whether the part of a case is to run that takes long: not if only its kind is named.
    pub(crate) fn wants_all_of(&self, case: &str) -> bool {
        self.is_full || self.wanted.iter().any(|wanted| wanted == case)
    }

    /// A name stands for itself and for all that goes on after it: "torn" for "torn-32".
    fn names(&self, case: &str) -> bool {
        let is_named = |wanted: &String| {
            case.strip_prefix(wanted).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
        };
        self.wanted.iter().any(is_named)
    }

    /// How often something is measured: as often as is good, or once.
    pub(crate) fn count(&self, usual: usize) -> usize {
        if self.is_quick { 1 } else { usual }
    }

    /// Steps before anything is timed: half a second.
    pub(crate) fn lead_steps(&self, rate_hz: u32) -> u32 {
        if self.is_quick { 0 } else { rate_hz.div_ceil(2) }
    }

    /// Projections of one timed run: enough for tens of milliseconds.
    pub(crate) fn projections_per_run(&self) -> u64 {
        if self.is_quick { 1_000_000 } else { 12_000_000 }
    }

    /// Frames of a run that has to stay stable: a minute.
    pub(crate) fn stability_frames(&self) -> u32 {
        if self.is_quick { 60 } else { 3_600 }
    }
}
