//! Parsers of option values. Their errors state what is expected.

use std::ops::RangeInclusive;
use std::time::Duration;

use bytesize::ByteSize;

/// Parses a whole number from 0.
pub(crate) fn whole_number(text: &str) -> Result<u64, String> {
    whole_number_in(text, &(0..=u64::MAX))
}

/// Parses a whole number in a range.
pub(crate) fn whole_number_in(text: &str, range: &RangeInclusive<u64>) -> Result<u64, String> {
    let number = text.parse().ok().filter(|number| range.contains(number));
    number.ok_or_else(|| match *range.end() {
        u64::MAX => format!("it must be a whole number from {}", range.start()),
        max => format!("it must be a whole number from {} to {max}", range.start()),
    })
}

/// Parses a duration such as `2s` or `500ms`.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    humantime::parse_duration(text)
        .map_err(|_| "it must be a time with its unit, such as 2s or 500ms".to_owned())
}

/// Parses a size in bytes, such as `100MB` or `2GiB`.
pub(crate) fn size_bytes(text: &str) -> Result<u64, String> {
    let size = text.parse::<ByteSize>();
    size.map(|size| size.as_u64())
        .map_err(|_| "it must be a size with its unit, such as 100MB or 2GiB".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_has_a_decimal_or_a_binary_unit() {
        assert_eq!((size_bytes("100MB"), size_bytes("2GiB")), (Ok(100_000_000), Ok(2 << 30)));
        assert_eq!(size_bytes("4096"), Ok(4096));
        for text in ["-1", "much", ""] {
            let error = size_bytes(text).unwrap_err();
            assert_eq!(error, "it must be a size with its unit, such as 100MB or 2GiB");
        }
    }

    #[test]
    fn errors_state_the_expected_value() {
        assert_eq!(whole_number("7"), Ok(7));
        for text in ["-1", "1.5", "", "many", "99999999999999999999"] {
            assert_eq!(whole_number(text).unwrap_err(), "it must be a whole number from 0");
        }
        let error = whole_number_in("65", &(1..=64)).unwrap_err();
        assert_eq!(error, "it must be a whole number from 1 to 64");
        assert_eq!(duration("500ms"), Ok(Duration::from_millis(500)));
        for text in ["-5s", "5", "soon"] {
            let error = duration(text).unwrap_err();
            assert_eq!(error, "it must be a time with its unit, such as 2s or 500ms");
        }
    }
}
