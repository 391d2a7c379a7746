//! The keys of a replay.

use sim_contract::clock::SECOND_NS;

use super::control::{Control, Request, Target};

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
            Self::Comma => Request::Seek(Target::Previous),
            Self::Right => Request::Seek(Target::By(SECOND)),
            Self::Left => Request::Seek(Target::By(-SECOND)),
            Self::Up => Request::Rate(RATES.into_iter().find(|rate| *rate > control.rate)?),
            Self::Down => Request::Rate(RATES.into_iter().rfind(|rate| *rate < control.rate)?),
            Self::Digit(digit) => Request::Seek(Target::Percent(digit * 10)),
            Self::Quit | Self::Other => return None,
        })
    }
}

/// Returns the length of the rest of an escape sequence: parameters and a final byte (ECMA-48).
fn sequence_length(rest: &[u8]) -> Option<usize> {
    rest.iter().position(|byte| (0x40..=0x7e).contains(byte)).map(|end| end + 1)
}

#[cfg(test)]
mod tests {
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
        assert_eq!(Key::Left.request(control), Some(Request::Seek(Target::By(-1_000_000_000))));
        assert_eq!(Key::Digit(4).request(control), Some(Request::Seek(Target::Percent(40))));
        control.set_paused(true);
        assert_eq!(Key::Space.request(control), Some(Request::Resume));
        assert_eq!(Key::Period.request(control), Some(Request::Step(1)));
        assert_eq!(Key::Comma.request(control), Some(Request::Seek(Target::Previous)));
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
