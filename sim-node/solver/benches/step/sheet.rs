//! The sheet that is simulated.

use sim_solver::{Scene, Solver};

/// What there is beside the sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Variant {
    /// Nothing.
    Plain,
    /// A plane below it, and each hundredth link cut.
    Torn,
}

impl Variant {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Plain => "sheet",
            Self::Torn => "torn",
        }
    }

    pub(crate) fn solver(self, columns: u32, substeps: u32) -> Solver {
        let plane = match self {
            Self::Plain => "",
            Self::Torn => "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = -9\n",
        };
        let text = format!(
            "version = 1\n[solver]\nrate_hz = 60\nsubsteps = {substeps}\n{plane}[[generate]]\nshape = \"cloth\"\n\
             columns = {columns}\nrows = {columns}\nspacing = {}\ndown = [0, 0, 1]\n",
            2.0 / f64::from(columns - 1)
        );
        let mut solver = Solver::new(&Scene::from_toml(&text, "sheet").unwrap());
        if self == Self::Torn {
            for index in (50..solver.constraint_count()).step_by(100) {
                solver.cut(u32::try_from(index).unwrap()).unwrap();
            }
        }
        solver
    }
}
