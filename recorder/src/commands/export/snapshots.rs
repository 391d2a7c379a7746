//! The selected snapshots of a recording, which a format reads as often as it needs, and evenly spaced frames between them.

use std::collections::BTreeSet;
use std::io::Read;
use std::ops::ControlFlow;
use std::sync::Arc;

use anyhow::bail;
use glam::DQuat;
use recording::{ColliderRow, OutcomeRow, RunDescription, SceneState, ShapeRow};
use sim_contract::{ParticleState, PlainF32};
use sim_solver::Scene;
use sim_solver::scene::Up;

/// Visits the states of the selected snapshots in their order, until the visitor breaks.
pub(crate) type VisitStates<'a> = dyn Fn(&mut dyn FnMut(&SceneState) -> anyhow::Result<ControlFlow<()>>) -> anyhow::Result<()>
    + 'a;

/// Opens the bytes of a recording.
pub(crate) type OpenBytes<'a> = dyn Fn() -> std::io::Result<Box<dyn Read>> + 'a;

/// The selected snapshots. Only one state at a time is in memory.
pub(crate) struct Snapshots<'a> {
    pub(crate) run: &'a RunDescription,
    /// The scene, unless it cannot be read.
    pub(crate) scene: Option<&'a Scene>,
    /// Axis of the scene that points up.
    pub(crate) up: Up,
    /// The scene has two dimensions.
    pub(crate) is_2d: bool,
    /// First step of the recording.
    pub(crate) first_step: u64,
    /// Steps of the selected snapshots, ascending. Not empty.
    pub(crate) steps: &'a [u64],
    /// Steps at which a command put a state in place, so that no motion leads to it.
    pub(crate) replaced_at: &'a BTreeSet<u64>,
    /// Number of particles of each snapshot.
    pub(crate) particle_count: usize,
    /// Exports evenly spaced frames in place of the snapshots, this many per second of simulated time.
    pub(crate) frames_per_s: Option<u16>,
    pub(crate) visit: &'a VisitStates<'a>,
    /// Opens the file itself, up to the end of its readable part.
    pub(crate) open_bytes: &'a OpenBytes<'a>,
}

impl Snapshots<'_> {
    /// Returns the simulated time of the run, which begins at step 0.
    pub(crate) fn run_time_s(&self, step: u64) -> f64 {
        step as f64 / f64::from(self.run.rate_hz)
    }

    /// Returns the simulated time since the first snapshot of the recording.
    pub(crate) fn time_s(&self, step: u64) -> f64 {
        step.saturating_sub(self.first_step) as f64 / f64::from(self.run.rate_hz)
    }

    /// Returns `true` if a motion leads from the state of one step to the state of a later step.
    pub(crate) fn is_continuous(&self, [from, to]: [u64; 2]) -> bool {
        self.replaced_at.range(from + 1..=to).next().is_none()
    }

    /// Reads the selected snapshots from first to last.
    pub(crate) fn for_each(
        &self,
        mut add: impl FnMut(&SceneState) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let mut count = 0;
        (self.visit)(&mut |state| {
            self.check_particle_count(state)?;
            add(state)?;
            count += 1;
            Ok(ControlFlow::Continue(()))
        })?;
        if count != self.steps.len() {
            bail!("the file has changed: {} of {} snapshots are left", count, self.steps.len());
        }
        Ok(())
    }

    /// Returns the state of the first selected snapshot.
    pub(crate) fn first(&self) -> anyhow::Result<SceneState> {
        let mut first = SceneState::default();
        (self.visit)(&mut |state| {
            self.check_particle_count(state)?;
            first = state.clone();
            Ok(ControlFlow::Break(()))
        })?;
        Ok(first)
    }

    fn check_particle_count(&self, state: &SceneState) -> anyhow::Result<()> {
        let (step, count, expected) = (state.row.step, state.particles.len(), self.particle_count);
        if count != expected {
            bail!(
                "the snapshot of step {step} has {count} particles, but the first one {expected}"
            );
        }
        Ok(())
    }
}

/// Returns the outcomes of commands that a state adds. The first selected snapshot adds the outcomes of its step.
pub(crate) fn new_outcomes(state: &SceneState) -> &[OutcomeRow] {
    // They are in the order of their steps.
    let end = state.outcomes.partition_point(|row| row.step <= state.row.step);
    &state.outcomes[..end]
}

