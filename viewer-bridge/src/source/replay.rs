//! A recording as a source: shows the state at the place of the playhead.
//!
//! The player reads only the chunks around that place. Another thread reads the file once from its
//! start, to check the hashes and to find the marks of the timeline.

mod check;
mod ghosts;
mod marks;
mod open;
mod player;
mod playhead;
mod texts;

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread;

use anyhow::Context;
use recording::ReadError;
use sim_host::Stop;

use super::Source;
use crate::message::Mode;
use crate::request::Requests;
use crate::sink::Sinks;
use crate::source::recording_times::RecordingTimes;
use check::{Job, check};
use ghosts::Ghosts;
use open::Recording;
use player::Player;

pub use ghosts::GhostChoice;

/// A recording as a source.
#[derive(Debug)]
pub struct Replay {
    recording: Recording,
    ghosts: Ghosts,
    start: InitialPlayback,
}

/// The playback before the first request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InitialPlayback {
    /// Paused at the first step.
    Paused,
    /// Playing, again and again, for viewers that cannot control the playback.
    Looping,
}

impl Replay {
    /// Opens a recording, until a signal arrives. Its ghost is one of `ghosts`. `note` receives messages for the user.
    ///
    /// # Errors
    /// The file is not a recording, or has no state to show. The message names the remedy.
    pub fn open(
        path: &Path,
        start: InitialPlayback,
        ghosts: GhostChoice,
        stop: &Stop,
        note: &mut dyn FnMut(&str),
    ) -> anyhow::Result<Self> {
        let recording = open::open(path, stop, note).with_context(|| path.display().to_string())?;
        let mut ghosts = Ghosts::new(ghosts, stop.clone());
        ghosts.choose_given(&recording);
        Ok(Self { recording, ghosts, start })
    }

    fn job(&self) -> Job {
        let Recording { tape, first, .. } = &self.recording;
        Job { log: tape.log().clone(), first: first.row, last_step: tape.last_step() }
    }
}

impl Source for Replay {
    fn mode(&self) -> Mode {
        Mode::Replay
    }

    fn recording(&self) -> Option<RecordingTimes> {
        let tape = &self.recording.tape;
        let run = tape.run();
        Some(RecordingTimes {
            epoch_ns: run.epoch_ns,
            rate_hz: run.rate_hz,
            first_step: tape.first_step(),
            last_step: tape.last_step(),
        })
    }

    fn run(&mut self, sinks: &Sinks, requests: &Requests) -> anyhow::Result<()> {
        let (job, file) = (self.job(), self.recording.file.clone());
        let (sender, reports) = channel();
        let is_cancelled = AtomicBool::new(false);
        thread::scope(|scope| {
            thread::Builder::new()
                .name("check".to_owned())
                .spawn_scoped(scope, || check(job, &sender, &is_cancelled))
                .context("starting the thread that checks the recording")?;
            let mut player = Player::new(&mut self.recording, &mut self.ghosts, reports, sinks);
            if self.start == InitialPlayback::Looping {
                player.start_looping();
            }
            let played = player.run(requests);
            is_cancelled.store(true, Ordering::Relaxed);
            match played {
                // The signal also ends the program.
                Err(ReadError::Interrupted) => Ok(()),
                played => played.context(file),
            }
        })
    }
}
