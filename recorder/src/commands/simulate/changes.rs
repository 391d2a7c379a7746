//! Simulates a recording again with changed commands, from the last complete state before the first
//! change.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::{Context, anyhow, bail};
use recording::simulation::{Job, Start, State};
use recording::{
    FrameReader, LogEnd, LogReader, Message, OutcomeRow, TimedCommand, parse_commands,
    scene_to_simulate, sort_commands,
};
use sim_contract::{Action, Parameter, Part, Reason};
use sim_host::Stop;
use sim_solver::{Keyframe, Scene, Solver};

use crate::input::{COMMANDS_MAX, timed_command};

/// Changes of the commands of a recording.
#[derive(Debug, Default)]
pub(super) struct Changes {
    /// Indices of outcomes whose commands are left out.
    pub(super) dropped: Vec<u64>,
    pub(super) added: Vec<TimedCommand>,
    /// Commands in place of those of the recording.
    pub(super) replaced: Option<Vec<TimedCommand>>,
}

/// Parses `STEP:PARAMETER=VALUE`, such as `480:damping=0.1` or `0:gravity=[0,-5,0]`. A parameter can be for one kind
/// of constraint, such as `compliance.shear`, for one generated block, such as `bending.1`, or for one collider, such as
/// `friction.2`.
pub(super) fn parse_setting(text: &str) -> Result<TimedCommand, String> {
    const FORM: &str = "it must be STEP:PARAMETER=VALUE, such as 480:damping=0.1, \
        480:gravity=[0,-5,0], 480:tear_force=off, 480:compliance.shear=1e-4, 480:bending.1=1e-3 or 480:friction.2=0.5";
    let (step, setting) = text.split_once(':').ok_or(FORM)?;
    let step: u64 = step.trim().parse().map_err(|_| FORM)?;
    let (parameter, value) = setting.split_once('=').ok_or(FORM)?;
    let value = match value.trim() {
        "off" => serde_json::Value::Null,
        value => serde_json::from_str(value).map_err(|_| FORM)?,
    };
    let (parameter, part) = Parameter::from_path(parameter.trim())
        .map_err(|allowed| format!("{} (allowed: {allowed})", Reason::UnknownParameter))?;
    let mut line = serde_json::json!({
        "step": step, "kind": "set", "parameter": parameter.name(), "value": value,
    });
    match part {
        Part::All => {}
        Part::Kind(kind) => line["constraint_kind"] = kind.name().into(),
        Part::Block(block) => line["block"] = block.into(),
        Part::Collider(collider) => line["collider"] = collider.into(),
    }
    let commands = parse_commands(&line.to_string(), "--set").map_err(|error| error.to_string())?;
    let command = commands.into_iter().next().ok_or(FORM)?;
    command
        .action
        .validate()
        .map_err(|reason| format!("{reason} (allowed: {})", parameter.info().allowed_values()))?;
    Ok(command)
}

/// The scene, steps, states and commands of a recording.
#[derive(Debug)]
pub(super) struct ChangesSurvey {
    scene: Scene,
    /// The first state with particles and a keyframe.
    first_state: Option<Start>,
    /// Steps with particles and a keyframe, ascending.
    states: Vec<u64>,
    last_step: u64,
    outcomes: Vec<OutcomeRow>,
    end: Option<LogEnd>,
}

impl ChangesSurvey {
    fn new(scene: Scene) -> Self {
        let (states, outcomes) = (Vec::new(), Vec::new());
        Self { scene, first_state: None, states, last_step: 0, outcomes, end: None }
    }

    pub(super) fn read(path: &Path, stop: &Stop) -> anyhow::Result<Self> {
        let log = LogReader::open_until(path, stop)?;
        let mut survey = Self::new(scene_to_simulate(&log)?);
        let mut frames = FrameReader::new(log);
        while let Some(frame) = frames.next_frame()? {
            let step = frame.row.step;
            if frame.is_complete_state() {
                survey.states.push(step);
                let outcome_count = frame.row.outcome_count;
                _ = survey.first_state.get_or_insert(Start { step, outcome_count });
            }
            survey.last_step = step;
            survey.add_outcomes(&frame.updates)?;
        }
        survey.end = frames.end().cloned();
        Ok(survey)
    }

    fn add_outcomes(&mut self, updates: &[Message]) -> anyhow::Result<()> {
        for update in updates {
            if let Message::Outcome(row) = update {
                if self.outcomes.len() == COMMANDS_MAX {
                    bail!("has more than {COMMANDS_MAX} commands");
                }
                self.outcomes.push(row.clone());
            }
        }
        Ok(())
    }

    /// Returns the first state that a simulation can start from.
    pub(super) fn first_state(&self) -> anyhow::Result<Start> {
        self.first_state.context("has no complete state to start from")
    }

