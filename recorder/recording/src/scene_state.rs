//! The scene of a recording, and its state at a snapshot with everything that pictures and meshes show.

use std::io::Read;
use std::ops::{Deref, DerefMut};
use std::str::Utf8Error;
use std::sync::Arc;

use sim_messages::{ConstraintState, TornConstraint, Triangle};
use sim_solver::scene::{ColliderMesh, ColliderMeshes, SceneError};
use sim_solver::{EnergyMeter, SOLVER_VERSION, Scene, Solver, TornSides};

use super::log::{
    EnergyRow, Frame, FrameReader, LogReader, Message, OutcomeRow, ReadError, RecordedState,
    ShapeRow, Tape, TapeError, constraint_state,
};
use super::simulation::{colliders_row, forces_row, step_row};

/// The reason why the state of a recording cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum SceneStateError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file has no such state.
    #[error(transparent)]
    Tape(#[from] TapeError),
    /// Columns of /topology differ in length.
    #[error("the columns of /topology differ in length")]
    Topology,
    /// The last triangle of /surface has fewer than three corners.
    #[error("the number of indices in /surface is not a multiple of three")]
    Surface,
    /// The recording has a torn constraint that /topology does not list.
    #[error("constraint {constraint} is torn but not in /topology")]
    Torn {
        /// Index of the constraint.
        constraint: u32,
    },
    /// A constraint or a triangle refers to a particle that the snapshot does not have.
    #[error(
        "the snapshot of step {step} has {count} particles, but /topology or /surface refers to particle {index}"
    )]
    Particle {
        /// Step of the snapshot.
        step: u64,
        /// Number of its particles.
        count: usize,
        /// Index of the particle.
        index: u32,
    },
}

/// The state at one snapshot, with the constraints and triangles of the load.
#[derive(Debug, Clone, Default)]
pub struct SceneState {
    /// The state, which this dereferences to.
    pub recorded: RecordedState,
    /// The constraints as loaded.
    pub constraints: Vec<ConstraintState>,
    /// By constraint index: torn at or before the step.
    pub is_torn: Vec<bool>,
    /// The triangles as loaded.
    pub triangles: Vec<Triangle>,
    /// The torn sides of the triangles. `None` if no constraint has torn yet.
    pub sides: Option<TornSides>,
    /// The triangles of the colliders that are meshes. `None` if no collider is a mesh.
    pub collider_meshes: Option<Arc<ColliderMeshes>>,
    /// The outcomes of commands since the last state that [`SceneStates`] has returned.
    pub outcomes: Vec<OutcomeRow>,
}

impl Deref for SceneState {
    type Target = RecordedState;

    fn deref(&self) -> &RecordedState {
        &self.recorded
    }
}

impl DerefMut for SceneState {
    fn deref_mut(&mut self) -> &mut RecordedState {
        &mut self.recorded
    }
}

/// The states of a recording, in their order. One of them is in memory.
#[derive(Debug)]
pub struct SceneStates<R> {
    frames: FrameReader<R>,
    state: SceneState,
    /// A state was returned.
    has_begun: bool,
}

impl<R: Read> SceneStates<R> {
    /// Begins at the start of a recording.
    pub fn new(log: LogReader<R>) -> Self {
        Self { frames: FrameReader::new(log), state: SceneState::default(), has_begun: false }
    }

    /// Returns the state at the next recorded step from `step` on, or `None` at the end of the readable part. The first
    /// state that is returned has no outcomes of steps before `step`.
    ///
    /// # Errors
    /// If the file cannot be read, or its messages contradict each other.
    pub fn next_from(&mut self, step: u64) -> Result<Option<&SceneState>, SceneStateError> {
        let Self { frames, state, has_begun } = self;
        state.outcomes.clear();
        loop {
            let Some(frame) = frames.next_frame()? else { return Ok(None) };
            state.apply_frame(frame)?;
            state.read_meshes(frames.log());
            if !*has_begun {
                state.outcomes.retain(|row| row.step >= step);
            }
            if state.row.step >= step {
                break;
            }
        }
        *has_begun = true;
        state.update_torn()?;
        state.check_indices()?;
        Ok(Some(state))
    }
}

