//! Sending of commands and matching of their outcomes.

use std::collections::VecDeque;
use std::fmt;
use std::time::Duration;

use bytemuck::bytes_of;
use sim_host::clock::epoch_microseconds;
use sim_messages::{
    Action, COMMANDS_BUFFERED, COMMANDS_PER_STEP_MAX, CONSOLE_CLIENT_ID, Command, GivenState,
    OUTCOME_FLAG_CONTROL, OUTCOMES_BUFFERED, Outcome, RestoreHeader,
};
use thiserror::Error;

use crate::endpoint::Endpoint;
use crate::ports::port::reader_count;
use crate::ports::reader::{Drained, ReadError, Reader};
use crate::ports::service::{COMMANDS, OUTCOMES, ServiceError};
use crate::ports::services::{AttachError, Attachment, OwnerProcess};
use crate::ports::writer::{Capacity, PublishError, Writer};

/// Error of a request: the command has no outcome.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum RequestError {
    /// The command was sent, and other outcomes were overwritten before this client read them. One of
    /// them may have been that of the command, which may have been applied.
    #[error(
        "no outcome of command {sequence} after at most {timeout:?}, but {missed_count} outcomes were \
         overwritten before they were read, so the command may have been applied (other clients send \
         many commands: read outcomes more often)"
    )]
    OutcomesMissed {
        /// Sequence number of the command.
        sequence: u64,
        /// Longest wait.
        timeout: Duration,
        /// Number of outcomes that were missed since the command was sent.
        missed_count: u64,
    },
    /// The command was sent, but no outcome arrived in time. Its effect is unknown.
    #[error(
        "no outcome of command {sequence} after at most {timeout:?}, so its effect is unknown: {owner}"
    )]
    Timeout {
        /// Sequence number of the command.
        sequence: u64,
        /// Longest wait. It was shorter if the owner went meanwhile.
        timeout: Duration,
        /// State of the owner after the wait.
        owner: OwnerState,
    },
    /// The command was not sent, because the node waits for this client before it answers.
    #[error(
        "the command was not sent: it is this client's turn in the lockstep, so no outcome would come; \
         use `send`, then `ready`"
    )]
    InTurn,
    /// The command was not sent, because the owner has not received the commands before it.
    #[error(
        "the command was not sent, because {COMMANDS_BUFFERED} commands of this client are waiting: {owner}"
    )]
    QueueFull {
        /// State of the owner.
        owner: OwnerState,
    },
    /// The command was not sent, because no owner receives commands.
    #[error("the command was not sent: {owner}")]
    NoReceiver {
        /// State of the owner.
        owner: OwnerState,
    },
    /// The command was not sent, because it could not be written into shared memory.
    #[error(transparent)]
    Publish(#[from] PublishError),
    /// The outcomes could not be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The services of commands and outcomes have no place for another client.
    #[error(transparent)]
    Service(#[from] ServiceError),
}

/// State of the owner when a command remained unanswered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OwnerState {
    /// The owner was alive, but did not answer.
    Alive {
        /// Process id of the owner, if it is known.
        process_id: Option<u32>,
        /// Name of the owner.
        endpoint: Endpoint,
    },
    /// There was no owner.
    Gone {
        /// Name without an owner.
        endpoint: Endpoint,
    },
}

impl OwnerState {
    pub(crate) fn query(attachment: &Attachment) -> Self {
        let endpoint = attachment.session.endpoint.clone();
        match attachment.owner() {
            Some(OwnerProcess { id }) => Self::Alive { process_id: id, endpoint },
            None => Self::Gone { endpoint },
        }
    }
}

impl fmt::Display for OwnerState {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Alive { process_id: Some(id), endpoint } => write!(
                formatter,
                "process {id} runs as {endpoint}, but does not answer (is it stopped, or overloaded?)"
            ),
            Self::Alive { process_id: None, endpoint } => write!(
                formatter,
                "a node runs as {endpoint}, but does not answer (is it stopped, or overloaded?)"
            ),
            Self::Gone { endpoint } => write!(
                formatter,
                "no node runs as {endpoint} now (start one with `sim-node run{}`)",
                endpoint.options()
            ),
        }
    }
}

