//! The state of a recording at the snapshots to draw.

use std::io::Read;
use std::ops::ControlFlow;

use anyhow::{Context, bail};
use recorder::{ColliderRow, Frame, FrameReader, LogReader, Message, StepRow, TearTracker};
use sim_contract::{ConstraintState, ParticleState, Torn, Triangle};

/// The state at one snapshot.
#[derive(Debug, Clone, Default)]
pub(crate) struct SceneState {
    pub(crate) row: StepRow,
    pub(crate) particles: Vec<ParticleState>,
    pub(crate) constraints: Vec<ConstraintState>,
    /// By constraint index: torn at or before the step.
    pub(crate) is_torn: Vec<bool>,
    pub(crate) triangles: Vec<Triangle>,
    /// In their poses after the step.
    pub(crate) colliders: Vec<ColliderRow>,
}

/// Reads a recording and calls `visit` with its state at each of `steps`, which ascend, until
/// `visit` breaks.
pub(crate) fn visit_states<R: Read>(
    log: LogReader<R>,
    steps: &[u64],
    mut visit: impl FnMut(&SceneState) -> anyhow::Result<ControlFlow<()>>,
) -> anyhow::Result<()> {
    let mut steps = steps.iter().copied().peekable();
    let mut frames = FrameReader::new(log);
    let mut state = SceneState::default();
    let mut tears = TearTracker::new(Torn::default());
    while steps.peek().is_some() {
        let Some(frame) = frames.next_frame()? else { break };
        state.apply_frame(frame, &mut tears)?;
        if steps.next_if_eq(&state.row.step).is_some() {
            state.set_torn(tears.at(state.row.step))?;
            state.check_indices()?;
            if visit(&state)?.is_break() {
                break;
            }
        }
    }
    Ok(())
}

impl SceneState {
    fn apply_frame(&mut self, frame: Frame, tears: &mut TearTracker) -> anyhow::Result<()> {
        for message in &frame.updates {
            if let Message::Topology(row) = message {
                *tears = TearTracker::new(row.torn_before());
            }
            tears.process(message);
            self.apply_message(message)?;
        }
        self.row = frame.row;
        self.particles = frame.particles.unwrap_or_default();
        Ok(())
    }

    fn apply_message(&mut self, message: &Message) -> anyhow::Result<()> {
        match message {
            Message::Topology(row) => {
                self.constraints =
                    row.constraints().context("the columns of /topology differ in length")?;
                self.is_torn = vec![false; self.constraints.len()];
            }
            Message::Surface(row) => {
                self.triangles = row
                    .triangles()
                    .context("the number of indices in /surface is not a multiple of three")?;
            }
            Message::Colliders(row) => self.colliders.clone_from(&row.colliders),
            _ => {}
        }
        Ok(())
    }

    fn set_torn(&mut self, torn: Option<&Torn>) -> anyhow::Result<()> {
        self.is_torn.fill(false);
        for constraint in torn.iter().flat_map(|torn| torn.indices()) {
            let Some(is_torn) = self.is_torn.get_mut(constraint as usize) else {
                bail!("constraint {constraint} is torn but not in /topology");
            };
            *is_torn = true;
        }
        Ok(())
    }

    /// Checks that all constraints and triangles refer to existing particles.
    pub(crate) fn check_indices(&self) -> anyhow::Result<()> {
        let ends = self.constraints.iter().flat_map(|constraint| [constraint.a, constraint.b]);
        let corners = self.triangles.iter().flat_map(|triangle| triangle.corners);
        let (step, count) = (self.row.step, self.particles.len());
        match ends.chain(corners).max() {
            Some(index) if index as usize >= count => bail!(
                "the snapshot of step {step} has {count} particles, but /topology or /surface \
                 refers to particle {index}"
            ),
            _ => Ok(()),
        }
    }
}
