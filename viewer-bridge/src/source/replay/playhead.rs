//! The place in a recording. It advances with the clock while the recording plays.

use sim_host::clock::SECOND_NS;

/// The place in a recording and its progress. All times are `CLOCK_MONOTONIC` in ns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Playhead {
    first_step: u64,
    last_step: u64,
    rate_hz: u32,
    /// The place advances.
    pub(super) is_playing: bool,
    /// The place returns to the first step of the loop after the last one.
    pub(super) is_looping: bool,
    /// First and last step of the loop.
    looped: [u64; 2],
    /// Simulated seconds per second.
    pub(super) rate: f32,
    /// Place at `base_ns`, in steps.
    base_step: f64,
    base_ns: u64,
}

/// Effect of the clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Advanced {
    /// The recording plays on, or is paused.
    Within,
    /// The recording has reached its end. It pauses there, or starts again.
    ToEnd,
}

impl Playhead {
    /// Starts at the first step, paused.
    pub(super) fn new(first_step: u64, last_step: u64, rate_hz: u32) -> Self {
        Self {
            first_step,
            last_step,
            rate_hz,
            is_playing: false,
            is_looping: false,
            looped: [first_step, last_step],
            rate: 1.0,
            base_step: first_step as f64,
            base_ns: 0,
        }
    }

