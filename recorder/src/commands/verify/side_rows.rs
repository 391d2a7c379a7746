//! The tears, colliders and parameters of a recording, compared with the re-simulation.

use std::collections::BTreeMap;

use recorder::{CollidersRow, Message, ParametersRow, TearsRow};
use sim_contract::ParameterValues;
use sim_solver::Solver;

use crate::simulation::solver_rows::{colliders_row, newest_tears_row};

/// Rows that were read but not compared yet, by step.
#[derive(Debug, Default)]
pub(super) struct SideRows {
    tears: BTreeMap<u64, TearsRow>,
    colliders: BTreeMap<u64, CollidersRow>,
    parameters: BTreeMap<u64, ParametersRow>,
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
                _ => {}
            }
        }
    }

    /// Compares the rows of `step` with the solver after it. Returns a description of the first
    /// difference.
    pub(super) fn compare(&mut self, solver: &Solver, step: u64) -> Option<String> {
        let tears = self.tears.remove(&step).and_then(|row| compare_tears(&row, solver));
        let colliders = self.colliders.remove(&step);
        let parameters = self.parameters.remove(&step);
        tears
            .or_else(|| colliders.and_then(|row| compare_colliders(&row, solver)))
            .or_else(|| parameters.and_then(|row| compare_parameters(&row, solver)))
    }
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
    Some(format!("parameter {name}: recorded {:?}, simulated {:?}", old.value, new.value))
}

fn compare_colliders(recorded: &CollidersRow, solver: &Solver) -> Option<String> {
    let simulated = colliders_row(solver, recorded.step);
    let (old, new) = (&recorded.colliders, &simulated.colliders);
    if old.len() != new.len() {
        return Some(format!("recorded {} colliders, simulated {}", old.len(), new.len()));
    }
    let index = old.iter().zip(new).position(|(old, new)| old != new)?;
    Some(format!("collider {index}: recorded {:?}, simulated {:?}", old[index], new[index]))
}