    /// Returns the first step that a change concerns.
    fn first_change(&self, changes: &Changes) -> anyhow::Result<u64> {
        let first_state = self.first_state()?.step;
        let mut steps = Vec::new();
        for index in &changes.dropped {
            let row = self.outcomes.iter().find(|row| row.index == *index);
            steps.push(row.with_context(|| self.unknown_outcome(*index))?.step);
        }
        steps.extend(changes.added.iter().map(|command| command.step));
        if let Some(replaced) = &changes.replaced {
            steps.extend(replaced.iter().map(|command| command.step));
            let recorded = self.outcomes.iter().map(|row| row.step);
            steps.extend(recorded.filter(|step| *step > first_state).min());
        }
        let allowed = first_state + 1..=self.last_step;
        if let Some(step) = steps.iter().find(|step| !allowed.contains(step)) {
            bail!(
                "a change of step {step} has no effect: the first complete state of the recording is that \
                 of step {first_state}, and its last step is {} (allowed: {} to {})",
                self.last_step,
                first_state + 1,
                self.last_step
            );
        }
        Ok(steps.into_iter().min().unwrap_or(first_state + 1))
    }

    fn unknown_outcome(&self, index: u64) -> String {
        let indices = self.outcomes.iter().map(|row| row.index);
        match indices.clone().min().zip(indices.max()) {
            Some((first, last)) => format!(
                "has no outcome {index} (allowed: {first} to {last}, the \"index\" of rows in /outcomes)"
            ),
            None => "has no commands to leave out".to_owned(),
        }
    }

    /// Returns the step of the state to start from: the last one before the change to which no later
    /// command goes back.
    fn start(&self, first_change: u64, changes: &Changes) -> anyhow::Result<u64> {
        let first_state = self.states.first().copied().unwrap_or_default();
        let later = self.outcomes.iter().filter(|row| row.step >= first_change && row.is_applied());
        let replaced = changes.replaced.iter().flatten();
        let actions = later.map(|row| row.action).chain(replaced.map(|command| command.action));
        let back = actions.filter_map(|action| match action {
            Action::Rewind { to_step, .. } => to_step,
            _ => None,
        });
        let earliest = back.filter(|step| *step >= first_state).min();
        let end = earliest.map_or(first_change, |back| first_change.min(back + 1));
        let state = self.states.iter().rev().find(|step| **step < end);
        state.copied().context("has no complete state before the first change")
    }
}

/// A simulation with changed commands, ready to run.
pub(super) struct Changed {
    pub(super) job: Job,
    pub(super) solver: Solver,
    given: GivenStates,
    /// The end of the recording.
    pub(super) end: LogEnd,
}

impl Changed {
    pub(super) fn new(
        path: &Path,
        survey: ChangesSurvey,
        changes: Changes,
        stop: &Stop,
    ) -> anyhow::Result<Self> {
        let start_step = survey.start(survey.first_change(&changes)?, &changes)?;
        let mut frames = FrameReader::new(LogReader::open_until(path, stop)?);
        let (solver, outcome_count) = restore(&survey.scene, &mut frames, start_step)?;
        let commands = commands(&survey, changes, outcome_count);
        check_last_step(&commands, survey.last_step)?;
        let given = GivenStates::new(frames, &survey.outcomes);
        let start = Start { step: start_step, outcome_count };
        let job = Job { scene: survey.scene, commands, steps: survey.last_step, start };
        Ok(Self { job, solver, given, end: survey.end.unwrap_or(LogEnd::Complete) })
    }

    /// Divides this into the simulation and the states that its commands put in place.
    pub(super) fn into_parts(self) -> (Job, Solver, GivenStates) {
        (self.job, self.solver, self.given)
    }
}

/// Puts a state of the recording into a solver. Returns the number of outcomes before it, too.
fn restore<R: std::io::Read>(
    scene: &Scene,
    frames: &mut FrameReader<R>,
    step: u64,
) -> anyhow::Result<(Solver, u64)> {
    let state = state_at(frames, step)?;
    let (state, row) = state.with_context(|| format!("has no complete state of step {step}"))?;
    let mut solver = Solver::new(scene);
    solver
        .restore(&state.particles, &state.keyframe)
        .map_err(|cause| anyhow!("the state of step {step}: {cause}"))?;
    if solver.state_hash() != row.state_hash {
        bail!("the particles of step {step} have another hash than its row in /steps");
    }
    Ok((solver, row.outcome_count))
}

/// Reads up to a step, and returns its state if it is complete.
fn state_at<R: std::io::Read>(
    frames: &mut FrameReader<R>,
    step: u64,
) -> anyhow::Result<Option<(State, recording::StepRow)>> {
    while let Some(frame) = frames.next_frame()? {
        if frame.row.step < step {
            continue;
        }
        let (Some(bytes), Some(particles)) = (frame.own_keyframe(), &frame.particles) else {
            return Ok(None);
        };
        let keyframe = Keyframe::decode(bytes)?;
        let particles = bytemuck::cast_slice(particles).to_vec();
        let is_same = frame.row.step == step;
        return Ok(is_same.then_some((State { particles, keyframe }, frame.row)));
    }
    Ok(None)
}