impl SceneState {
    /// Reads the state at a recorded step. `scene` has the triangles of colliders that are meshes.
    ///
    /// # Errors
    /// The file cannot be read, or its messages contradict each other.
    pub fn of_tape(
        tape: &mut Tape,
        step: u64,
        scene: Option<&Scene>,
    ) -> Result<Self, SceneStateError> {
        let mut state = Self {
            recorded: tape.state_at(step)?,
            constraints: tape.topology().constraints().ok_or(SceneStateError::Topology)?,
            triangles: tape.surface().triangles().ok_or(SceneStateError::Surface)?,
            ..Self::default()
        };
        state.update_torn()?;
        if state.has_meshes() {
            state.collider_meshes = scene.map(|scene| Arc::new(scene.collider_meshes()));
        }
        state.check_indices()?;
        Ok(state)
    }

    /// Returns the state of a solver after a step.
    pub fn of_solver(solver: &Solver, scene: &Scene, step: u64) -> Self {
        let constraints: Vec<_> = solver.constraints().map(constraint_state).collect();
        let triangles = solver.triangles().iter();
        let mut state = Self {
            recorded: RecordedState {
                row: step_row(solver, step),
                particles: Arc::new(bytemuck::cast_slice(solver.particles()).to_vec()),
                torn: solver.torn().iter().map(|index| TornConstraint::new(*index, None)).collect(),
                colliders: Some(colliders_row(solver, step)),
                forces: forces_row(solver, step),
                ..RecordedState::default()
            },
            constraints,
            triangles: triangles.map(|corners| Triangle { corners: *corners }).collect(),
            ..Self::default()
        };
        // A solver tears only constraints that it has.
        let _is_torn = state.update_torn();
        if state.has_meshes() {
            state.collider_meshes = Some(Arc::new(scene.collider_meshes()));
        }
        state
    }

    fn apply_frame(&mut self, frame: Frame) -> Result<(), SceneStateError> {
        self.forces = None;
        for message in frame.updates {
            self.recorded.apply(&message);
            match message {
                Message::Topology(row) => {
                    self.torn = row.torn_before();
                    self.constraints = row.constraints().ok_or(SceneStateError::Topology)?;
                    self.sides = None;
                }
                Message::Surface(row) => {
                    self.triangles = row.triangles().ok_or(SceneStateError::Surface)?;
                    self.sides = None;
                }
                Message::Outcome(row) => self.outcomes.push(row),
                _ => {}
            }
        }
        self.recorded.apply(&Message::Step(frame.row));
        self.particles = Arc::new(frame.particles.unwrap_or_default());
        Ok(())
    }

    /// Reads the triangles of colliders from the scene of the recording. Without a readable scene, the state has no
    /// triangles of colliders.
    fn read_meshes<R: Read>(&mut self, log: &LogReader<R>) {
        if self.collider_meshes.is_none() && self.has_meshes() {
            let meshes = recorded_scene(log).map(|scene| scene.collider_meshes());
            self.collider_meshes = Some(Arc::new(meshes.unwrap_or_default()));
        }
    }

    fn has_meshes(&self) -> bool {
        self.colliders().iter().any(|one| matches!(one.shape, ShapeRow::Mesh { .. }))
    }

    /// Returns the recorded energy of the state, or measures the energy. `None` if the parameters were not recorded, or
    /// the state is not a state of the scene.
    pub fn energy(&self, meter: &mut EnergyMeter) -> Option<EnergyRow> {
        self.row.energy.or_else(|| {
            let particles = bytemuck::cast_slice(self.particles.as_slice());
            let parameters = &self.parameters.as_ref()?.values;
            meter.measure(particles, self.torn_constraints(), parameters).map(EnergyRow::from)
        })
    }

    /// Returns the triangles of a collider that is a mesh.
    pub fn collider_mesh(&self, collider: usize) -> Option<&ColliderMesh> {
        self.collider_meshes.as_ref()?.get(&collider)
    }

    /// Takes the torn constraints and triangles from the recorded state.
    ///
    /// # Errors
    /// If a torn constraint is not in the topology. The error names the first one.
    pub fn update_torn(&mut self) -> Result<(), SceneStateError> {
        self.is_torn.clear();
        self.is_torn.resize(self.constraints.len(), false);
        for constraint in self.recorded.torn.indices() {
            let is_torn = self.is_torn.get_mut(constraint as usize);
            *is_torn.ok_or(SceneStateError::Torn { constraint })? = true;
        }
        let Self { constraints, triangles, is_torn, sides, .. } = self;
        if sides.is_none() && is_torn.contains(&true) {
            let ends = constraints.iter().map(|one| [one.a, one.b]);
            let corners = triangles.iter().map(|one| one.corners);
            *sides = Some(TornSides::of_triangles(ends, corners));
        }
        if let Some(sides) = sides {
            sides.set_torn(indices(is_torn));
        }
        Ok(())
    }

