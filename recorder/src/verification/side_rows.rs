//! The tears, colliders, parameters and keyframes of a recording, compared with the re-simulation.

use std::collections::{BTreeMap, VecDeque};

use crate::log::{
    ColliderDetails, ColliderRow, CollidersRow, EventRow, ForcesRow, Message, ParametersRow,
    TearsRow,
};
use sim_contract::{
    ConstraintKind, ForceKind, ForceRow, Parameter, ParameterValue, ParameterValues, ParticleFlags,
    ParticleState, Setting,
};
use sim_solver::{Keyframe, Solver};

use crate::simulation::solver_rows::{colliders_row, forces_row, newest_tears_row};

/// Rows that were read but not compared yet, by step.
#[derive(Debug, Default)]
pub(super) struct SideRows {
    tears: BTreeMap<u64, TearsRow>,
    colliders: BTreeMap<u64, CollidersRow>,
    /// A paused node may change parameters several times before a step.
    parameters: BTreeMap<u64, VecDeque<ParametersRow>>,
    forces: BTreeMap<u64, ForcesRow>,
    keyframes: BTreeMap<u64, Vec<u8>>,
    events: BTreeMap<u64, Vec<EventRow>>,
    /// Step of the newest compared keyframe.
    keyframe_step: Option<u64>,
}

impl SideRows {
    /// Starts after `step`, whose keyframe is compared.
    pub(super) fn after_start(step: u64) -> Self {
        Self { keyframe_step: Some(step), ..Self::default() }
    }

    /// Adds a row. Returns a description of one that the file has twice, or whose step is past. The
    /// solver has computed `last_step`.
    pub(super) fn add(
        &mut self,
        update: &Message,
        solver: &Solver,
        last_step: u64,
    ) -> Option<String> {
        if update.step() <= last_step {
            return self.compare_late(update, solver, last_step);
        }
        (!self.insert(update))
            .then(|| format!("its message on {} is in the file twice", update.topic().name()))
    }

    /// Inserts a row. Returns `false` if there is one of its topic and step.
    fn insert(&mut self, update: &Message) -> bool {
        match update {
            Message::Tears(row) => self.tears.insert(row.step, row.clone()).is_none(),
            Message::Colliders(row) => self.colliders.insert(row.step, row.clone()).is_none(),
            Message::Parameters(row) => {
                let rows = self.parameters.entry(row.step).or_default();
                let is_new = rows.back() != Some(row);
                rows.push_back(row.clone());
                is_new
            }
            Message::Forces(row) => self.forces.insert(row.step, row.clone()).is_none(),
            Message::Keyframe { step, bytes } => {
                self.keyframes.insert(*step, bytes.clone()).is_none()
            }
            // Their order is compared with the particles of the snapshot.
            Message::Event(row) => {
                self.events.entry(row.step).or_default().push(row.clone());
                true
            }
            _ => true,
        }
    }

    /// Compares a row after the snapshot of its step. Only a keyframe can be one: a paused node publishes it
    /// for a new reader.
    fn compare_late(
        &mut self,
        update: &Message,
        solver: &Solver,
        last_step: u64,
    ) -> Option<String> {
        match update {
            Message::Keyframe { step, bytes }
                if *step == last_step && self.keyframe_step != Some(*step) =>
            {
                self.keyframe_step = Some(*step);
                compare_keyframe(bytes, solver)
            }
            Message::Tears(_)
            | Message::Colliders(_)
            | Message::Parameters(_)
            | Message::Forces(_)
            | Message::Keyframe { .. } => {
                let topic = update.topic().name();
                Some(format!(
                    "its message on {topic} follows its snapshot, or is in the file twice"
                ))
            }
            _ => None,
        }
    }

    /// Removes the rows up to a step, whose keyframe is compared.
    pub(super) fn forget_to(&mut self, step: u64) {
        self.tears.retain(|one, _| *one > step);
        self.colliders.retain(|one, _| *one > step);
        self.parameters.retain(|one, _| *one > step);
        self.forces.retain(|one, _| *one > step);
        self.keyframes.retain(|one, _| *one > step);
        self.events.retain(|one, _| *one > step);
        self.keyframe_step = Some(step);
    }

    /// Returns the number of rows that are not compared.
    pub(super) fn count(&self) -> usize {
        self.tears.len()
            + self.colliders.len()
            + self.parameters.values().map(VecDeque::len).sum::<usize>()
            + self.forces.len()
            + self.keyframes.len()
            + self.events.values().map(Vec::len).sum::<usize>()
    }

    /// Returns the rows up to the first snapshot. `Err` describes one that the file has twice.
    pub(super) fn up_to_start(updates: &[Message], step: u64) -> Result<Self, String> {
        let mut all = Self::default();
        for update in updates.iter().filter(|update| update.step() <= step) {
            if !all.insert(update) {
                return Err(format!(
                    "its message on {} is in the file twice",
                    update.topic().name()
                ));
            }
        }
        Ok(all)
    }

