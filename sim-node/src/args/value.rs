//! Parsers of values, with errors that name the allowed ones.

use std::ops::RangeInclusive;
use std::time::Duration;

use bytesize::ByteSize;
use sim_contract::NumberRange;

/// Parser of whole numbers in a range.
pub(super) fn whole<T: TryFrom<u64>>(
    range: RangeInclusive<u64>,
) -> impl Fn(&str) -> Result<T, String> + Clone {
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        let number = number.and_then(|number| T::try_from(number).ok());
        let (min, max) = (range.start(), range.end());
        number.ok_or_else(|| match *max {
            u64::MAX => format!("it must be a whole number from {min}"),
            max => format!("it must be a whole number from {min} to {max}"),
        })
    }
}

/// Parses the index of a particle, constraint, anchor or collider.
pub(super) fn index(text: &str) -> Result<u32, String> {
    text.parse().map_err(|_| "it must be an index: a whole number from 0".to_owned())
}

/// Parses a number. The node judges numbers that are not finite.
pub(super) fn number(text: &str) -> Result<f32, String> {
    text.parse().map_err(|_| "it must be a number".to_owned())
}

/// Parser of finite numbers in a range.
pub(super) fn number_in(
    range: RangeInclusive<f32>,
) -> impl Fn(&str) -> Result<f32, String> + Clone {
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        let (min, max) = (range.start(), range.end());
        number.ok_or_else(|| format!("it must be a number from {min} to {max:?}"))
    }
}

/// Parser of times up to a limit in seconds: a number of seconds, or a time with its unit.
pub(super) fn seconds_up_to(max_s: f32) -> impl Fn(&str) -> Result<f32, String> + Clone {
    move |text| {
        let with_unit = || humantime::parse_duration(text).ok().map(|time| time.as_secs_f32());
        let seconds = text.parse().ok().or_else(with_unit);
        seconds.filter(|seconds| (0.0..=max_s).contains(seconds)).ok_or_else(|| {
            format!("it must be a number of seconds from 0 to {max_s}, or a time such as 100ms")
        })
    }
}

/// Parser of numbers in a range that has a text of its own.
pub(super) fn number_within(range: NumberRange) -> impl Fn(&str) -> Result<f32, String> + Clone {
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(*number));
        number.ok_or_else(|| format!("it is not a number in range (allowed: {})", range.text))
    }
}

/// Parses a time with its unit.
pub(super) fn time(text: &str) -> Result<Duration, String> {
    humantime::parse_duration(text)
        .map_err(|_| "it must be a time with its unit, such as 500ms, 10s or 2min".to_owned())
}

/// Parses a size with its unit. Without one, it is in bytes.
pub(super) fn size(text: &str) -> Result<ByteSize, String> {
    text.parse().map_err(|_| "it must be a size with its unit, such as 64MiB, 2GiB or 0".to_owned())
}

/// Parser of times in a range.
pub(super) fn time_in(
    range: RangeInclusive<Duration>,
) -> impl Fn(&str) -> Result<Duration, String> + Clone {
    move |text| {
        let parsed = time(text)?;
        let text = |time: &Duration| humantime::format_duration(*time).to_string();
        let (min, max) = (text(range.start()), text(range.end()));
        let inside = range.contains(&parsed).then_some(parsed);
        inside.ok_or_else(|| format!("it must be a time from {min} to {max}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_outside_their_range_are_refused_with_the_range() {
        let threads = whole::<u8>(1..=64);
        assert_eq!(threads("64"), Ok(64));
        for text in ["0", "65", "300", "-1", "two", ""] {
            assert_eq!(threads(text).unwrap_err(), "it must be a whole number from 1 to 64");
        }
        let compliance = number_in(0.0..=1e20);
        assert_eq!(compliance("1e-3"), Ok(1e-3));
        for text in ["-1", "1e21", "nan", "soft"] {
            assert_eq!(compliance(text).unwrap_err(), "it must be a number from 0 to 1e20");
        }
        let density = number_within(NumberRange::POSITIVE);
        assert_eq!(density("0.2"), Ok(0.2));
        for text in ["0", "-1", "inf", "heavy"] {
            let expected = "it is not a number in range (allowed: a number > 0)";
            assert_eq!(density(text).unwrap_err(), expected);
        }
        let period = time_in(Duration::from_millis(100)..=Duration::from_hours(1));
        assert_eq!(period("250ms"), Ok(Duration::from_millis(250)));
        for text in ["99ms", "0s", "61min", "1year"] {
            assert_eq!(period(text).unwrap_err(), "it must be a time from 100ms to 1h");
        }
        assert!(period("-1s").unwrap_err().contains("such as 500ms"));
        assert!(time("10").unwrap_err().contains("such as 500ms"));
        assert_eq!(size("64MiB"), Ok(ByteSize::mib(64)));
        assert_eq!(size("0"), Ok(ByteSize::b(0)));
        for text in ["", "-1", "much", "64 MiBs", "1e400"] {
            assert!(size(text).unwrap_err().contains("such as 64MiB"), "{text}");
        }
    }
}
