//! Recordings of a rope with tears and a reset, and the positions of their records.

use std::io::Read;
use std::num::NonZeroU32;

use recording::{
    Closing, Compression, ContentSelection, LogOptions, LogWriter, Message, OutcomeRow,
    ParametersRow, RunDescription, StepRow, SurfaceRow, TearsRow, Topic, TopologyRow, Up,
};
use sim_messages::{Action, Command, ConstraintState, LoadHeader, Outcome, TornConstraint};
use sim_solver::{SOLVER_VERSION, Scene, Solver, builtin};

/// The last step of a recording.
pub(crate) const LAST_STEP: u64 = 40;
/// Steps of the commands.
const CUT: u64 = 10;
const RESET: u64 = 25;
const SECOND_CUT: u64 = 30;
/// Steps between keyframes.
const KEYFRAME_PERIOD: u64 = 8;

/// A deterministic pseudo-random generator (Marsaglia's xorshift64).
#[derive(Debug)]
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self((seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub(crate) fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 % limit as u64).unwrap()
    }
}

/// The choices for a recording.
#[derive(Debug)]
pub(crate) struct Recording {
    pub(crate) compression: Compression,
    /// Number of snapshots that the file declares as lost.
    pub(crate) lost: u64,
    /// Size of an attachment of another program.
    pub(crate) attachment_size_bytes: u64,
    /// The file has an end.
    pub(crate) is_finished: bool,
    /// The part of the run in the file.
    pub(crate) selection: ContentSelection,
}

impl Default for Recording {
    fn default() -> Self {
        let selection = ContentSelection::default();
        Self {
            compression: Compression::None,
            lost: 0,
            attachment_size_bytes: 0,
            is_finished: true,
            selection,
        }
    }
}

impl Recording {
    pub(crate) fn write(&self) -> Vec<u8> {
        self.write_changed(|_| {})
    }

    /// Writes the messages of a simulation after a change.
    pub(crate) fn write_changed(&self, change: impl Fn(&mut Vec<Message>)) -> Vec<u8> {
        self.write_with(change, None)
    }

    /// Writes the messages of a simulation after a change, and an end of another recording.
    pub(crate) fn write_closed(
        &self,
        change: impl Fn(&mut Vec<Message>),
        closing: &Closing,
    ) -> Vec<u8> {
        self.write_with(change, Some(closing))
    }

    fn write_with(
        &self,
        change: impl Fn(&mut Vec<Message>),
        other_closing: Option<&Closing>,
    ) -> Vec<u8> {
        let scene = Scene::from_toml(builtin::text("rope").unwrap(), "rope").unwrap();
        let mut messages = simulate(&scene);
        change(&mut messages);
        messages.retain(|message| self.has(message));
        let Self { compression, selection, .. } = *self;
        let options = LogOptions { compression, chunk_size_bytes: 8000, selection };
        let mut bytes = Vec::new();
        let text = scene.to_toml();
        let run = run(&Solver::new(&scene), scene.solver.rate_hz);
        let mut log = LogWriter::create(&mut bytes, options, &run, text.as_bytes(), 0).unwrap();
        if self.attachment_size_bytes > 0 {
            let content = std::io::repeat(7).take(self.attachment_size_bytes);
            log.attach("video", self.attachment_size_bytes, content).unwrap();
        }
        for message in &messages {
            log.write(message, run.time_of_step_ns(message.step())).unwrap();
        }
        if !self.is_finished {
            log.flush().unwrap();
            drop(log);
            return bytes;
        }
        let mut closing = Closing { stop_reason: "test".to_owned(), ..Closing::default() };
        closing.counts.set_written(log.counts());
        for topic in [Topic::Steps, Topic::Particles] {
            closing.counts[topic].lost = self.lost;
        }
        log.finish(other_closing.unwrap_or(&closing)).unwrap();
        bytes
    }

    /// Returns `true` for a message of the selection. In these recordings, the number of a snapshot is its
    /// step.
    fn has(&self, message: &Message) -> bool {
        let step = message.step();
        let is_snapshot = [Topic::Steps, Topic::Particles].contains(&message.topic());
        let is_due = step.is_multiple_of(KEYFRAME_PERIOD)
            || step == RESET
            || self.selection.has_snapshot(u32::try_from(step).unwrap());
        self.selection.has_topic(message.topic()) && (is_due || !is_snapshot)
    }
}

