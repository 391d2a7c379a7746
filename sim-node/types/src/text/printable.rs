//! Text from a file, a service or another process, made safe for a terminal.

use std::borrow::Cow;
use std::fmt::Write;

/// Replaces the characters that control a terminal or reorder a line with their code, such as
/// `\u001b`, which JSON and TOML read back. Keeps line breaks and tabs.
///
/// Programs pass all output through this function or [`printable_line`], because names, texts and
/// errors may quote a file that somebody else wrote.
pub fn printable(text: &str) -> Cow<'_, str> {
    escape(text, |letter| letter != '\n' && is_unsafe(letter))
}

/// Like [`printable`], but replaces line breaks too: a text from a file cannot add a line to a report.
pub fn printable_line(text: &str) -> Cow<'_, str> {
    escape(text, is_unsafe)
}

fn escape(text: &str, is_escaped: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&is_escaped) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::with_capacity(text.len() + 16);
    for letter in text.chars() {
        match letter {
            '\n' if is_escaped('\n') => escaped.push_str("\\n"),
            letter if is_escaped(letter) => {
                // A string accepts every write.
                let _written = write!(escaped, "\\u{:04x}", u32::from(letter));
            }
            letter => escaped.push(letter),
        }
    }
    Cow::Owned(escaped)
}

/// Returns `true` for control characters (C0, DEL and C1), for separators of lines and paragraphs, and
/// for characters that change the direction of text.
fn is_unsafe(letter: char) -> bool {
    let is_direction = matches!(letter,
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let is_separator = matches!(letter, '\u{2028}' | '\u{2029}');
    letter != '\t' && (letter.is_control() || is_direction || is_separator)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_text_is_unchanged_and_not_copied() {
        let text = "curtain: 2,5 m/s² — größer\tals 日本\n";
        assert!(matches!(printable(text), Cow::Borrowed(same) if same == text));
    }

    #[test]
    fn each_unsafe_character_becomes_its_code() {
        for (letter, code) in [
            ('\u{1b}', "\\u001b"),
            ('\u{7}', "\\u0007"),
            ('\r', "\\u000d"),
            ('\0', "\\u0000"),
            ('\u{7f}', "\\u007f"),
            ('\u{9b}', "\\u009b"),
            ('\u{202e}', "\\u202e"),
            ('\u{2066}', "\\u2066"),
            ('\u{200f}', "\\u200f"),
            ('\u{2028}', "\\u2028"),
        ] {
            assert_eq!(printable(&format!("a{letter}[2Jb")), format!("a{code}[2Jb"));
        }
    }

    #[test]
    fn no_escaped_text_has_an_unsafe_character_left() {
        let all: String = (0..=0x3000).filter_map(char::from_u32).collect();
        assert!(!printable_line(&all).contains(is_unsafe));
        assert_eq!(printable(&all).matches('\n').count(), 1);
    }

    #[test]
    fn a_line_break_stays_in_text_and_is_replaced_in_a_line() {
        assert_eq!(printable("a\nb"), "a\nb");
        assert_eq!(printable_line("a\nb"), "a\\nb");
    }

    #[test]
    fn json_reads_the_codes_back() {
        let text = "a\u{9b}b\u{202e}c\u{7f}";
        let json = serde_json::to_string(text).unwrap();
        assert_eq!(serde_json::from_str::<String>(&printable_line(&json)).unwrap(), text);
    }
}
