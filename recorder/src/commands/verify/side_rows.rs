//! The tears, colliders, parameters and keyframes of a recording, compared with the re-simulation.

use std::collections::BTreeMap;

use recorder::{CollidersRow, Message, ParametersRow, TearsRow};
use sim_contract::ParameterValues;
use sim_solver::{Keyframe, Solver};

use crate::simulation::solver_rows::{colliders_row, newest_tears_row};

/// Rows that were read but not compared yet, by step.
#[derive(Debug, Default)]
pub(super) struct SideRows {
    tears: BTreeMap<u64, TearsRow>,
    colliders: BTreeMap<u64, CollidersRow>,
    parameters: BTreeMap<u64, ParametersRow>,
    keyframes: BTreeMap<u64, Vec<u8>>,
}

impl SideRows {
    /// Adds the rows before a snapshot, from `first_step` on.
    pub(super) fn add(&mut self, updates: &[Message], first_step: u64) {
        for update in updates.iter().filter(|update| update.step() >= first_step) {
            match update {
                Message::Tears(row) => {
                    self.tears.insert(row.step, row.clone());
                }
                Message::Colliders(row) => {
                    self.colliders.insert(row.step, row.clone());
                }
                Message::Parameters(row) => {
                    self.parameters.insert(row.step, row.clone());
                }
                Message::Keyframe { step, bytes } => {
                    self.keyframes.insert(*step, bytes.clone());
                }
                _ => {}
            }
        }
    }

    /// Returns the newest rows up to the first snapshot, which describe it. Its tears are part of the
    /// state.
    pub(super) fn of_start(updates: &[Message], step: u64) -> Self {
        let mut all = Self::default();
        all.add(updates, 0);
        let newest = |rows: &BTreeMap<u64, CollidersRow>| {
            rows.range(..=step)
                .next_back()
                .map(|(_, row)| (step, row.clone()))
                .into_iter()
                .collect()
        };
        let parameters = all.parameters.range(..=step).next_back();
        Self {
            tears: BTreeMap::new(),
            colliders: newest(&all.colliders),
            parameters: parameters.map(|(_, row)| (step, row.clone())).into_iter().collect(),
            keyframes: all.keyframes.remove(&step).map(|bytes| (step, bytes)).into_iter().collect(),
        }
    }

    /// Replaces the velocities of colliders by those of a restored solver, which does not know the motion
    /// that led to its state.
    pub(super) fn ignore_collider_velocities(&mut self, solver: &Solver) {
        for row in self.colliders.values_mut() {
            let simulated = colliders_row(solver, row.step).colliders;
            for (recorded, simulated) in row.colliders.iter_mut().zip(simulated) {
                recorded.velocity = simulated.velocity;
                recorded.angular_velocity = simulated.angular_velocity;
            }
        }
    }

    /// Compares all rows with the solver. Returns a description of the first difference.
    pub(super) fn compare_all(mut self, solver: &Solver) -> Option<String> {
        let steps =
            self.colliders.keys().chain(self.parameters.keys()).chain(self.keyframes.keys());
        let step = steps.copied().next()?;
        self.compare(solver, step)
    }

    /// Compares the rows of `step` with the solver after it. Returns a description of the first
    /// difference.
    pub(super) fn compare(&mut self, solver: &Solver, step: u64) -> Option<String> {
        let tears = self.tears.remove(&step).and_then(|row| compare_tears(&row, solver));
        let colliders = self.colliders.remove(&step);
        let parameters = self.parameters.remove(&step);
        let keyframe = self.keyframes.remove(&step);
        tears
            .or_else(|| colliders.and_then(|row| compare_colliders(&row, solver)))
            .or_else(|| parameters.and_then(|row| compare_parameters(&row, solver)))
            .or_else(|| keyframe.and_then(|bytes| compare_keyframe(&bytes, solver)))
    }
}

fn compare_keyframe(bytes: &[u8], solver: &Solver) -> Option<String> {
    let recorded = match Keyframe::decode(bytes) {
        Ok(recorded) => recorded,
        Err(error) => return Some(format!("its message on /keyframe is damaged: {error}")),
    };
    if recorded.encode() != bytes {
        return Some("its message on /keyframe has bytes that a solver does not write".to_owned());
    }
    let mut simulated = solver.keyframe();
    // The solver does not know whether the node was paused.
    simulated.paused = recorded.paused;
    (recorded != simulated).then(|| {
        "its message on /keyframe has another state: the masses, grabs, parameters, torn constraints, or moved \
         anchors or colliders differ"
            .to_owned()
    })
}

/// Compares the newest tears. A recorder that missed a list writes all tears since the previous one
/// in one row: those of this step, and the newest of the steps before.
fn compare_tears(recorded: &TearsRow, solver: &Solver) -> Option<String> {
    let count = recorded.constraints.len().max(solver.new_torn_count());
    let simulated = newest_tears_row(solver, recorded.step, count);
    let place = (0..count).find(|place| is_different(recorded, &simulated, *place))?;
    let [recorded, simulated] = [recorded, &simulated].map(|row| tear_text(row, place));
    Some(format!("its tears in /tears: recorded {recorded}, simulated {simulated}"))
}

/// Compares one tear. An unknown recorded cause equals any cause.
fn is_different(recorded: &TearsRow, simulated: &TearsRow, place: usize) -> bool {
    let cause = |row: &TearsRow| row.causes.get(place).filter(|name| *name != "unknown").cloned();
    recorded.constraints.get(place) != simulated.constraints.get(place)
        || cause(recorded).is_some_and(|name| Some(name) != cause(simulated))
}

/// Returns text such as "constraint 7 (cut)".
fn tear_text(row: &TearsRow, place: usize) -> String {
    let Some(constraint) = row.constraints.get(place) else { return "none".to_owned() };
    let cause = row.causes.get(place).map_or("unknown", String::as_str);
    format!("constraint {constraint} ({cause})")
}

/// Compares all parameters except the time scale, which belongs to the node.
fn compare_parameters(recorded: &ParametersRow, solver: &Solver) -> Option<String> {
    let time_scale = recorded.values.time_scale;
    let simulated = ParameterValues { time_scale, ..solver.parameter_values() };
    let settings = recorded.values.settings().into_iter().zip(simulated.settings());
    let (old, new) = settings.into_iter().find(|(old, new)| old != new)?;
    let name = old.parameter.name();
    Some(format!(
        "/parameters: parameter {name}: recorded {:?}, simulated {:?}",
        old.value, new.value
    ))
}

fn compare_colliders(recorded: &CollidersRow, solver: &Solver) -> Option<String> {
    let simulated = colliders_row(solver, recorded.step);
    let (old, new) = (&recorded.colliders, &simulated.colliders);
    if old.len() != new.len() {
        return Some(format!(
            "/colliders: recorded {} colliders, simulated {}",
            old.len(),
            new.len()
        ));
    }
    let index = old.iter().zip(new).position(|(old, new)| old != new)?;
    Some(format!(
        "/colliders: collider {index}: recorded {:?}, simulated {:?}",
        old[index], new[index]
    ))
}