/// The commands after the start. A recording ends with a load, so none is repeated.
fn commands(survey: &ChangesSurvey, changes: Changes, outcome_count: u64) -> Vec<TimedCommand> {
    let dropped: BTreeSet<_> = changes.dropped.into_iter().collect();
    let recorded = survey.outcomes.iter().filter(|row| {
        row.index >= outcome_count
            && !dropped.contains(&row.index)
            && !matches!(row.action, Action::Load { .. })
    });
    let mut commands: Vec<_> = match changes.replaced {
        Some(replaced) => replaced,
        None => recorded.map(timed_command).collect(),
    };
    // They come last in their step, in their order.
    let others = || commands.iter().filter(|command| command.index.is_none());
    let client_id = others().map(|command| command.client_id).max().unwrap_or(0);
    let sequence = others().map(|command| command.sequence).max().unwrap_or(0);
    let added = (sequence + 1..).zip(changes.added);
    commands.extend(added.map(|(sequence, one)| TimedCommand { client_id, sequence, ..one }));
    sort_commands(&mut commands);
    commands
}

/// Refuses commands that come after the last step, because a rewind in their own step comes before them.
fn check_last_step(commands: &[TimedCommand], last_step: u64) -> anyhow::Result<()> {
    match commands.iter().find(|command| command.step > last_step) {
        Some(command) => bail!(
            "a command would take effect in step {}, but the recording ends at step {last_step}: a step \
             with a rewind has no later commands",
            command.step
        ),
        None => Ok(()),
    }
}

/// The states that commands of the recording put in place: those of other processes, and those of steps
/// before the start.
pub(super) struct GivenStates {
    frames: FrameReader<recording::FileSource>,
    /// The applied commands with a state, by index.
    applied: BTreeMap<u64, OutcomeRow>,
}

impl GivenStates {
    fn new(frames: FrameReader<recording::FileSource>, outcomes: &[OutcomeRow]) -> Self {
        let given = outcomes.iter().filter(|row| row.puts_state_in_place() && row.is_applied());
        Self { frames, applied: given.map(|row| (row.index, row.clone())).collect() }
    }

    /// Returns the state that a recorded command put in place.
    pub(super) fn state_of(&mut self, command: &TimedCommand) -> anyhow::Result<Option<State>> {
        let row = command.index.and_then(|index| self.applied.get(&index));
        // A command of another recording may have the same index.
        if row.is_none_or(|row| (row.step, row.action) != (command.step, command.action)) {
            return Ok(None);
        }
        Ok(state_at(&mut self.frames, command.step)?.map(|(state, _)| state))
    }
}

#[cfg(test)]
mod tests {
    use sim_contract::{ConstraintKind, KindFilter};

    use super::*;

    #[test]
    fn settings_are_checked_like_those_of_a_command_file() {
        let setting = parse_setting("480:damping=0.1").unwrap();
        assert_eq!(setting.step, 480);
        assert!(matches!(setting.action, Action::Set { .. }));
        for text in ["3:gravity=[0,-5,0]", "3:tear_force=off"] {
            assert_eq!(parse_setting(text).unwrap().step, 3);
        }
        for text in ["damping=0.1", "x:damping=1", "3:damping", "3:damping=a", "-1:damping=1"] {
            assert!(parse_setting(text).unwrap_err().starts_with("it must be STEP:"), "{text}");
        }
        let part = |text: &str| match parse_setting(text).unwrap().action {
            Action::Set { constraint_kind, block, collider, .. } => {
                (constraint_kind, block, collider)
            }
            other => panic!("{other:?}"),
        };
        assert_eq!(part("3:bending.12=1e-3"), (None, Some(12), None));
        assert_eq!(part("3:friction.12=0.5"), (None, None, Some(12)));
        let shear = KindFilter::Known(ConstraintKind::Shear);
        assert_eq!(part("3:compliance.shear=1e-3"), (Some(shear), None, None));
        for (text, allowed) in [
            ("3:compliance.silk=1", "compliance.KIND"),
            ("3:damping.shear=1", "damping, which has one value"),
            ("3:damping.1=1", "damping, which has one value"),
            ("3:restitution.1=2", "0 to 1"),
            ("3:friction.shear=1", "friction.N"),
            ("3:wind_drag=1", "is now called 'wind.drag'"),
            ("3:max_speed=off", "a number > 0"),
        ] {
            let error = parse_setting(text).unwrap_err();
            assert!(error.contains(allowed), "{error}");
        }
        let error = parse_setting("3:damping=[1]").unwrap_err();
        assert!(error.starts_with("--set:1: value: "), "{error}");
    }
}
