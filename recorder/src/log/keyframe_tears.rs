//! What a keyframe says of tears: with it, a recording is read from the middle.

use sim_contract::TearCause;
use sim_solver::Keyframe;

/// All constraints that are torn in the state of a keyframe.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyframeTears {
    /// In the order of tearing.
    pub torn: Vec<u32>,
    /// Why each of them tore.
    pub causes: Vec<TearCause>,
}

impl KeyframeTears {
    /// Reads them; `None` if the keyframe is of another version, or damaged.
    pub fn read(keyframe: &[u8]) -> Option<Self> {
        let keyframe = Keyframe::decode(keyframe).ok()?;
        Some(Self { torn: keyframe.torn().to_vec(), causes: keyframe.tear_causes().to_vec() })
    }
}
