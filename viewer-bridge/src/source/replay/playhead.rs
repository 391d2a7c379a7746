//! Where a replay is: it goes on with the clock while it plays.

use sim_contract::clock::SECOND_NS;

/// Where a replay is, and how it goes on. All times are CLOCK_MONOTONIC in ns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Playhead {
    first_step: u64,
    last_step: u64,
    rate_hz: u32,
    /// Whether it goes on.
    pub(super) is_playing: bool,
    /// Whether it begins again at its end.
    pub(super) is_looping: bool,
    /// Simulated time per time.
    pub(super) rate: f32,
    /// Where it was at a moment, in steps.
    base_step: f64,
    base_ns: u64,
}

/// What the clock has done to a replay.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Passed {
    /// It goes on, or stands.
    Time,
    /// It has come to its end, and stands there or begins again.
    End,
}

impl Playhead {
    /// At the first step, standing.
    pub(super) fn new(first_step: u64, last_step: u64, rate_hz: u32) -> Self {
        Self {
            first_step,
            last_step,
            rate_hz,
            is_playing: false,
            is_looping: false,
            rate: 1.0,
            base_step: first_step as f64,
            base_ns: 0,
        }
    }

    /// The step that is due. It may lie between two recorded ones.
    pub(super) fn step(&self, now_ns: u64) -> u64 {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "positive, and rounded down on purpose"
        )]
        let step = self.place(now_ns) as u64;
        step.clamp(self.first_step, self.last_step)
    }

    fn place(&self, now_ns: u64) -> f64 {
        if !self.is_playing {
            return self.base_step;
        }
        let passed_s = now_ns.saturating_sub(self.base_ns) as f64 / SECOND_NS as f64;
        self.base_step + passed_s * f64::from(self.rate) * f64::from(self.rate_hz)
    }

    /// Looks at the clock.
    pub(super) fn advance(&mut self, now_ns: u64) -> Passed {
        let place = self.place(now_ns);
        if !self.is_playing || place < self.last_step as f64 {
            return Passed::Time;
        }
        if !self.is_looping {
            self.is_playing = false;
            self.base_step = self.last_step as f64;
            return Passed::End;
        }
        // The last step is shown as long as any other.
        let period = (self.last_step - self.first_step + 1) as f64;
        let passed = place - self.first_step as f64;
        if passed < period {
            return Passed::Time;
        }
        self.base_step = self.first_step as f64 + passed % period;
        self.base_ns = now_ns;
        Passed::End
    }

    /// Stands where it is.
    pub(super) fn pause(&mut self, now_ns: u64) {
        self.go_to(self.step(now_ns), now_ns);
        self.is_playing = false;
    }

    /// Goes on; at the end, from the beginning.
    pub(super) fn resume(&mut self, now_ns: u64) {
        if self.is_playing {
            return;
        }
        if self.base_step >= self.last_step as f64 {
            self.base_step = self.first_step as f64;
        }
        self.base_ns = now_ns;
        self.is_playing = true;
    }

    /// Goes on, or stands, from another step.
    pub(super) fn go_to(&mut self, step: u64, now_ns: u64) {
        self.base_step = step as f64;
        self.base_ns = now_ns;
    }

    /// Goes on at another pace.
    pub(super) fn set_rate(&mut self, rate: f32, now_ns: u64) {
        (self.base_step, self.base_ns) = (self.place(now_ns), now_ns);
        self.rate = rate;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100 Hz: a step each 10 ms.
    fn playhead() -> Playhead {
        Playhead::new(50, 150, 100)
    }

    fn ms(count: u64) -> u64 {
        count * SECOND_NS / 1000
    }

    #[test]
    fn it_goes_with_the_clock_while_it_plays() {
        let mut head = playhead();
        assert_eq!(head.step(ms(500)), 50);
        head.resume(ms(1000));
        assert_eq!((head.step(ms(1105)), head.advance(ms(1105))), (60, Passed::Time));
        head.pause(ms(1105));
        assert_eq!(head.step(ms(9000)), 60);
        head.resume(ms(9000));
        assert_eq!(head.step(ms(9095)), 69);
    }

    #[test]
    fn another_pace_begins_where_the_one_before_was() {
        let mut head = playhead();
        head.resume(0);
        head.set_rate(0.1, ms(200));
        assert_eq!(head.step(ms(200)), 70);
        assert_eq!(head.step(ms(1250)), 80);
        head.set_rate(10.0, ms(1250));
        assert_eq!(head.step(ms(1261)), 91);
    }

    #[test]
    fn it_stands_at_its_end_and_then_plays_from_the_beginning() {
        let mut head = playhead();
        head.resume(0);
        assert_eq!(head.advance(ms(999)), Passed::Time);
        assert_eq!(head.advance(ms(3000)), Passed::End);
        assert_eq!((head.step(ms(3000)), head.is_playing), (150, false));
        head.resume(ms(4000));
        assert_eq!((head.step(ms(4015)), head.is_playing), (51, true));
    }

    #[test]
    fn a_loop_shows_every_step_for_as_long() {
        let mut head = playhead();
        head.is_looping = true;
        head.resume(0);
        assert_eq!((head.advance(ms(1005)), head.step(ms(1005))), (Passed::Time, 150));
        assert_eq!((head.advance(ms(1015)), head.step(ms(1015))), (Passed::End, 50));
        // Nobody looked for several rounds.
        assert_eq!((head.advance(ms(1015 + 3 * 1010 + 20)), head.is_playing), (Passed::End, true));
        assert_eq!(head.step(ms(1015 + 3 * 1010 + 20)), 52);
    }

    #[test]
    fn a_recording_of_one_step_stands() {
        let mut head = Playhead::new(7, 7, 60);
        head.resume(0);
        assert_eq!(
            (head.advance(ms(1)), head.step(ms(1)), head.is_playing),
            (Passed::End, 7, false)
        );
    }
}
