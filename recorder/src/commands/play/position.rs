//! Where a replay stands: what its headers and late readers are told, followed message by message.

use std::iter::repeat;

use recorder::{CollidersRow, Message, OutcomeRow, TearsRow};
use sim_contract::{Action, Method, ParameterValues, TearCause, TornConstraint};
use sim_solver::Keyframe;

/// What the headers follow from, as far as it does not stand in `/steps`.
#[derive(Debug, Clone, Default)]
pub(crate) struct Position {
    pub(super) keyframe_step: u64,
    /// The newest keyframe before the first snapshot that is played: a late joiner of the live
    /// node would have found it.
    pub(super) latched_keyframe: Option<Vec<u8>>,
    /// The newest colliders before that, likewise.
    pub(super) latched_colliders: Option<CollidersRow>,
    /// Whether the node was paused.
    pub(super) is_paused: bool,
    /// Outcomes so far.
    pub(super) outcome_count: u64,
    pub(super) rejected_count: u64,
    /// Constraints torn so far, in order.
    pub(super) torn: Vec<TornConstraint>,
    /// Step of the load or reset that [`Self::torn`] begins after.
    pub(super) since_step: u64,
    /// Parameters of the newest keyframe.
    pub(super) parameters: ParameterValues,
    /// Method of the scene.
    pub(super) method: Method,
}

/// What a recording says between two snapshots, one by one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Happening<'a> {
    /// From this step on nothing of what tore before is torn.
    Reset(u64),
    Update(&'a Message),
}

/// Updates in their order, and each reset before everything else of its step: what tears in that
/// step stands in the file before the outcome that says so.
pub(crate) fn happenings(updates: &[Message]) -> Vec<Happening<'_>> {
    let mut resets = updates.iter().filter_map(Message::reset_step).peekable();
    let mut happenings = Vec::with_capacity(updates.len());
    for update in updates {
        while let Some(step) = resets.next_if(|step| *step <= update.step()) {
            happenings.push(Happening::Reset(step));
        }
        happenings.push(Happening::Update(update));
    }
    happenings
}

impl Position {
    /// Starts with the constraints that were torn before the recording, and their causes if known.
    pub(crate) fn new(torn: &[u32], causes: Option<Vec<TearCause>>) -> Self {
        let causes = causes.unwrap_or_default().into_iter().map(Some).chain(repeat(None));
        let torn = torn.iter().zip(causes);
        Self {
            torn: torn.map(|(index, cause)| TornConstraint::new(*index, cause)).collect(),
            ..Self::default()
        }
    }

    /// Follows what belongs to a snapshot that is not played.
    pub(crate) fn skip(&mut self, updates: &[Message]) {
        for happening in happenings(updates) {
            self.follow(happening);
            match happening {
                Happening::Update(Message::Keyframe { bytes, .. }) => {
                    self.latched_keyframe = Some(bytes.clone());
                }
                Happening::Update(Message::Colliders(row)) => {
                    self.latched_colliders = Some(row.clone());
                }
                _ => {}
            }
        }
    }

    /// Follows one message.
    pub(crate) fn follow(&mut self, happening: Happening<'_>) {
        match happening {
            Happening::Reset(step) => {
                self.torn.clear();
                self.since_step = step;
            }
            Happening::Update(Message::Keyframe { step, bytes }) => {
                self.keyframe_step = *step;
                // One of another version is published all the same; it says nothing here.
                if let Ok(keyframe) = Keyframe::decode(bytes) {
                    self.is_paused = keyframe.paused;
                    self.parameters = keyframe.parameter_values(self.method);
                }
            }
            Happening::Update(Message::Outcome(row)) => self.follow_outcome(row),
            Happening::Update(Message::Tears(row)) => self.follow_tears(row),
            Happening::Update(_) => {}
        }
    }

    fn follow_tears(&mut self, row: &TearsRow) {
        for (place, constraint) in row.constraints.iter().enumerate() {
            let cause = row.causes.get(place).and_then(|name| TearCause::from_name(name));
            self.torn.push(TornConstraint::new(*constraint, cause));
        }
    }

    fn follow_outcome(&mut self, row: &OutcomeRow) {
        let is_applied = row.is_applied();
        self.outcome_count = row.index + 1;
        self.rejected_count += u64::from(!is_applied);
        // A keyframe of the same step stands before it in the file and knows better.
        if !is_applied || row.step <= self.keyframe_step {
            return;
        }
        match row.action {
            Action::Pause => self.is_paused = true,
            Action::Resume => self.is_paused = false,
            _ => {}
        }
    }
}
