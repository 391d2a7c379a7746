//! The state of a recording at the snapshots to draw.

use std::collections::BTreeSet;
use std::io::Read;
use std::ops::ControlFlow;
use std::sync::Arc;

use anyhow::{Context, bail};
use recorder::{
    ColliderRow, CollidersRow, Frame, FrameReader, LogReader, Message, ShapeRow, StepRow,
    TearTracker, recorded_scene,
};
use sim_contract::{ColliderState, ConstraintKind, ConstraintState, ParticleState, Torn, Triangle};
use sim_solver::scene::{ColliderMesh, ColliderMeshes};

const STRUCTURAL_KIND: u32 = ConstraintKind::Structural as u32;

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
    /// The triangles of the colliders, once one of them is a mesh.
    pub(crate) collider_meshes: Option<Arc<ColliderMeshes>>,
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
        state.read_meshes(frames.log());
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

    /// Reads the triangles from the scene of the recording. Without a readable scene, there are none.
    fn read_meshes<R: Read>(&mut self, log: &LogReader<R>) {
        let is_mesh = |one: &ColliderRow| matches!(one.shape, ShapeRow::Mesh { .. });
        if self.collider_meshes.is_none() && self.colliders.iter().any(is_mesh) {
            let meshes = recorded_scene(log).map(|scene| scene.collider_meshes());
            self.collider_meshes = Some(Arc::new(meshes.unwrap_or_default()));
        }
    }

    /// Returns the triangles of a collider that is a mesh.
    pub(crate) fn collider_mesh(&self, collider: usize) -> Option<&ColliderMesh> {
        self.collider_meshes.as_ref()?.get(&collider)
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

    /// Returns the colliders as a node publishes them.
    pub(crate) fn collider_states(&self) -> Vec<ColliderState> {
        let (step, colliders) = (self.row.step, self.colliders.clone());
        CollidersRow { step, colliders }.states()
    }

    /// Returns the constraints that are not torn.
    pub(crate) fn untorn_constraints(&self) -> impl Iterator<Item = &ConstraintState> {
        let constraints = self.constraints.iter().zip(&self.is_torn);
        constraints.filter(|(_, is_torn)| !**is_torn).map(|(constraint, _)| constraint)
    }

    /// Returns the index and the corners of each triangle without a torn structural edge.
    pub(crate) fn intact_triangles(&self) -> impl Iterator<Item = (usize, [u32; 3])> {
        let torn_edges: BTreeSet<_> = (self.constraints.iter().zip(&self.is_torn))
            .filter(|(constraint, is_torn)| **is_torn && constraint.kind == STRUCTURAL_KIND)
            .map(|(constraint, _)| edge(constraint.a, constraint.b))
            .collect();
        let is_intact = move |[a, b, c]: [u32; 3]| {
            let edges = [edge(a, b), edge(b, c), edge(c, a)];
            torn_edges.is_empty() || !edges.iter().any(|edge| torn_edges.contains(edge))
        };
        let triangles = self.triangles.iter().map(|triangle| triangle.corners).enumerate();
        triangles.filter(move |(_, corners)| is_intact(*corners))
    }

    /// Returns for each particle whether an untorn constraint or an intact triangle uses it.
    pub(crate) fn connected(&self) -> Vec<bool> {
        let mut is_connected = vec![false; self.particles.len()];
        let ends = self.untorn_constraints().flat_map(|constraint| [constraint.a, constraint.b]);
        let corners = self.intact_triangles().flat_map(|(_, corners)| corners);
        for index in ends.chain(corners) {
            is_connected[index as usize] = true;
        }
        is_connected
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

/// Returns the edge with its ends in ascending order.
fn edge(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}