    /// Returns the indices of the torn constraints, ascending.
    pub fn torn_constraints(&self) -> impl Iterator<Item = u32> {
        indices(&self.is_torn)
    }

    /// Returns the constraints that are not torn.
    pub fn untorn_constraints(&self) -> impl Iterator<Item = &ConstraintState> {
        let constraints = self.constraints.iter().zip(&self.is_torn);
        constraints.filter(|(_, is_torn)| !**is_torn).map(|(constraint, _)| constraint)
    }

    /// Returns the index and the corners of each triangle without a torn side.
    pub fn intact_triangles(&self) -> impl Iterator<Item = (usize, [u32; 3])> {
        let is_whole = |triangle| self.sides.as_ref().is_none_or(|sides| sides.is_whole(triangle));
        let triangles = (0_u32..).zip(&self.triangles);
        triangles
            .filter(move |(triangle, _)| is_whole(*triangle))
            .map(|(triangle, one)| (triangle as usize, one.corners))
    }

    /// Returns for each particle whether an untorn constraint or an intact triangle uses it.
    pub fn connected(&self) -> Vec<bool> {
        let mut is_connected = vec![false; self.particles.len()];
        let ends = self.untorn_constraints().flat_map(|constraint| [constraint.a, constraint.b]);
        let corners = self.intact_triangles().flat_map(|(_, corners)| corners);
        for index in ends.chain(corners) {
            is_connected[index as usize] = true;
        }
        is_connected
    }

    /// Checks that all constraints and triangles refer to existing particles.
    ///
    /// # Errors
    /// If a constraint or a triangle refers to a particle that does not exist. The error names the largest index.
    pub fn check_indices(&self) -> Result<(), SceneStateError> {
        let ends = self.constraints.iter().flat_map(|constraint| [constraint.a, constraint.b]);
        let corners = self.triangles.iter().flat_map(|triangle| triangle.corners);
        let (step, count) = (self.row.step, self.particles.len());
        match ends.chain(corners).max() {
            Some(index) if index as usize >= count => {
                Err(SceneStateError::Particle { step, count, index })
            }
            _ => Ok(()),
        }
    }
}

/// Returns the indices at which the value is true.
fn indices(is_torn: &[bool]) -> impl Iterator<Item = u32> {
    (0_u32..).zip(is_torn).filter(|(_, is_torn)| **is_torn).map(|(index, _)| index)
}

/// The reason why the scene of a recording cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RecordedSceneError {
    /// Another version of the solver recorded it.
    #[error(
        "recorded with solver version {version}, but this program has version {SOLVER_VERSION}, whose \
         bits differ. Use the program that recorded it"
    )]
    OtherSolver {
        /// The version of the solver that recorded it.
        version: u32,
    },
    /// The recording has no scene.
    #[error("has no scene (attachment scene.toml)")]
    Missing,
    /// The scene is not UTF-8.
    #[error("its attachment scene.toml is not text")]
    NotText(#[from] Utf8Error),
    /// The scene is invalid.
    #[error(transparent)]
    Invalid(#[from] SceneError),
}

/// Parses the scene in a recording.
///
/// # Errors
/// If the recording has no valid scene. Errors do not name the recording.
pub fn recorded_scene<R: Read>(log: &LogReader<R>) -> Result<Scene, RecordedSceneError> {
    if log.scene().is_empty() {
        return Err(RecordedSceneError::Missing);
    }
    Ok(Scene::from_toml(std::str::from_utf8(log.scene())?, "scene.toml")?)
}

/// Parses the scene of a recording that can be simulated again: one of this solver's version.
///
/// # Errors
/// Like [`recorded_scene`], and for another version of the solver.
pub fn scene_to_simulate<R: Read>(log: &LogReader<R>) -> Result<Scene, RecordedSceneError> {
    let version = log.run().solver_version;
    if version != SOLVER_VERSION {
        return Err(RecordedSceneError::OtherSolver { version });
    }
    recorded_scene(log)
}
