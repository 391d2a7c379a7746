//! The line on a terminal that shows the place in a replay.

use sim_contract::clock::SECOND_NS;

use super::control::Control;
use crate::cli::output;

/// The content of the line.
#[derive(Debug)]
pub(super) struct Shown {
    /// Time of the last published snapshot, from the start of the replay.
    pub(super) time_ns: u64,
    pub(super) duration_ns: u64,
    pub(super) step: u64,
    pub(super) control: Control,
}

/// Shows the line in the place of the last one.
pub(super) fn show(shown: &Shown) {
    output::show_live(text(shown));
}

fn text(shown: &Shown) -> String {
    let seconds = |ns: u64| ns as f64 / SECOND_NS as f64;
    let Shown { time_ns, duration_ns, step, control } = shown;
    let (time, duration) = (seconds(*time_ns), seconds(*duration_ns));
    let paused = if control.is_paused { ", paused" } else { "" };
    let rate = if control.rate.is_finite() { control.rate.to_string() } else { "max".to_owned() };
    format!("{time:.2} s of {duration:.2} s, step {step}, rate {rate}{paused}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_has_the_time_the_step_and_the_rate() {
        let mut control = Control::new(false, 0.25);
        let line = |control| {
            let (time_ns, duration_ns) = (1_500_000_000, 10 * SECOND_NS);
            text(&Shown { time_ns, duration_ns, step: 360, control })
        };
        assert_eq!(line(control), "1.50 s of 10.00 s, step 360, rate 0.25");
        control.rate = f64::INFINITY;
        assert_eq!(line(control), "1.50 s of 10.00 s, step 360, rate max");
        control.rate = 0.25;
        control.set_paused(true);
        assert_eq!(line(control), "1.50 s of 10.00 s, step 360, rate 0.25, paused");
    }
}