    /// Keeps the newest rows up to the first snapshot, which describe it. Its tears and events are part of
    /// the state. Returns the number of the other rows.
    pub(super) fn keep_newest(&mut self, step: u64) -> usize {
        self.tears.clear();
        self.events.clear();
        let count = self.count();
        // Those of the first state depend on the step that led to it.
        self.forces.clear();
        let newest = self.colliders.pop_last();
        self.colliders = newest.into_iter().map(|(_, row)| (step, row)).collect();
        let newest = self.parameters.pop_last().and_then(|(_, mut rows)| rows.pop_back());
        self.parameters = newest.into_iter().map(|row| (step, VecDeque::from([row]))).collect();
        self.keyframes.retain(|one, _| *one == step);
        count - self.count()
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

    /// Removes the parameters of `step` that the solver has within its commands, except the last ones.
    pub(super) fn pass_parameters(&mut self, solver: &Solver, step: u64) {
        let Some(rows) = self.parameters.get_mut(&step) else { return };
        while rows.len() > 1
            && rows.front().is_some_and(|row| compare_parameters(row, solver).is_none())
        {
            rows.pop_front();
        }
    }

    /// Compares the rows of `step` with the solver after it. Returns a description of the first
    /// difference.
    pub(super) fn compare(&mut self, solver: &Solver, step: u64) -> Option<String> {
        let tears = self.tears.remove(&step).and_then(|row| compare_tears(&row, solver));
        let colliders = self.colliders.remove(&step);
        let parameters = self.parameters.remove(&step).unwrap_or_default();
        let forces = self.forces.remove(&step);
        let keyframe = self.keyframes.remove(&step);
        let events = self.events.remove(&step).unwrap_or_default();
        if keyframe.is_some() {
            self.keyframe_step = Some(step);
        }
        tears
            .or_else(|| colliders.and_then(|row| compare_colliders(&row, solver)))
            .or_else(|| parameters.iter().find_map(|row| compare_parameters(row, solver)))
            .or_else(|| forces.and_then(|row| compare_forces(&row, solver)))
            .or_else(|| keyframe.and_then(|bytes| compare_keyframe(&bytes, solver)))
            .or_else(|| events.iter().find_map(|row| compare_event(row, solver)))
    }
}

/// Compares an event with the particle that it names.
fn compare_event(recorded: &EventRow, solver: &Solver) -> Option<String> {
    let index = recorded.particle? as usize;
    let is_frozen = index < solver.particle_count() && {
        let state: ParticleState = bytemuck::cast(solver.particle(index));
        state.flags & ParticleFlags::FROZEN != 0
    };
    (!is_frozen)
        .then(|| format!("its events in /events name particle {index}, which is not frozen"))
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
    // Their bytes, because a number that is not finite differs from itself.
    (simulated.encode() != bytes).then(|| {
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
    let (old, new) = (recorded.values.settings(), simulated.settings());
    let differs =
        |place: &usize| old.get(*place).map(setting_bits) != new.get(*place).map(setting_bits);
    let place = (0..old.len().max(new.len())).find(differs)?;
    let setting = old.get(place).or_else(|| new.get(place))?;
    let block = setting.block.map_or_else(String::new, |block| format!(" of block {block}"));
    let value = |settings: &[Setting]| {
        settings.get(place).map_or_else(|| "none".to_owned(), |one| value_text(one.value))
    };
    let (name, old, new) = (setting.parameter.name(), value(&old), value(&new));
    Some(format!("/parameters: parameter {name}{block}: recorded {old}, simulated {new}"))
}

/// The parameter, the constraints to which it applies, and the bits of its value.
fn setting_bits(
    setting: &Setting,
) -> (Parameter, Option<ConstraintKind>, Option<u32>, [Option<u32>; 3]) {
    let Setting { parameter, constraint_kind, block, value } = *setting;
    let bits = match value {
        ParameterValue::Number(number) => [Some(number.to_bits()), None, None],
        ParameterValue::Vector(vector) => vector.map(|axis| Some(axis.to_bits())),
        ParameterValue::Off => [None; 3],
    };
    (parameter, constraint_kind, block, bits)
}

fn value_text(value: ParameterValue) -> String {
    match value {
        ParameterValue::Number(number) => number.to_string(),
        ParameterValue::Vector(vector) => format!("{vector:?}"),
        ParameterValue::Off => "off".to_owned(),
    }
}

/// Compares the impulses of a step.
fn compare_forces(recorded: &ForcesRow, solver: &Solver) -> Option<String> {
    if let Some(problem) = recorded.problem() {
        return Some(format!("its message on /forces: {problem}"));
    }
    let simulated = forces_row(solver, recorded.step)?;
    let (old, new) = (recorded.rows(), simulated.rows());
    let differs = |place: &usize| {
        let [old, new] = [old.get(*place), new.get(*place)];
        old.map(bytemuck::bytes_of) != new.map(bytemuck::bytes_of)
    };
    let place = (0..old.len().max(new.len())).find(differs)?;
    let [recorded, simulated] = [old.get(place), new.get(place)].map(force_text);
    Some(format!("its forces in /forces: recorded {recorded}, simulated {simulated}"))
}

/// Returns text such as "particle 13 [0.0, -0.5, 0.0] N s".
fn force_text(row: Option<&ForceRow>) -> String {
    let Some(row) = row else { return "none".to_owned() };
    let kind = row.kind().map_or("unknown", ForceKind::name);
    let ForceRow { index, impulse, angular_impulse, contacts, .. } = *row;
    match row.kind() {
        Some(ForceKind::Collider) => {
            format!(
                "{kind} {index} {impulse:?} N s, {angular_impulse:?} N m s, {contacts} contacts"
            )
        }
        Some(ForceKind::Anchor) => {
            format!("{kind} {index} {impulse:?} N s, {angular_impulse:?} N m s")
        }
        _ => format!("{kind} {index} {impulse:?} N s"),
    }
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
    let place = old.iter().zip(new).position(|(old, new)| without_details(old) != *new)?;
    Some(format!(
        "/colliders: collider {place}: recorded {:?}, simulated {:?}",
        without_details(&old[place]),
        new[place]
    ))
}

/// Returns the properties that a solver has. The others are compared with the scene.
fn without_details(recorded: &ColliderRow) -> ColliderRow {
    ColliderRow { details: ColliderDetails::default(), ..recorded.clone() }
}
