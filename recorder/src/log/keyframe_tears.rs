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
        let causes = keyframe.tear_causes().iter().map(|cause| cause_of(*cause)).collect();
        Some(Self { torn: keyframe.torn().to_vec(), causes })
    }
}

/// The cause as the contract numbers and names it.
pub fn cause_of(cause: sim_solver::TearCause) -> TearCause {
    match cause {
        sim_solver::TearCause::Force => TearCause::Force,
        sim_solver::TearCause::Stretch => TearCause::Stretch,
        sim_solver::TearCause::Distance => TearCause::Distance,
        sim_solver::TearCause::Cut => TearCause::Cut,
    }
}
