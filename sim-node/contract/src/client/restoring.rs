//! States that a client gives to the node.

use std::time::Duration;

use sim_messages::{GivenState, Outcome};

use crate::client::request::{RequestError, StateWriter};
use crate::client::{Client, open_commander};

/// A state that was sent to the node. It must live until its outcome arrives: the message vanishes with it.
#[derive(Debug)]
pub struct SentState {
    sequence: u64,
    missed_before: u64,
    _writer: StateWriter,
}

impl SentState {
    /// Returns the sequence number, for [`Client::outcome`].
    pub fn sequence(&self) -> u64 {
        self.sequence
    }
}

impl Client {
    /// Gives a state to the node, which puts it in place at the next boundary, and waits for the
    /// outcome. The state of the step that the outcome names is the given one, and the run continues
    /// from it.
    ///
    /// # Errors
    /// Same as [`Client::request`]. The node rejects a state that is damaged or belongs to another scene.
    pub fn restore(
        &mut self,
        state: &GivenState<'_>,
        timeout: Duration,
    ) -> Result<Outcome, RequestError> {
        self.check_turn()?;
        let sent = self.send_state(state)?;
        let outcome = self.wait_for_outcome(sent.sequence, sent.missed_before, timeout);
        self.take_back(sent);
        outcome
    }

    /// Gives a state to the node like [`Client::restore`], without waiting for the outcome. When the outcome
    /// has arrived, or is no longer awaited, [`Client::take_back`] ends it.
    ///
    /// # Errors
    /// Same as [`Client::send`].
    pub fn send_state(&mut self, state: &GivenState<'_>) -> Result<SentState, RequestError> {
        let commander = open_commander(&mut self.commander, &self.attachment, self.id)?;
        let missed_before = commander.missed_count();
        let (sequence, writer) = commander.send_state(&self.attachment, state)?;
        Ok(SentState { sequence, missed_before, _writer: writer })
    }

    /// Removes a sent state. A node that has not received it does not put it in place.
    pub fn take_back(&mut self, sent: SentState) {
        self.forget(sent.sequence);
        drop(sent);
    }
}
