//! The sheet: N x N particles, 2 m wide, unit masses, structural and both diagonal links
//! (4 N^2 - 6 N + 2), rigid, undamped, 60 frames per second, and one plane far below, which no particle
//! touches.

use sim_solver::Scene;

/// Width and length of a sheet, in m.
pub(crate) const SIDE: f64 = 2.0;
/// Frames per second.
pub(crate) const RATE_HZ: u32 = 60;

/// Start of a sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Start {
    /// Level, pinned at one side.
    Swing,
    /// Upright, pinned at its upper side.
    Hang,
    /// Level, pinned at two corners, which carry the whole weight.
    Corners,
}

impl Start {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Swing => "swing",
            Self::Hang => "hang",
            Self::Corners => "corners",
        }
    }

    /// Returns the scene's word for the pinned particles.
    fn pinned(self) -> &'static str {
        match self {
            Self::Swing | Self::Hang => "top",
            Self::Corners => "corners",
        }
    }

    /// Returns the direction from row to row.
    fn down(self) -> [i8; 3] {
        match self {
            Self::Swing | Self::Corners => [0, 0, 1],
            Self::Hang => [0, -1, 0],
        }
    }
}

/// A sheet to simulate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sheet {
    /// Particles along each side.
    pub(crate) columns: u32,
    pub(crate) substeps: u32,
    pub(crate) start: Start,
    /// Roots of each particle.
    pub(crate) tethers: u32,
}

impl Sheet {
    /// Creates a swinging sheet without tethers.
    pub(crate) fn swing(columns: u32, substeps: u32) -> Self {
        Self { columns, substeps, start: Start::Swing, tethers: 0 }
    }

    pub(crate) fn scene(&self) -> Scene {
        let Self { columns, substeps, start, tethers } = *self;
        let text = format!(
            "version = 1\n[solver]\nrate_hz = {RATE_HZ}\nsubsteps = {substeps}\ntethers = {tethers}\n\
             [[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = -9\n\
             [[generate]]\nshape = \"cloth\"\ncolumns = {columns}\nrows = {columns}\n\
             spacing = {}\ndown = {:?}\npinned = \"{}\"\n",
            SIDE / f64::from(columns - 1),
            start.down(),
            start.pinned()
        );
        Scene::from_toml(&text, "sheet").unwrap()
    }
}
