//! A page, seen from the task that serves it.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use axum::extract::ws::Message;
use bytes::Bytes;
use tokio::sync::{mpsc, watch};

use super::frames::FrameSet;
use crate::limits::FRAMES_UNACKNOWLEDGED_MAX;
use crate::message::Choice;
use crate::request::ClientId;
use crate::wire::Format;

/// Number of frames that a page has not acknowledged.
#[derive(Debug, Default)]
pub(super) struct Credit(AtomicU32);

impl Credit {
    /// Returns whether the page can receive another frame.
    pub(super) fn is_left(&self) -> bool {
        self.0.load(Ordering::Relaxed) < FRAMES_UNACKNOWLEDGED_MAX
    }

    fn set_used(&self, count: usize) {
        self.0.store(u32::try_from(count).unwrap_or(u32::MAX), Ordering::Relaxed);
    }
}

/// Values besides the positions that a page has asked for.
#[derive(Debug, Default)]
pub(crate) struct Subscription {
    /// The forces of each step.
    pub(crate) forces: bool,
    /// The speeds of all particles.
    pub(crate) speeds: bool,
    /// The exact states of these particles.
    pub(crate) particles: Vec<u32>,
}

impl Subscription {
    /// Returns the subscribed messages of a frame.
    pub(super) fn select(&self, frame: &FrameSet) -> impl Iterator<Item = Bytes> + use<> {
        let forces = frame.forces.clone().filter(|_| self.forces);
        let speeds = frame.speeds.clone().filter(|_| self.speeds);
        let inspected = frame.inspected.clone().filter(|_| !self.particles.is_empty());
        [forces, speeds, inspected].into_iter().flatten()
    }
}

/// A page that has joined.
#[derive(Debug)]
pub(crate) struct Connection {
    pub(crate) client: ClientId,
    pub(super) choice: Choice,
    /// Reliable messages. The queue ends when the hub gives the page up.
    pub(crate) queue: mpsc::Receiver<Message>,
    pub(crate) frames: watch::Receiver<Arc<FrameSet>>,
    pub(super) credit: Arc<Credit>,
    pub(super) subscription: Arc<Mutex<Subscription>>,
    pub(super) sent: SentFrames,
}

/// The lossy messages that a page has received.
#[derive(Debug, Default)]
pub(super) struct SentFrames {
    /// Numbers of the frames that are not acknowledged, ascending.
    unacknowledged: VecDeque<u32>,
    /// Number of the newest frame that was sent or missed.
    newest: Option<u32>,
    /// Number of the colliders that were sent last.
    colliders: Option<u64>,
}

/// Messages for a page that show the newest frame.
#[derive(Debug)]
pub(crate) enum NextFrame {
    /// The frame, after the colliders if they have changed, and what else the page wants.
    Frame(Vec<Bytes>),
    /// The page has received it before.
    Nothing,
    /// It was not encoded in the page's format: the page had no credit at that time.
    Missed,
}

/// Effect of an acknowledgement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Acknowledged {
    /// The page had no credit and has some now.
    CreditRestored,
    /// The page had credit before, or still has none.
    Unchanged,
}

impl Connection {
    /// Returns the newest frame for the page. Reports a missed frame once.
    pub(crate) fn next_frame(&mut self) -> NextFrame {
        let frame = Arc::clone(&self.frames.borrow_and_update());
        let encoded = match frame.properties.format_for(self.choice) {
            Format::F32 => &frame.f32,
            Format::U16 => &frame.u16,
        };
        let subscribed = self.subscribed(&frame);
        let sent = &mut self.sent;
        if sent.newest == Some(frame.number) || (frame.f32.is_none() && frame.u16.is_none()) {
            return NextFrame::Nothing;
        }
        sent.newest = Some(frame.number);
        let Some(encoded) = encoded else { return NextFrame::Missed };
        let mut messages = Vec::with_capacity(6);
        if let Some(colliders) = &frame.colliders
            && sent.colliders != Some(colliders.number)
        {
            sent.colliders = Some(colliders.number);
            messages.push(colliders.bytes.clone());
        }
        messages.extend(frame.ghost.clone());
        messages.extend(subscribed);
        messages.push(encoded.clone());
        sent.unacknowledged.push_back(frame.number);
        self.credit.set_used(sent.unacknowledged.len());
        NextFrame::Frame(messages)
    }

    /// Returns the messages of a frame that the page has asked for.
    fn subscribed(&self, frame: &FrameSet) -> impl Iterator<Item = Bytes> + use<> {
        self.subscription.lock().unwrap_or_else(PoisonError::into_inner).select(frame)
    }

    /// Changes the subscription of the page.
    pub(crate) fn change_subscription(&self, change: impl FnOnce(&mut Subscription)) {
        change(&mut self.subscription.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// Notes that the page has drawn a frame.
    pub(crate) fn acknowledge(&mut self, frame: u32) -> Acknowledged {
        let had_credit = self.credit.is_left();
        let unacknowledged = &mut self.sent.unacknowledged;
        while unacknowledged.front().is_some_and(|sent| *sent <= frame) {
            unacknowledged.pop_front();
        }
        self.credit.set_used(unacknowledged.len());
        if !had_credit && self.credit.is_left() {
            Acknowledged::CreditRestored
        } else {
            Acknowledged::Unchanged
        }
    }
}
