//! The state of a recording at the snapshots that are drawn.

use std::io::Read;
use std::ops::ControlFlow;

use anyhow::{Context, bail};
use recorder::{ColliderRow, Frame, FrameReader, LogReader, Message, StepRow};
use sim_contract::{ConstraintState, ParticleState, Triangle};

use crate::play::{Happening, happenings};

/// What stands at one snapshot.
#[derive(Debug, Clone)]
pub(crate) struct Moment {
    pub(crate) row: StepRow,
    pub(crate) particles: Vec<ParticleState>,
    pub(crate) constraints: Vec<ConstraintState>,
    /// By index of the constraint; torn at or before the step.
    pub(crate) is_torn: Vec<bool>,
    pub(crate) triangles: Vec<Triangle>,
    /// In their poses after the step.
    pub(crate) colliders: Vec<ColliderRow>,
}

/// Reads a recording and hands over its state at each of `steps`, which ascend, until told to stop.
pub(crate) fn visit<R: Read>(
    log: LogReader<R>,
    steps: &[u64],
    mut look: impl FnMut(&Moment) -> anyhow::Result<ControlFlow<()>>,
) -> anyhow::Result<()> {
    let mut steps = steps.iter().copied().peekable();
    let mut frames = FrameReader::new(log);
    let mut moment = Moment::new();
    while steps.peek().is_some() {
        let Some(frame) = frames.next_frame()? else { break };
        moment.follow(frame)?;
        if steps.next_if_eq(&moment.row.step).is_some() {
            moment.check_indices()?;
            if look(&moment)?.is_break() {
                break;
            }
        }
    }
    Ok(())
}

impl Moment {
    pub(crate) fn new() -> Self {
        Self {
            row: StepRow::default(),
            particles: Vec::new(),
            constraints: Vec::new(),
            is_torn: Vec::new(),
            triangles: Vec::new(),
            colliders: Vec::new(),
        }
    }

    fn follow(&mut self, frame: Frame) -> anyhow::Result<()> {
        for happening in happenings(&frame.updates) {
            match happening {
                Happening::Reset(_) => self.is_torn.fill(false),
                Happening::Update(message) => self.follow_message(message)?,
            }
        }
        self.row = frame.row;
        self.particles = frame.particles;
        Ok(())
    }

    fn follow_message(&mut self, message: &Message) -> anyhow::Result<()> {
        match message {
            Message::Topology(row) => {
                self.constraints =
                    row.constraints().context("the columns of /topology differ in length")?;
                self.is_torn = vec![false; self.constraints.len()];
                self.tear(&row.torn)?;
            }
            Message::Surface(row) => {
                self.triangles =
                    row.triangles().context("/surface has an index that is left over")?;
            }
            Message::Colliders(row) => self.colliders.clone_from(&row.colliders),
            Message::Tears(row) => self.tear(&row.constraints)?,
            _ => {}
        }
        Ok(())
    }

    fn tear(&mut self, constraints: &[u32]) -> anyhow::Result<()> {
        for constraint in constraints {
            let Some(is_torn) = self.is_torn.get_mut(*constraint as usize) else {
                bail!("constraint {constraint} is torn, but there is none in /topology");
            };
            *is_torn = true;
        }
        Ok(())
    }

    /// Everything that is drawn later is drawn between particles that are there.
    pub(crate) fn check_indices(&self) -> anyhow::Result<()> {
        let ends = self.constraints.iter().flat_map(|constraint| [constraint.a, constraint.b]);
        let corners = self.triangles.iter().flat_map(|triangle| triangle.corners);
        let (step, count) = (self.row.step, self.particles.len());
        match ends.chain(corners).max() {
            Some(most) if most as usize >= count => bail!(
                "the snapshot of step {step} has {count} particles, but /topology or /surface \
                 names particle {most}"
            ),
            _ => Ok(()),
        }
    }
}
