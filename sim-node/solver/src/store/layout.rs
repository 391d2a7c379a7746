//! The fields that a scene needs in memory, and the locations of particles and constraints there.

use crate::constraints::fields::ConstraintFields;
use crate::step::schedule::OptionalStages;

/// Fields of particles and bends that only some scenes have.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[allow(clippy::struct_excessive_bools, reason = "each tells if one kind of field exists")]
pub(crate) struct SceneFields {
    /// Particles touch colliders, which takes no memory in the store.
    pub(crate) colliders: bool,
    /// For colliders off which particles bounce: the predicted displacement.
    pub(crate) bounces: bool,
    /// For wind: the velocity that it adds in a substep.
    pub(crate) wind: bool,
    /// For bends in several passes: their multipliers.
    pub(crate) bend_multipliers: bool,
    /// For each tether of a particle: the position of the root, and the length with its square.
    pub(crate) tethers: usize,
    /// Particles touch each other or bodies, which divides the sweep. It takes no memory in the store.
    pub(crate) divided_sweep: bool,
}

/// Fields in memory, and those in use. Fields that fall out of use stay in memory, so that a change
/// of a parameter moves nothing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Layout {
    pub(crate) constraints: ConstraintFields,
    pub(crate) scene: SceneFields,
    /// Constraint fields that the current parameters use.
    pub(crate) used: ConstraintFields,
    pub(crate) is_wind_used: bool,
    pub(crate) has_divided_sweep: bool,
}

impl Layout {
    /// The layout for these fields that also has all fields in memory now.
    pub(crate) fn extended(self, used: ConstraintFields, scene: SceneFields) -> Self {
        let scene_fields = SceneFields {
            wind: self.scene.wind || scene.wind,
            bend_multipliers: self.scene.bend_multipliers || scene.bend_multipliers,
            divided_sweep: false,
            ..scene
        };
        Self {
            constraints: self.constraints.union(used),
            scene: scene_fields,
            used,
            is_wind_used: scene.wind,
            has_divided_sweep: scene.divided_sweep,
        }
    }

    /// True if two layouts have the same fields in memory.
    pub(crate) fn fits(&self, other: &Self) -> bool {
        self.constraints == other.constraints && self.scene == other.scene
    }

    /// The layout of a sheet, whose families each have one softness, and no tethers among their
    /// constraints.
    pub(crate) fn of_sheet(self) -> Self {
        let reduced = |fields: ConstraintFields| ConstraintFields {
            softness: false,
            floors: false,
            ..fields
        };
        Self { constraints: reduced(self.constraints), used: reduced(self.used), ..self }
    }

    pub(crate) fn optional_stages(&self) -> OptionalStages {
        OptionalStages {
            limit_stretch: self.used.max_lengths,
            tether: self.scene.tethers > 0,
            divides_sweep: self.has_divided_sweep,
            contact: self.scene.colliders,
        }
    }
}

/// Effect of a change of parameters on the locations of particles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use]
pub(crate) enum Configured {
    /// Everything stays in place.
    InPlace,
    /// Particles have new locations, and no tethers.
    Moved,
}

/// Location of a particle or a constraint: an index in the graph, or in the rows of a sheet or a crowd.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Location {
    /// 0 for the graph, else 1 + the number of the rows.
    part: u32,
    index: u32,
}

impl Location {
    pub(crate) fn in_graph(index: usize) -> Self {
        Self::new(0, index)
    }

    /// Rows are numbered sheet by sheet, then crowd by crowd.
    pub(crate) fn in_rows(rows: usize, index: usize) -> Self {
        Self::new(rows + 1, index)
    }

    /// A sheet has at most 2^24 particles. With at most 93 fields in columns of up to 64 numbers for 25
    /// particles, its indices stay below 2^32.
    fn new(part: usize, index: usize) -> Self {
        let (Ok(part), Ok(index)) = (u32::try_from(part), u32::try_from(index)) else {
            unreachable!("place {index} in part {part} is beyond the limits of a scene")
        };
        Self { part, index }
    }

    pub(crate) fn index(self) -> usize {
        self.index as usize
    }

    /// Number of the rows. None for the graph.
    pub(crate) fn rows(self) -> Option<usize> {
        (self.part as usize).checked_sub(1)
    }
}

/// One of the tethers of a particle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TetherPlace {
    pub(crate) particle: Location,
    /// Number of nearer roots.
    pub(crate) slot: usize,
}