impl RequestError {
    pub(crate) fn timeout(attachment: &Attachment, sequence: u64, timeout: Duration) -> Self {
        Self::Timeout { sequence, timeout, owner: OwnerState::query(attachment) }
    }
}

/// Most commands of a client that wait for their outcome. A node keeps fewer, those of all clients together:
/// it applies one rewind per step, and takes further commands meanwhile. So only a command whose outcome was
/// missed, or whose node has ended, is beyond this number.
const UNANSWERED_MAX: usize = 32 * COMMANDS_PER_STEP_MAX;

/// The writer of one state.
pub(crate) type StateWriter = Writer<u8, RestoreHeader>;

/// Returns the id of a new client. Ids below 2^53 are exact in JSON.
pub(crate) fn random_client_id() -> Result<u64, AttachError> {
    let random = getrandom::u64()
        .map_err(|error| AttachError::NoRandomNumber { detail: error.to_string() })?;
    Ok((random >> 11).max(CONSOLE_CLIENT_ID + 1))
}

/// Sends the commands of one client and matches their outcomes.
#[derive(Debug)]
pub(crate) struct Commander {
    client_id: u64,
    /// Sequence number of the last command.
    sequence: u64,
    /// Commands without an outcome, by ascending number; at most [`UNANSWERED_MAX`].
    unanswered: VecDeque<Command>,
    /// Outcomes that arrived while the client waited for another, in the order of application; at most
    /// [`OUTCOMES_BUFFERED`].
    answered: VecDeque<Outcome>,
    commands: Writer<Command>,
    outcomes: Reader<Outcome>,
    gaps: OutcomeGaps,
}

/// Counts outcomes that were overwritten before they were read. Their indices have no gaps in a run.
#[derive(Debug, Default)]
struct OutcomeGaps {
    run_id: u64,
    /// `None` before the first outcome.
    next_index: Option<u64>,
    missed_count: u64,
}

impl OutcomeGaps {
    fn add(&mut self, outcome: &Outcome) {
        // The index of an answer to a control of a replay is not its own.
        if outcome.flags & OUTCOME_FLAG_CONTROL != 0 {
            return;
        }
        let next = self.next_index.filter(|_| outcome.run_id == self.run_id);
        let missed = outcome.index.saturating_sub(next.unwrap_or(outcome.index));
        self.missed_count = self.missed_count.saturating_add(missed);
        self.run_id = outcome.run_id;
        self.next_index = Some(outcome.index.saturating_add(1));
    }
}

impl Commander {
    /// Connects to the services. Subscribes to the outcomes first, so that it misses none.
    pub(crate) fn create(attachment: &Attachment, client_id: u64) -> Result<Self, ServiceError> {
        let Attachment { services, source, .. } = attachment;
        Ok(Self {
            client_id,
            sequence: 0,
            gaps: OutcomeGaps::default(),
            unanswered: VecDeque::new(),
            answered: VecDeque::new(),
            outcomes: Reader::create(&services.outcomes, &OUTCOMES, source)?,
            commands: Writer::of_values(&services.config, &services.commands, &COMMANDS)?,
        })
    }

    pub(crate) fn send(
        &mut self,
        attachment: &Attachment,
        action: Action,
    ) -> Result<u64, RequestError> {
        // Outcomes of other clients must not push this client's out of the buffer.
        self.receive_outcomes()?;
        let sequence = self.next_sequence();
        let command = Command::new(self.client_id, sequence, action);
        let receiver_count = self.commands.send_value(command)?;
        if receiver_count == 0 {
            let owner = OwnerState::query(attachment);
            return Err(match reader_count(&attachment.services.commands) {
                0 => RequestError::NoReceiver { owner },
                _ => RequestError::QueueFull { owner },
            });
        }
        self.await_outcome(command);
        Ok(sequence)
    }