/// A moment of an export.
#[derive(Debug)]
pub(crate) struct Frame<'a> {
    /// Number in the names of files, and time code: the step of a snapshot, or with a frame rate the number
    /// of the frame from 0.
    pub(crate) number: u64,
    /// Simulated time of the run, in s.
    pub(crate) time_s: f64,
    /// The state is interpolated between two snapshots.
    pub(crate) is_interpolated: bool,
    pub(crate) state: &'a SceneState,
}

/// Evenly spaced frames, the first of them at the first selected snapshot.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FrameGrid {
    pub(crate) frames_per_s: u16,
    rate_hz: u32,
    first_step: u64,
}

impl FrameGrid {
    /// Returns the place of a step in frames, multiplied by the rate of the run.
    fn scaled_place(self, step: u64) -> u128 {
        u128::from(step.saturating_sub(self.first_step)) * u128::from(self.frames_per_s)
    }

    fn scaled_frame(self, number: u64) -> u128 {
        u128::from(number) * u128::from(self.rate_hz)
    }

    fn time_s(self, number: u64) -> f64 {
        self.first_step as f64 / f64::from(self.rate_hz)
            + number as f64 / f64::from(self.frames_per_s)
    }

    /// Returns the number of frames up to a step.
    fn count(self, last_step: u64) -> u64 {
        let last = self.scaled_place(last_step) / u128::from(self.rate_hz);
        u64::try_from(last).unwrap_or(u64::MAX).saturating_add(1)
    }

    /// Returns the place of a frame as a share of the way from one step to another.
    fn share(self, number: u64, [from, to]: [u64; 2]) -> f64 {
        let [start, end] = [from, to].map(|step| self.scaled_place(step));
        (self.scaled_frame(number) - start) as f64 / (end - start) as f64
    }
}

impl Snapshots<'_> {
    fn grid(&self) -> Option<FrameGrid> {
        let (rate_hz, first_step) = (self.run.rate_hz, self.steps[0]);
        self.frames_per_s.map(|frames_per_s| FrameGrid { frames_per_s, rate_hz, first_step })
    }

    /// Returns the numbers of all frames.
    pub(crate) fn frame_numbers(&self) -> Vec<u64> {
        match self.grid() {
            Some(grid) => (0..grid.count(self.steps[self.steps.len() - 1])).collect(),
            None => self.steps.to_vec(),
        }
    }

    /// Returns the simulated time of the run at a frame, in s.
    pub(crate) fn frame_time_s(&self, number: u64) -> f64 {
        self.grid().map_or_else(|| self.run_time_s(number), |grid| grid.time_s(number))
    }

    /// Returns the numbers of frames in a second.
    pub(crate) fn time_codes_per_s(&self) -> u32 {
        self.frames_per_s.map_or(self.run.rate_hz, u32::from)
    }

    /// Counts the frames that are interpolated between two snapshots.
    pub(crate) fn interpolated_count(&self) -> usize {
        let Some(grid) = self.grid() else { return 0 };
        let is_interpolated = |number: &u64| {
            let place = grid.scaled_frame(*number);
            let next = self.steps.partition_point(|step| grid.scaled_place(*step) < place);
            let (before, after) = (self.steps[next.saturating_sub(1)], self.steps[next]);
            grid.scaled_place(after) != place && self.is_continuous([before, after])
        };
        self.frame_numbers().iter().filter(|number| is_interpolated(number)).count()
    }

    /// Visits all frames from first to last. A frame before a state that a command put in place shows the snapshot
    /// before it.
    pub(crate) fn for_each_frame(
        &self,
        mut add: impl FnMut(&Frame<'_>) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let Some(grid) = self.grid() else {
            return self.for_each(|state| {
                let (number, is_interpolated) = (state.row.step, false);
                let time_s = self.run_time_s(number);
                add(&Frame { number, time_s, is_interpolated, state })
            });
        };
        let mut number = 0;
        // The snapshot before, if a frame lies between it and the next one.
        let mut before = None::<SceneState>;
        self.for_each(|after| {
            let step = after.row.step;
            if let Some(before) = before.take() {
                number = self.add_between(grid, number, [&before, after], &mut add)?;
            }
            if grid.scaled_frame(number) == grid.scaled_place(step) {
                let time_s = grid.time_s(number);
                add(&Frame { number, time_s, is_interpolated: false, state: after })?;
                number += 1;
            }
            let next = self.steps.get(self.steps.partition_point(|one| *one <= step));
            let is_needed =
                next.is_some_and(|next| grid.scaled_frame(number) < grid.scaled_place(*next));
            before = is_needed.then(|| after.clone());
            Ok(())
        })
    }

    /// Adds the frames between two snapshots, from `number` on. Returns the number of the next frame.
    fn add_between(
        &self,
        grid: FrameGrid,
        mut number: u64,
        [before, after]: [&SceneState; 2],
        add: &mut impl FnMut(&Frame<'_>) -> anyhow::Result<()>,
    ) -> anyhow::Result<u64> {
        let steps = [before.row.step, after.row.step];
        let is_interpolated = self.is_continuous(steps);
        let mut state = before.clone();
        while grid.scaled_frame(number) < grid.scaled_place(after.row.step) {
            if is_interpolated {
                interpolate(&mut state, [before, after], grid.share(number, steps));
            }
            let time_s = grid.time_s(number);
            add(&Frame { number, time_s, is_interpolated, state: &state })?;
            number += 1;
        }
        Ok(number)
    }
}