    /// The step at this time. It may lie between two recorded steps.
    pub(super) fn step(&self, now_ns: u64) -> u64 {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "the place is positive, and its step is rounded down"
        )]
        let step = self.place(now_ns) as u64;
        step.clamp(self.first_step, self.last_step)
    }

    fn place(&self, now_ns: u64) -> f64 {
        if !self.is_playing {
            return self.base_step;
        }
        let elapsed_s = now_ns.saturating_sub(self.base_ns) as f64 / SECOND_NS as f64;
        self.base_step + elapsed_s * f64::from(self.rate) * f64::from(self.rate_hz)
    }

    /// Advances to this time.
    pub(super) fn advance(&mut self, now_ns: u64) -> Advanced {
        let place = self.place(now_ns);
        let [first_step, last_step] = self.looped;
        if !self.is_playing || place < last_step as f64 {
            return Advanced::Within;
        }
        if !self.is_looping {
            self.is_playing = false;
            self.base_step = self.last_step as f64;
            return Advanced::ToEnd;
        }
        // The last step is on show for as long as any other.
        let period = (last_step - first_step + 1) as f64;
        let elapsed = place - first_step as f64;
        if elapsed < period {
            return Advanced::Within;
        }
        self.base_step = first_step as f64 + elapsed % period;
        self.base_ns = now_ns;
        Advanced::ToEnd
    }

    /// First and last step of the loop; `None` if it is the whole recording, or off.
    pub(super) fn loop_steps(&self) -> Option<[u64; 2]> {
        Some(self.looped).filter(|looped| *looped != [self.first_step, self.last_step])
    }

    /// Plays the steps of a range again and again; the whole recording without a range. A place outside
    /// moves to its first step. Returns false, and changes nothing, if the range has no step.
    pub(super) fn loop_between(
        &mut self,
        first_step: Option<u64>,
        last_step: Option<u64>,
        now_ns: u64,
    ) -> bool {
        let first_step = first_step.unwrap_or(0).max(self.first_step);
        let last_step = last_step.unwrap_or(u64::MAX).min(self.last_step);
        if first_step > last_step {
            return false;
        }
        (self.is_looping, self.looped) = (true, [first_step, last_step]);
        if !(first_step..=last_step).contains(&self.step(now_ns)) {
            self.go_to(first_step, now_ns);
        }
        true
    }

    /// Plays to the end of the recording, and pauses there.
    pub(super) fn stop_looping(&mut self, now_ns: u64) {
        self.advance(now_ns);
        self.go_to(self.step(now_ns), now_ns);
        (self.is_looping, self.looped) = (false, [self.first_step, self.last_step]);
    }

    /// Pauses at the present place.
    pub(super) fn pause(&mut self, now_ns: u64) {
        self.advance(now_ns);
        self.go_to(self.step(now_ns), now_ns);
        self.is_playing = false;
    }

    /// Plays on; at the end, from the beginning.
    pub(super) fn resume(&mut self, now_ns: u64) {
        if self.is_playing {
            return;
        }
        if self.base_step >= self.looped[1] as f64 {
            self.base_step = self.looped[0] as f64;
        }
        self.base_ns = now_ns;
        self.is_playing = true;
    }

    /// Moves to a step. While a loop plays, a step after it is its first.
    pub(super) fn go_to(&mut self, step: u64, now_ns: u64) {
        let [first_step, last_step] = self.looped;
        let is_beyond = self.is_playing && self.is_looping && step > last_step;
        let step = if is_beyond { first_step } else { step };
        self.base_step = step as f64;
        self.base_ns = now_ns;
    }

    /// Changes the pace.
    pub(super) fn set_rate(&mut self, rate: f32, now_ns: u64) {
        (self.base_step, self.base_ns) = (self.place(now_ns), now_ns);
        self.rate = rate;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One step every 10 ms.
    fn playhead() -> Playhead {
        Playhead::new(50, 150, 100)
    }

    fn ms(count: u64) -> u64 {
        count * SECOND_NS / 1000
    }

    #[test]
    fn the_place_advances_with_the_clock_while_playing() {
        let mut head = playhead();
        assert_eq!(head.step(ms(500)), 50);
        head.resume(ms(1000));
        assert_eq!((head.step(ms(1105)), head.advance(ms(1105))), (60, Advanced::Within));
        head.pause(ms(1105));
        assert_eq!(head.step(ms(9000)), 60);
        head.resume(ms(9000));
        assert_eq!(head.step(ms(9095)), 69);
    }

    #[test]
    fn a_change_of_pace_keeps_the_place() {
        let mut head = playhead();
        head.resume(0);
        head.set_rate(0.1, ms(200));
        assert_eq!(head.step(ms(200)), 70);
        assert_eq!(head.step(ms(1250)), 80);
        head.set_rate(10.0, ms(1250));
        assert_eq!(head.step(ms(1261)), 91);
    }

    #[test]
    fn playback_pauses_at_the_end_and_resumes_from_the_beginning() {
        let mut head = playhead();
        head.resume(0);
        assert_eq!(head.advance(ms(999)), Advanced::Within);
        assert_eq!(head.advance(ms(3000)), Advanced::ToEnd);
        assert_eq!((head.step(ms(3000)), head.is_playing), (150, false));
        head.resume(ms(4000));
        assert_eq!((head.step(ms(4015)), head.is_playing), (51, true));
    }

    #[test]
    fn a_loop_shows_every_step_for_the_same_time() {
        let mut head = playhead();
        assert!(head.loop_between(None, None, 0));
        head.resume(0);
        assert_eq!((head.advance(ms(1005)), head.step(ms(1005))), (Advanced::Within, 150));
        assert_eq!((head.advance(ms(1015)), head.step(ms(1015))), (Advanced::ToEnd, 50));
        // Several rounds pass without a call.
        assert_eq!(
            (head.advance(ms(1015 + 3 * 1010 + 20)), head.is_playing),
            (Advanced::ToEnd, true)
        );
        assert_eq!(head.step(ms(1015 + 3 * 1010 + 20)), 52);
    }

    #[test]
    fn a_loop_between_two_steps_stays_between_them() {
        let mut head = playhead();
        head.go_to(120, 0);
        assert!(head.loop_between(Some(60), Some(69), 0));
        assert_eq!((head.step(0), head.loop_steps()), (60, Some([60, 69])));
        head.resume(0);
        assert_eq!((head.advance(ms(95)), head.step(ms(95))), (Advanced::Within, 69));
        assert_eq!((head.advance(ms(325)), head.step(ms(325))), (Advanced::ToEnd, 62));
        // A seek beyond the loop returns to its first step.
        head.go_to(143, ms(330));
        assert_eq!((head.advance(ms(330)), head.step(ms(330))), (Advanced::Within, 60));
        // A pause stays within it, however late it comes.
        head.pause(ms(330 + 135));
        assert_eq!(head.step(ms(500)), 63);
        head.resume(ms(500));
        assert!(!head.loop_between(Some(70), Some(69), ms(330)));
        assert!(!head.loop_between(Some(151), None, ms(330)));
        head.stop_looping(ms(505));
        assert_eq!((head.loop_steps(), head.is_looping), (None, false));
        assert_eq!((head.advance(ms(2000)), head.step(ms(2000))), (Advanced::ToEnd, 150));
        assert!(head.loop_between(Some(150), Some(9999), ms(2000)));
        head.resume(ms(2000));
        assert_eq!((head.advance(ms(2099)), head.step(ms(2099))), (Advanced::ToEnd, 150));
        // The whole recording is no range.
        assert!(head.loop_between(Some(0), Some(9999), ms(2100)) && head.loop_steps().is_none());
    }

    #[test]
    fn a_recording_of_one_step_stays_paused() {
        let mut head = Playhead::new(7, 7, 60);
        head.resume(0);
        assert_eq!(
            (head.advance(ms(1)), head.step(ms(1)), head.is_playing),
            (Advanced::ToEnd, 7, false)
        );
    }
}
