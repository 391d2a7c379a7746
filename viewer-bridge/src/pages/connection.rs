//! A page, seen from its task.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use axum::extract::ws::Message;
use bytes::Bytes;
use tokio::sync::{mpsc, watch};

use super::hub::{FrameSet, wants_f32};
use crate::limits::FRAMES_UNACKNOWLEDGED_MAX;
use crate::message::Choice;

/// How many frames a page has not acknowledged.
#[derive(Debug, Default)]
pub(crate) struct Credit(AtomicU32);

impl Credit {
    /// Whether the page may be sent one more.
    pub(crate) fn is_left(&self) -> bool {
        self.0.load(Ordering::Relaxed) < FRAMES_UNACKNOWLEDGED_MAX
    }

    fn set_used(&self, count: usize) {
        self.0.store(u32::try_from(count).unwrap_or(u32::MAX), Ordering::Relaxed);
    }
}

/// A page that was taken in.
#[derive(Debug)]
pub(crate) struct Connection {
    /// Its number.
    pub(crate) client: u32,
    pub(super) choice: Choice,
    /// Reliable messages; ends when the hub gives the page up.
    pub(crate) queue: mpsc::Receiver<Message>,
    pub(crate) frames: watch::Receiver<Arc<FrameSet>>,
    pub(crate) credit: Arc<Credit>,
}

/// What of the lossy path a page has had.
#[derive(Debug, Default)]
pub(crate) struct Shown {
    /// Numbers of the frames that were sent and not acknowledged, ascending.
    unacknowledged: VecDeque<u32>,
    /// Number of the frame that was sent last, or of one that was missed since.
    last: Option<u32>,
    /// The colliders that were sent last.
    colliders: Option<u64>,
}

/// What a page is sent of the newest frame.
#[derive(Debug)]
pub(crate) enum Taken {
    /// The frame, with the colliders before it if they have changed.
    Frame(Vec<Bytes>),
    /// It has had it.
    Nothing,
    /// It was not encoded as this page wants it: the page had no credit when it was shown.
    Missed,
}

impl Connection {
    /// Takes the newest frame. That one was missed is said once.
    pub(crate) fn take_frame(&mut self, shown: &mut Shown) -> Taken {
        let frame = Arc::clone(&self.frames.borrow_and_update());
        let wants_f32 = wants_f32(self.choice, frame.particle_count);
        let encoded = if wants_f32 { &frame.f32 } else { &frame.u16 };
        if shown.last == Some(frame.number) || (frame.f32.is_none() && frame.u16.is_none()) {
            return Taken::Nothing;
        }
        shown.last = Some(frame.number);
        let Some(encoded) = encoded else { return Taken::Missed };
        let mut messages = Vec::with_capacity(2);
        if let Some(colliders) = &frame.colliders
            && shown.colliders != Some(colliders.number)
        {
            shown.colliders = Some(colliders.number);
            messages.push(colliders.bytes.clone());
        }
        messages.push(encoded.clone());
        shown.unacknowledged.push_back(frame.number);
        self.credit.set_used(shown.unacknowledged.len());
        Taken::Frame(messages)
    }

    /// The page has drawn that frame. Whether it had no credit before, and has some now.
    pub(crate) fn acknowledge(&self, frame: u32, shown: &mut Shown) -> bool {
        let had_credit = self.credit.is_left();
        while shown.unacknowledged.front().is_some_and(|sent| *sent <= frame) {
            shown.unacknowledged.pop_front();
        }
        self.credit.set_used(shown.unacknowledged.len());
        !had_credit && self.credit.is_left()
    }
}
