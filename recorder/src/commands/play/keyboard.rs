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
use sim_host::Stop;
use sim_host::clock::SECOND_NS;

use super::control::{Control, Request, SeekTarget};

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

/// The table of the keys, for the help text.
pub(super) const HELP: &str = "Keys on a terminal:\n  \
    space        pause or resume\n  \
    right, left  1 s forward, back\n  \
    . and ,      pause; then one snapshot forward, back\n  \
    up, down     the next faster, slower rate of 0.01, 0.02, 0.05, 0.1, ... 100\n  \
    0 to 9       go to 0 % to 90 %\n  \
    q            quit";

/// The rates that the keys select.
const RATES: [f64; 13] = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
const SECOND: i64 = SECOND_NS.cast_signed();

/// A key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Key {
    Space,
    Right,
    Left,
    Up,
    Down,
    Period,
    Comma,
    Digit(u8),
    Quit,
    /// A key without a meaning here.
    Other,
}

impl Key {
    /// Removes the first key from the bytes of a terminal. Returns `None` if its bytes are not complete.
    pub(super) fn remove_first(bytes: &mut Vec<u8>) -> Option<Self> {
        let (key, length) = match bytes.as_slice() {
            [] | [0x1b] | [0x1b, b'[' | b'O'] => return None,
            // Terminals send arrows in one of two forms, depending on their mode.
            [0x1b, b'[' | b'O', b'A', ..] => (Self::Up, 3),
            [0x1b, b'[' | b'O', b'B', ..] => (Self::Down, 3),
            [0x1b, b'[' | b'O', b'C', ..] => (Self::Right, 3),
            [0x1b, b'[' | b'O', b'D', ..] => (Self::Left, 3),
            [0x1b, b'[' | b'O', rest @ ..] => (Self::Other, 2 + sequence_length(rest)?),
            [b' ', ..] => (Self::Space, 1),
            [b'.', ..] => (Self::Period, 1),
            [b',', ..] => (Self::Comma, 1),
            [digit @ b'0'..=b'9', ..] => (Self::Digit(digit - b'0'), 1),
            [b'q', ..] => (Self::Quit, 1),
            [_, ..] => (Self::Other, 1),
        };
        bytes.drain(..length);
        Some(key)
    }

    /// Returns the request of the key, if it has one.
    pub(super) fn request(self, control: Control) -> Option<Request> {
        let is_paused = control.is_paused;
        Some(match self {
            Self::Space if is_paused => Request::Resume,
            Self::Space => Request::Pause,
            Self::Period | Self::Comma if !is_paused => Request::Pause,
            Self::Period => Request::Step(1),
            Self::Comma => Request::Seek(SeekTarget::Previous),
            Self::Right => Request::Seek(SeekTarget::By(SECOND)),
            Self::Left => Request::Seek(SeekTarget::By(-SECOND)),
            Self::Up => Request::Rate(RATES.into_iter().find(|rate| *rate > control.rate)?),
            Self::Down => Request::Rate(RATES.into_iter().rfind(|rate| *rate < control.rate)?),
            Self::Digit(digit) => Request::Seek(SeekTarget::Percent(digit * 10)),
            Self::Quit | Self::Other => return None,
        })
    }
}

/// Returns the length of the rest of an escape sequence: parameters and a final byte (ECMA-48).
fn sequence_length(rest: &[u8]) -> Option<usize> {
    rest.iter().position(|byte| (0x40..=0x7e).contains(byte)).map(|end| end + 1)
}

#[cfg(test)]
mod keys_tests {
    use super::*;

    fn keys(text: &str) -> Vec<Key> {
        let mut bytes = text.as_bytes().to_vec();
        std::iter::from_fn(|| Key::remove_first(&mut bytes)).collect()
    }

    #[test]
    fn arrows_arrive_as_sequences_in_either_form_and_in_parts() {
        use Key::{Comma, Digit, Down, Left, Other, Period, Quit, Right, Space, Up};
        assert_eq!(keys("\x1b[A\x1b[B\x1bOC\x1bOD"), [Up, Down, Right, Left]);
        assert_eq!(keys(" .,70q"), [Space, Period, Comma, Digit(7), Digit(0), Quit]);
        // F5 and Ctrl-Right hold digits that are no keys of their own.
        assert_eq!(keys("\x1b[15~\x1b[1;5Cx "), [Other, Other, Other, Space]);
        let mut part = b"\x1b[".to_vec();
        assert_eq!(Key::remove_first(&mut part), None);
        part.push(b'C');
        assert_eq!((Key::remove_first(&mut part), part), (Some(Right), Vec::new()));
    }

    #[test]
    fn keys_ask_for_what_the_help_text_says() {
        let mut control = Control::new(false, 1.0);
        assert_eq!(Key::Space.request(control), Some(Request::Pause));
        assert_eq!(Key::Period.request(control), Some(Request::Pause));
        assert_eq!(Key::Left.request(control), Some(Request::Seek(SeekTarget::By(-1_000_000_000))));
        assert_eq!(Key::Digit(4).request(control), Some(Request::Seek(SeekTarget::Percent(40))));
        control.set_paused(true);
        assert_eq!(Key::Space.request(control), Some(Request::Resume));
        assert_eq!(Key::Period.request(control), Some(Request::Step(1)));
        assert_eq!(Key::Comma.request(control), Some(Request::Seek(SeekTarget::Previous)));
    }

    #[test]
    fn rates_go_up_and_down_to_their_limits() {
        let rates = |key: Key, rate| {
            let mut control = Control::new(false, rate);
            std::iter::from_fn(|| match key.request(control)? {
                Request::Rate(rate) => {
                    control.rate = rate;
                    Some(rate)
                }
                _ => None,
            })
            .collect::<Vec<_>>()
        };
        assert_eq!(rates(Key::Up, 7.0), [10.0, 20.0, 50.0, 100.0]);
        assert_eq!(rates(Key::Down, 0.07), [0.05, 0.02, 0.01]);
    }
}
