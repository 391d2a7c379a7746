//! A recording as a source: it is wound to where the timeline of the pages stands, and shown there.
//!
//! Only the chunks around that place are read; what a timeline has to mark is found meanwhile by
//! another thread, which reads the file once from its start.

mod check;
mod marks;
mod open;
mod player;
mod playhead;
mod settings_log;
mod statistics;

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread;

use anyhow::Context;
use recorder::{Tape, TapeState, TornList};

use crate::foxglove_server::Recording;
use crate::message::Mode;
use crate::pages::hub::Hub;
use crate::scene::load::Load;
use crate::source::{Requests, Source};
use check::{Job, check};
use player::Player;

/// A recording.
#[derive(Debug)]
pub struct Replay {
    tape: Tape,
    load: Load,
    /// The state at the first step.
    first: TapeState,
    /// Name of the file, for pages: where it lies is not theirs to know.
    file: String,
}

impl Replay {
    /// Opens a recording. `tell` is told what the user should know of it.
    ///
    /// # Errors
    /// It is no recording, or there is nothing in it to show; the text says what to do.
    pub fn open(path: &Path, tell: &mut dyn FnMut(&str)) -> anyhow::Result<Self> {
        open::open(path, tell).with_context(|| path.display().to_string())
    }

    fn job(&self) -> anyhow::Result<Job> {
        Ok(Job {
            log: self.tape.log().try_clone()?,
            first: self.first.row,
            last_step: self.tape.last_step(),
            torn: TornList::before(&self.tape.topology().torn),
        })
    }
}

impl Source for Replay {
    fn mode(&self) -> Mode {
        Mode::Replay
    }

    fn recording(&self) -> Option<Recording> {
        let run = self.tape.run();
        Some(Recording {
            epoch_ns: run.epoch_ns,
            rate_hz: run.rate_hz,
            first_step: self.tape.first_step(),
            last_step: self.tape.last_step(),
        })
    }

    fn run(&mut self, hub: &Hub, requests: &Requests) -> anyhow::Result<()> {
        let (job, file) = (self.job()?, self.file.clone());
        let (sender, reports) = channel();
        let is_over = AtomicBool::new(false);
        thread::scope(|scope| {
            thread::Builder::new()
                .name("check".to_owned())
                .spawn_scoped(scope, || check(job, &sender, &is_over))
                .context("starting the thread that checks the recording")?;
            let played = Player::new(self, reports, hub).run(requests);
            is_over.store(true, Ordering::Relaxed);
            played.context(file)
        })
    }
}
