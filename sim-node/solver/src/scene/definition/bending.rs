//! Bending rigidity of sheets and meshes, and explicit bends.

use serde::Serialize;

use super::decimal;
use crate::constraints::bends::RestShape;

/// Bending of a sheet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SheetBending {
    /// Bending rigidity B in N m, >= 0.
    pub bending: Rigidity,
    /// Cells resist twisting, too. Then the rigidity is the same in every direction.
    pub twist: bool,
}

/// Bending rigidity, the same for all threads or not.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Rigidity {
    /// Of threads in either direction.
    Equal(#[serde(with = "decimal::number")] f32),
    /// Of the warp, which runs down, and of the weft, which runs across.
    Threads(#[serde(with = "decimal::pair")] [f32; 2]),
}

impl Rigidity {
    /// Returns the rigidity of the warp and of the weft.
    pub fn threads(self) -> [f32; 2] {
        match self {
            Self::Equal(rigidity) => [rigidity; 2],
            Self::Threads(threads) => threads,
        }
    }
}

/// Bending of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MeshBending {
    /// Bending rigidity B in N m, >= 0.
    #[serde(with = "decimal::number")]
    pub bending: f32,
    /// Shape in which the hinges are at rest.
    pub rest: RestShape,
}

/// An explicit bend.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SceneBend {
    /// Indices of its particles.
    pub particles: BendParticles,
    /// Bending rigidity >= 0: EI in N m^2 of a line, B in N m of a cell.
    #[serde(with = "decimal::number")]
    pub rigidity: f32,
}

/// The different particles of an explicit bend.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum BendParticles {
    /// Neighbours on a line, which is straight at rest.
    Line([u32; 3]),
    /// Corners of a cell, a parallelogram at rest: two above, two below.
    Cell([u32; 4]),
}
