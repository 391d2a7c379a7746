//! Waiting for the owner, with a deadline.

use std::time::Duration;

use iceoryx2::port::listener::ListenerCreateError;

use crate::clock::Deadline;
use crate::ports::port::{Places, create_port};
use crate::ports::reader::ReadError;
use crate::ports::service::{ServiceError, WAKE};
use crate::ports::services::Attachment;
use crate::ports::session::Events;
use crate::ports::wake::{Heard, WakeListener};

/// How long to believe in an owner that says nothing. A killed one cannot say that it has gone.
const SILENCE_MAX: Duration = Duration::from_millis(500);

/// The waiting of one reader. It takes a place at the wake service with the first wait.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    listener: Option<WakeListener>,
    /// An owner has gone, and no sign of a new one has come since.
    is_abandoned: bool,
}

impl Watch {
    /// Polls until there is something, at most for `timeout`. Nothing comes of it earlier if the
    /// owner goes meanwhile; a later call then waits for a new owner.
    pub(crate) fn wait_for<T>(
        &mut self,
        attachment: &Attachment,
        timeout: Duration,
        mut poll: impl FnMut() -> Result<Option<T>, ReadError>,
    ) -> Result<Option<T>, ReadError> {
        let deadline = Deadline::after(timeout);
        let mut silence = Deadline::after(SILENCE_MAX);
        loop {
            if let Some(found) = poll()? {
                self.is_abandoned = false;
                return Ok(Some(found));
            }
            let remaining = deadline.remaining();
            if remaining.is_zero() {
                return Ok(None);
            }
            let Some(listener) = &self.listener else {
                // What happened before the first listening has woken nobody: poll again.
                self.listener = Some(listen(&attachment.services.wake)?);
                continue;
            };
            match listener.wait(remaining.min(SILENCE_MAX)) {
                Heard::Owner => silence = Deadline::after(SILENCE_MAX),
                Heard::Nothing if !silence.remaining().is_zero() => {}
                Heard::Nothing | Heard::Farewell => {
                    silence = Deadline::after(SILENCE_MAX);
                    if !self.is_abandoned && attachment.owner().is_none() {
                        let last = poll()?;
                        self.is_abandoned = last.is_none();
                        return Ok(last);
                    }
                }
            }
        }
    }
}

/// Takes a place at the wake service.
pub(crate) fn listen(service: &Events) -> Result<WakeListener, ServiceError> {
    let full = ListenerCreateError::ExceedsMaxSupportedListeners;
    let places = Places { what: "waiting processes", max: WAKE.readers_max };
    let listener = create_port(service, &full, places, || service.listener_builder().create())?;
    Ok(WakeListener::new(listener))
}
