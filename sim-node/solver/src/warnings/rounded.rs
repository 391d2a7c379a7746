//! Numbers as warnings print them.

/// Rounds to three significant digits.
pub(super) fn three_digits(number: f64) -> f64 {
    format!("{number:.2e}").parse().unwrap_or(number)
}