fn run(solver: &Solver, rate_hz: u32) -> RunDescription {
    RunDescription {
        run_id: 7,
        epoch_ns: 1_700_000_000_000_000_000,
        scene_name: "rope".to_owned(),
        origin: [0.0; 3],
        up: Up::Y,
        rate_hz,
        method: 0,
        particle_count: u32::try_from(solver.particle_count()).unwrap(),
        constraint_count: u32::try_from(solver.constraint_count()).unwrap(),
        bend_count: u32::try_from(solver.bend_count()).unwrap(),
        solver_version: SOLVER_VERSION,
        contract_version: 4,
        recorder_version: env!("CARGO_PKG_VERSION").to_owned(),
    }
}

/// Returns the messages of a simulation with a cut, a reset and another cut.
fn simulate(scene: &Scene) -> Vec<Message> {
    let mut solver = Solver::new(scene);
    let header = LoadHeader::default();
    let constraints: Vec<ConstraintState> = solver
        .constraints()
        .map(|one| ConstraintState {
            a: one.a,
            b: one.b,
            rest_length: one.rest_length,
            compliance: one.compliance,
            kind: one.kind as u32,
        })
        .collect();
    let mut messages = vec![
        Message::Topology(TopologyRow::new(&header, &constraints, &[])),
        Message::Surface(SurfaceRow::new(&header, &[])),
    ];
    let mut outcome_count = 0;
    let mut scene_step = 0;
    for step in 0..=LAST_STEP {
        let action = match step {
            CUT => Some((Action::Cut { constraint: 3 }, Some(3))),
            RESET => Some((Action::Reset, None)),
            SECOND_CUT => Some((Action::Cut { constraint: 1 }, Some(1))),
            _ => None,
        };
        if let Some((action, torn)) = action {
            let result = solver.apply(1, &action);
            let command = Command::new(1, outcome_count, action);
            let outcome = Outcome::new(outcome_count, step, command, result.map(drop));
            outcome_count += 1;
            let torn =
                torn.map(|index| [TornConstraint::new(index, Some(sim_messages::TearCause::Cut))]);
            messages.extend(torn.map(|torn| Message::Tears(TearsRow::new(step, &torn))));
            messages.push(Message::Outcome(OutcomeRow::from(&outcome)));
        }
        if step > 0 {
            solver.step();
        }
        scene_step = if step == RESET || step == 0 { 0 } else { scene_step + 1 };
        if step == 0 {
            let values = solver.parameter_values().clone();
            messages.push(Message::Parameters(ParametersRow { step, values }));
        }
        if step % KEYFRAME_PERIOD == 0 || step == RESET {
            messages.push(Message::Keyframe { step, bytes: solver.keyframe().encode() });
        }
        messages.push(Message::Step(StepRow {
            step,
            scene_step,
            state_hash: solver.state_hash(),
            torn_count: u32::try_from(solver.torn().len()).unwrap(),
            outcome_count,
            snapshot_index: u32::try_from(step).unwrap(),
            ..StepRow::default()
        }));
        let particles = bytemuck::cast_slice(solver.particles()).to_vec();
        messages.push(Message::Particles { step, particles });
    }
    messages
}

/// Selections that leave out snapshots.
pub(crate) fn selections() -> [ContentSelection; 2] {
    [3, 7].map(every)
}

/// The selection of every n-th snapshot.
pub(crate) fn every(count: u32) -> ContentSelection {
    ContentSelection { every: NonZeroU32::new(count).unwrap(), ..ContentSelection::default() }
}

/// A record of a file, outside of chunks.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) opcode: u8,
    pub(crate) start: usize,
    pub(crate) end: usize,
}

/// Returns the records of an intact file.
pub(crate) fn records(bytes: &[u8]) -> Vec<Place> {
    let mut places = Vec::new();
    let mut start = 8;
    while start + 9 <= bytes.len() {
        let length = u64::from_le_bytes(bytes[start + 1..start + 9].try_into().unwrap());
        let end = start + 9 + usize::try_from(length).unwrap();
        places.push(Place { opcode: bytes[start], start, end });
        start = end;
    }
    places
}