/// Sets the particles and the colliders of a state to those between two snapshots.
fn interpolate(state: &mut SceneState, [before, after]: [&SceneState; 2], share: f64) {
    let particles = Arc::make_mut(&mut state.particles);
    particles.clone_from(&before.particles);
    for (particle, target) in particles.iter_mut().zip(after.particles.iter()) {
        move_particle(particle, target, share);
    }
    state.colliders.clone_from(&before.colliders);
    let colliders = state.colliders.iter_mut().flat_map(|row| &mut row.colliders);
    for (collider, target) in colliders.zip(after.colliders()) {
        move_collider(collider, target, share);
    }
}

fn move_particle(particle: &mut ParticleState, target: &ParticleState, share: f64) {
    particle.position = between(particle.position, target.position, share);
    particle.velocity = between(particle.velocity, target.velocity, share);
}

fn move_collider(collider: &mut ColliderRow, target: &ColliderRow, share: f64) {
    use ShapeRow::{Bounds, Box, Capsule, Mesh, Plane, Sphere};
    let to = |from: &mut [PlainF32; 3], to: [PlainF32; 3]| *from = plain_between(*from, to, share);
    match (&mut collider.shape, target.shape) {
        (Plane { normal, offset }, Plane { normal: next_normal, offset: next_offset }) => {
            to(normal, next_normal);
            [*offset] = plain_between([*offset], [next_offset], share);
        }
        (
            Box { center, rotation, .. } | Mesh { center, rotation, .. },
            Box { center: next, rotation: turned, .. }
            | Mesh { center: next, rotation: turned, .. },
        ) => {
            to(center, next);
            *rotation = turned_between(*rotation, turned, share);
        }
        (Sphere { center, .. }, Sphere { center: next, .. }) => to(center, next),
        (Capsule { a, b, .. }, Capsule { a: next_a, b: next_b, .. }) => {
            to(a, next_a);
            to(b, next_b);
        }
        (Bounds { min, max }, Bounds { min: next_min, max: next_max }) => {
            to(min, next_min);
            to(max, next_max);
        }
        _ => {}
    }
}

#[allow(clippy::cast_possible_truncation, reason = "a number between two f32 is rounded to one")]
fn between<const N: usize>(from: [f32; N], to: [f32; N], share: f64) -> [f32; N] {
    std::array::from_fn(|axis| {
        let [from, to] = [from[axis], to[axis]].map(f64::from);
        (from + (to - from) * share) as f32
    })
}

fn plain_between<const N: usize>(
    from: [PlainF32; N],
    to: [PlainF32; N],
    share: f64,
) -> [PlainF32; N] {
    between(from.map(|one| one.0), to.map(|one| one.0), share).map(PlainF32)
}

/// Returns the normalised linear interpolation of two rotations, on the shorter way.
fn turned_between(from: [PlainF32; 4], to: [PlainF32; 4], share: f64) -> [PlainF32; 4] {
    let [from, to] = [from, to].map(|one| DQuat::from_array(one.map(|part| part.0.into())));
    from.lerp(to, share).as_quat().to_array().map(PlainF32)
}