    fn await_outcome(&mut self, command: Command) {
        self.sequence = command.sequence;
        self.unanswered.push_back(command);
        if self.unanswered.len() > UNANSWERED_MAX {
            self.unanswered.pop_front();
        }
    }

    /// Sends a state. Returns its sequence number and its writer, which must live until the outcome
    /// arrives.
    pub(crate) fn send_state(
        &mut self,
        attachment: &Attachment,
        state: &GivenState<'_>,
    ) -> Result<(u64, StateWriter), RequestError> {
        self.receive_outcomes()?;
        let sequence = self.next_sequence();
        let header = state.header(self.client_id, sequence);
        let services = &attachment.services;
        let len_max = usize::try_from(header.size_bytes).unwrap_or(usize::MAX);
        let capacity = Capacity { len_max, samples: 1 };
        let writer = Writer::create(&services.config, &services.restore, capacity)?;
        if writer.send(header, |index| state.byte(index))? == 0 {
            return Err(RequestError::NoReceiver { owner: OwnerState::query(attachment) });
        }
        let action = Action::Restore { contents: state.contents(), state_hash: 0 };
        self.await_outcome(Command::new(self.client_id, sequence, action));
        Ok((sequence, writer))
    }

    /// Receives all outcomes, and keeps those of unanswered commands.
    pub(crate) fn receive_outcomes(&mut self) -> Result<(), ReadError> {
        let mut drained = Drained::default();
        self.outcomes.drain_values(&mut drained, |outcome| {
            self.gaps.add(outcome);
            if outcome.command.client_id != self.client_id {
                return;
            }
            // Processes that share the console's client id may use the same number, so the whole
            // commands are compared, as bytes because of NaN.
            let answered = outcome.command.as_sent();
            let is_answered =
                |command: &Command| bytes_of(&command.as_sent()) == bytes_of(&answered);
            if let Some(index) = self.unanswered.iter().position(is_answered) {
                self.unanswered.remove(index);
                self.answered.push_back(*outcome);
            }
        });
        if let Some(error) = drained.errors.pop() {
            return Err(error);
        }
        while self.answered.len() > OUTCOMES_BUFFERED {
            self.answered.pop_front();
        }
        Ok(())
    }

    /// Returns the oldest unread outcome.
    pub(crate) fn next_outcome(&mut self) -> Result<Option<Outcome>, ReadError> {
        self.receive_outcomes()?;
        Ok(self.answered.pop_front())
    }

    /// Returns the outcome of one command, and keeps the others.
    pub(crate) fn outcome_for(&mut self, sequence: u64) -> Result<Option<Outcome>, ReadError> {
        self.receive_outcomes()?;
        let index = self.answered.iter().position(|outcome| outcome.command.sequence == sequence);
        Ok(index.and_then(|index| self.answered.remove(index)))
    }

    /// Stops waiting for the outcome of a command.
    pub(crate) fn forget(&mut self, sequence: u64) {
        if let Ok(index) =
            self.unanswered.binary_search_by_key(&sequence, |command| command.sequence)
        {
            self.unanswered.remove(index);
        }
    }

    /// Returns the number of outcomes of all clients that were overwritten before they were read.
    pub(crate) fn missed_count(&self) -> u64 {
        self.gaps.missed_count
    }

    pub(crate) fn awaits_outcomes(&self) -> bool {
        !self.unanswered.is_empty()
    }

    /// Returns the last number plus 1. For the console it is at least the microseconds since 1970, so
    /// that the processes that share the console use different, ascending numbers.
    fn next_sequence(&self) -> u64 {
        let next = self.sequence + 1;
        if self.client_id == CONSOLE_CLIENT_ID { next.max(epoch_microseconds()) } else { next }
    }
}
