//! Commands and their outcomes, seen from the client that sends them.

use std::collections::VecDeque;
use std::fmt;
use std::time::Duration;

use bytemuck::bytes_of;
use thiserror::Error;

use crate::clock::epoch_microseconds;
use crate::endpoint::Endpoint;
use crate::limits::{COMMANDS_BUFFERED, OUTCOMES_BUFFERED};
use crate::messages::command::{CONSOLE_CLIENT_ID, Command};
use crate::messages::outcome::Outcome;
use crate::ports::port::reader_count;
use crate::ports::reader::{Drained, ReadError, ValueReader};
use crate::ports::service::{COMMANDS, OUTCOMES, ServiceError};
use crate::ports::services::{Attachment, OwnerProcess};
use crate::ports::writer::{PublishError, ValueWriter};
use sim_types::Action;

/// Why a command has no outcome.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum RequestError {
    /// The command was sent, and no outcome came in time: what became of it is not known.
    #[error("command {sequence} has no outcome after at most {timeout:?}: {owner}")]
    Timeout {
        /// The command's sequence number.
        sequence: u64,
        /// How long it was waited for, or less if the owner went meanwhile.
        timeout: Duration,
        /// Whether anybody could have answered.
        owner: OwnerState,
    },
    /// The owner has not taken the commands before this one; it was not sent.
    #[error(
        "{COMMANDS_BUFFERED} commands of this client wait already, and this one was not sent: {owner}"
    )]
    QueueFull {
        /// Whether anybody could have taken them.
        owner: OwnerState,
    },
    /// Nobody takes commands; it was not sent.
    #[error("the command was not sent: {owner}")]
    NoReceiver {
        /// Whether the owner is alive.
        owner: OwnerState,
    },
    /// The command could not be put into shared memory; it was not sent.
    #[error(transparent)]
    Publish(#[from] PublishError),
    /// The outcomes could not be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// There was no place at the services of commands and outcomes.
    #[error(transparent)]
    Service(#[from] ServiceError),
}

/// Whether the owner was alive when a command went unanswered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OwnerState {
    /// It was, and said nothing.
    Alive {
        /// Its process id, where it is known.
        process_id: Option<u32>,
        /// The name that it owns.
        endpoint: Endpoint,
    },
    /// There was none.
    Gone {
        /// The name that nobody owns.
        endpoint: Endpoint,
    },
}

impl OwnerState {
    fn look(attachment: &Attachment) -> Self {
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
                "no node answers, although process {id} runs as {endpoint} (is it stopped, or overloaded?)"
            ),
            Self::Alive { process_id: None, endpoint } => write!(
                formatter,
                "no node answers, although one runs as {endpoint} (is it stopped, or overloaded?)"
            ),
            Self::Gone { endpoint } => write!(
                formatter,
                "no node answers, none runs as {endpoint} any more (start one with `sim-node run{}`)",
                endpoint.options()
            ),
        }
    }
}

impl RequestError {
    pub(crate) fn timeout(attachment: &Attachment, sequence: u64, timeout: Duration) -> Self {
        Self::Timeout { sequence, timeout, owner: OwnerState::look(attachment) }
    }
}

/// Sends commands of one client and sorts out their outcomes.
#[derive(Debug)]
pub(crate) struct Commander {
    client_id: u64,
    /// The sequence number of the last command.
    sequence: u64,
    /// Commands without an outcome, ascending by number; at most as many as outcomes can wait.
    unanswered: VecDeque<Command>,
    /// Outcomes that came while another one was waited for, in order; at most as many as above.
    answered: VecDeque<Outcome>,
    commands: ValueWriter<Command>,
    outcomes: ValueReader<Outcome>,
}

impl Commander {
    /// Subscribes to the outcomes first: none of a command that is sent can be missed.
    pub(crate) fn create(attachment: &Attachment, client_id: u64) -> Result<Self, ServiceError> {
        let services = &attachment.services;
        Ok(Self {
            client_id,
            sequence: 0,
            unanswered: VecDeque::new(),
            answered: VecDeque::new(),
            outcomes: ValueReader::create(&services.outcomes, &OUTCOMES)?,
            commands: ValueWriter::create(&services.commands, &COMMANDS)?,
        })
    }

    pub(crate) fn send(
        &mut self,
        attachment: &Attachment,
        action: Action,
    ) -> Result<u64, RequestError> {
        // Outcomes of other clients must not crowd out those of this one.
        self.collect()?;
        let sequence = self.next_sequence();
        let command = Command::new(self.client_id, sequence, action);
        let taken = self.commands.write(command)?;
        if taken == 0 {
            let owner = OwnerState::look(attachment);
            return Err(match reader_count(&attachment.services.commands) {
                0 => RequestError::NoReceiver { owner },
                _ => RequestError::QueueFull { owner },
            });
        }
        self.sequence = sequence;
        self.unanswered.push_back(command);
        if self.unanswered.len() > OUTCOMES_BUFFERED {
            self.unanswered.pop_front();
        }
        Ok(sequence)
    }

    /// Takes in all outcomes that have come, and keeps those of unanswered commands.
    pub(crate) fn collect(&mut self) -> Result<(), ReadError> {
        let mut drained = Drained::default();
        self.outcomes.drain(&mut drained, |outcome| {
            // The console's other processes have this client id too, and once in a while the same
            // number: only the whole command tells whose it was. NaN is compared as its bits.
            let is_of = |command: &Command| bytes_of(command) == bytes_of(&outcome.command);
            if let Some(place) = self.unanswered.iter().position(is_of) {
                self.unanswered.remove(place);
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

    /// The oldest outcome that was not taken.
    pub(crate) fn take_outcome(&mut self) -> Result<Option<Outcome>, ReadError> {
        self.collect()?;
        Ok(self.answered.pop_front())
    }

    /// The outcome of one command; others stay.
    pub(crate) fn take_outcome_of(&mut self, sequence: u64) -> Result<Option<Outcome>, ReadError> {
        self.collect()?;
        let place = self.answered.iter().position(|outcome| outcome.command.sequence == sequence);
        Ok(place.and_then(|place| self.answered.remove(place)))
    }

    /// Expects no outcome of that command any more.
    pub(crate) fn give_up(&mut self, sequence: u64) {
        if let Ok(place) =
            self.unanswered.binary_search_by_key(&sequence, |command| command.sequence)
        {
            self.unanswered.remove(place);
        }
    }

    pub(crate) fn awaits_outcomes(&self) -> bool {
        !self.unanswered.is_empty()
    }

    /// One more than the last; for the console at least the microsecond of the day, so that the
    /// processes that share it number their commands apart, and later ones higher.
    fn next_sequence(&self) -> u64 {
        let next = self.sequence + 1;
        if self.client_id == CONSOLE_CLIENT_ID { next.max(epoch_microseconds()) } else { next }
    }
}
