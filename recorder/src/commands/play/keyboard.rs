//! The terminal as a keyboard: reads each key when it is pressed.

use std::io::{self, IsTerminal};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use anyhow::Context;
use rustix::event::{PollFd, PollFlags, poll};
use rustix::process::{Signal, getpgrp, kill_current_process_group};
use rustix::termios::{
    LocalModes, OptionalActions, SpecialCodeIndex, Termios, tcgetattr, tcgetpgrp, tcsetattr,
};
use rustix::time::Timespec;
use signal_hook::consts::SIGCONT;
use signal_hook::iterator::{Handle, Signals};
use sim_contract::Stop;

use super::keys::Key;

/// Most bytes to read at once.
const READ_SIZE_BYTES: usize = 64;
/// The byte that a terminal sends for Ctrl-Z.
const CTRL_Z: u8 = 0x1a;
/// The code of a key that is off.
const DISABLED: u8 = 0;

/// The terminal on stdin. Dropping it restores the terminal.
#[derive(Debug)]
pub(super) struct Keyboard {
    terminal: Arc<Terminal>,
    signals: Handle,
    /// Bytes that are not complete keys yet.
    bytes: Vec<u8>,
}

/// The modes of the terminal. They belong to the process group in the foreground: a replay in the
/// background neither reads nor changes the terminal, which would stop it.
#[derive(Debug, Default)]
struct Terminal {
    modes: Mutex<Modes>,
}

#[derive(Debug, Default)]
struct Modes {
    /// The modes to restore; `None` unless keys are read.
    original: Option<Termios>,
    /// Keys are not read again.
    is_ended: bool,
}

impl Keyboard {
    /// Reads keys from now on, if stdin is a terminal.
    pub(super) fn open(stop: &Stop) -> anyhow::Result<Option<Self>> {
        if !io::stdin().is_terminal() {
            return Ok(None);
        }
        let terminal = Arc::new(Terminal::default());
        // A second Ctrl-C ends the program at once, so the first one restores the terminal. After a stop, the
        // shell may have changed the modes.
        let mut signals = Signals::new(stop.signals().iter().chain(&[SIGCONT]))
            .context("cannot handle signals for the keys")?;
        let (handle, for_signals) = (signals.handle(), Arc::clone(&terminal));
        thread::Builder::new()
            .name("terminal".to_owned())
            .spawn(move || {
                for signal in signals.forever() {
                    if signal == SIGCONT { for_signals.resume() } else { for_signals.end() }
                }
            })
            .context("cannot start the thread that restores the terminal")?;
        terminal.begin();
        Ok(Some(Self { terminal, signals: handle, bytes: Vec::new() }))
    }

    /// Returns the next key that was pressed. Ctrl-Z stops the process, as in any program.
    pub(super) fn next(&mut self) -> Option<Key> {
        if self.bytes.is_empty() || !self.has_key() {
            self.terminal.begin();
            self.read();
        }
        if self.bytes.first() == Some(&CTRL_Z) {
            self.bytes.remove(0);
            self.terminal.suspend();
        }
        Key::remove_first(&mut self.bytes)
    }

    fn has_key(&self) -> bool {
        Key::remove_first(&mut self.bytes.clone()).is_some()
    }

    /// Reads the bytes that have arrived. A terminal that is gone has none.
    fn read(&mut self) {
        let stdin = io::stdin();
        let mut streams = [PollFd::new(&stdin, PollFlags::IN)];
        let at_once = Timespec { tv_sec: 0, tv_nsec: 0 };
        if !is_in_foreground() || poll(&mut streams, Some(&at_once)).is_err() {
            return;
        }
        if streams[0].revents().contains(PollFlags::IN) {
            let mut buffer = [0; READ_SIZE_BYTES];
            let count = rustix::io::read(&stdin, &mut buffer).unwrap_or(0);
            self.bytes.extend_from_slice(&buffer[..count]);
        }
    }
}

impl Drop for Keyboard {
    fn drop(&mut self) {
        self.signals.close();
        self.terminal.end();
    }
}

impl Terminal {
    /// Makes the terminal send each key at once, without showing it, unless it does.
    fn begin(&self) {
        let mut modes = self.modes.lock().unwrap_or_else(PoisonError::into_inner);
        if modes.original.is_none() && !modes.is_ended && is_in_foreground() {
            modes.original = tcgetattr(io::stdin()).ok();
            modes.set_for_keys();
        }
    }

    /// Sets the modes again after a stop.
    fn resume(&self) {
        let modes = self.modes.lock().unwrap_or_else(PoisonError::into_inner);
        if is_in_foreground() {
            modes.set_for_keys();
        }
    }

    fn restore(&self) {
        self.modes.lock().unwrap_or_else(PoisonError::into_inner).restore();
    }

    /// Restores the terminal at the end of the program.
    fn end(&self) {
        let mut modes = self.modes.lock().unwrap_or_else(PoisonError::into_inner);
        modes.is_ended = true;
        modes.restore();
    }

    /// Stops the process group with the restored terminal, until the shell continues it.
    fn suspend(&self) {
        self.restore();
        // Without a shell that could continue it, the kernel ignores the signal.
        let _sent = kill_current_process_group(Signal::TSTP);
        self.begin();
    }
}

impl Modes {
    /// Ctrl-C still sends its signal. Ctrl-Z arrives as a byte, so that the terminal can be restored first.
    fn set_for_keys(&self) {
        let Some(mut modes) = self.original.clone() else { return };
        modes.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
        modes.special_codes[SpecialCodeIndex::VMIN] = 1;
        modes.special_codes[SpecialCodeIndex::VTIME] = 0;
        modes.special_codes[SpecialCodeIndex::VSUSP] = DISABLED;
        // A terminal that is gone has no modes.
        let _set = tcsetattr(io::stdin(), OptionalActions::Now, &modes);
    }

    fn restore(&mut self) {
        if let Some(original) = self.original.take()
            && is_in_foreground()
        {
            let _set = tcsetattr(io::stdin(), OptionalActions::Now, &original);
        }
    }
}

/// Returns `true` unless the terminal belongs to another process group. A terminal that does not control
/// this process belongs to none.
fn is_in_foreground() -> bool {
    tcgetpgrp(io::stdin()).map_or(true, |group| group == getpgrp())
}
