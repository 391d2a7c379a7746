//! Waiting for the owner, with a deadline.

use std::time::Duration;

use iceoryx2::port::listener::ListenerCreateError;
use sim_host::clock::Deadline;

use crate::ports::port::{PortLimit, create_port};
use crate::ports::reader::ReadError;
use crate::ports::service::{ServiceError, WAKE};
use crate::ports::services::Attachment;
use crate::ports::session::Events;
use crate::ports::wake::{WakeCause, WakeListener};

/// Longest silence before checking that the owner is alive. A killed owner sends no event.
const SILENCE_MAX: Duration = Duration::from_millis(500);

/// Waits for messages. Connects to the wake service with the first wait.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    listener: Option<WakeListener>,
    /// The owner is gone, and no message of a new owner has arrived since.
    is_abandoned: bool,
}

impl Watch {
    /// Polls until there is a message, at most for `timeout`. Returns `None` early if the owner goes
    /// meanwhile; a later call then waits for a new owner.
    pub(crate) fn wait_for<T>(
        &mut self,
        attachment: &Attachment,
        timeout: Duration,
        mut poll: impl FnMut() -> Result<Option<T>, ReadError>,
    ) -> Result<Option<T>, ReadError> {
        let mut message = None;
        self.wait_until(attachment, timeout, &mut || {
            message = poll()?;
            Ok(message.is_some())
        })?;
        Ok(message)
    }

    /// Same as [`Self::wait_for`], compiled once for all messages.
    fn wait_until(
        &mut self,
        attachment: &Attachment,
        timeout: Duration,
        poll: &mut dyn FnMut() -> Result<bool, ReadError>,
    ) -> Result<(), ReadError> {
        let deadline = Deadline::after(timeout);
        let mut silence = Deadline::after(SILENCE_MAX);
        loop {
            if poll()? {
                self.is_abandoned = false;
                return Ok(());
            }
            let remaining = deadline.remaining();
            if remaining.is_zero() {
                return Ok(());
            }
            let Some(listener) = &self.listener else {
                // Events before this connection are lost: poll again.
                self.listener = Some(listen(&attachment.services.wake)?);
                continue;
            };
            match listener.wait(remaining.min(SILENCE_MAX)) {
                WakeCause::Event => silence = Deadline::after(SILENCE_MAX),
                WakeCause::Timeout if !silence.remaining().is_zero() => {}
                WakeCause::Timeout | WakeCause::OwnerGone => {
                    silence = Deadline::after(SILENCE_MAX);
                    if !self.is_abandoned && attachment.owner().is_none() {
                        self.is_abandoned = !poll()?;
                        return Ok(());
                    }
                }
            }
        }
    }
}

/// Connects to the wake service.
pub(crate) fn listen(service: &Events) -> Result<WakeListener, ServiceError> {
    let full = ListenerCreateError::ExceedsMaxSupportedListeners;
    let limit = PortLimit { ports: "waiting processes", max: WAKE.readers_max };
    let listener = create_port(service, &full, limit, || service.listener_builder().create())?;
    Ok(WakeListener::new(listener))
}
