//! Playback control of a recording: what clients ask for becomes commands to the source, and how it
//! is played is told to them.

use foxglove::websocket::{PlaybackCommand, PlaybackControlRequest, PlaybackState, PlaybackStatus};
use sim_contract::clock::SECOND_NS;

use crate::message::check::check;
use crate::message::{Command, Playback};

/// The times of a recording that is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Recording {
    /// When step 0 was, or would have been, in ns since 1970.
    pub epoch_ns: u64,
    /// Steps per second.
    pub rate_hz: u32,
    /// The first recorded step.
    pub first_step: u64,
    /// The last recorded step.
    pub last_step: u64,
}

/// Time from step 0 to a step, in ns.
pub(super) fn step_ns(step: u64, rate_hz: u32) -> u64 {
    let time_ns = u128::from(step) * u128::from(SECOND_NS) / u128::from(rate_hz.max(1));
    u64::try_from(time_ns).unwrap_or(u64::MAX)
}

impl Recording {
    /// The time of a step, in ns since 1970.
    fn time_ns(&self, step: u64) -> u64 {
        self.epoch_ns.saturating_add(step_ns(step, self.rate_hz))
    }

    /// First and last time, in ns since 1970.
    pub(super) fn range_ns(&self) -> (u64, u64) {
        (self.time_ns(self.first_step), self.time_ns(self.last_step))
    }

    /// The last step at or before a time, within the recording.
    fn step_at(&self, time_ns: u64) -> u64 {
        // The time of a step is rounded down to whole ns: its step is found a ns later.
        let passed_ns = u128::from(time_ns.saturating_sub(self.epoch_ns)) + 1;
        let step = (passed_ns * u128::from(self.rate_hz) - 1) / u128::from(SECOND_NS);
        let step = u64::try_from(step).unwrap_or(u64::MAX);
        step.clamp(self.first_step, self.last_step.max(self.first_step))
    }

    /// What a request means, in order, where it is played like that now.
    pub(super) fn commands(
        &self,
        request: &PlaybackControlRequest,
        now: Option<Playback>,
    ) -> Vec<Command> {
        let seek = request.seek_time.map(|time_ns| Command::Seek { step: self.step_at(time_ns) });
        let rate = request.playback_speed;
        let rate = (now.map(|now| now.rate) != Some(rate)).then_some(Command::Rate { value: rate });
        let is_playing = request.playback_command == PlaybackCommand::Play;
        let pace = if is_playing { Command::Resume {} } else { Command::Pause {} };
        let pace = (now.map(|now| now.is_playing) != Some(is_playing)).then_some(pace);
        // A speed that is none is left out; the state that follows tells the one that holds.
        [seek, rate, pace].into_iter().flatten().filter(|one| check(one).is_ok()).collect()
    }

    /// The answer to a request: what was asked for, until the source says how it is.
    pub(super) fn answer(
        &self,
        request: &PlaybackControlRequest,
        now: Option<Playback>,
    ) -> PlaybackState {
        let step = match (request.seek_time, now) {
            (Some(time_ns), _) => self.step_at(time_ns),
            (None, Some(now)) => now.step,
            (None, None) => self.first_step,
        };
        PlaybackState {
            status: match request.playback_command {
                PlaybackCommand::Play => PlaybackStatus::Playing,
                PlaybackCommand::Pause => PlaybackStatus::Paused,
            },
            current_time: self.time_ns(step),
            playback_speed: request.playback_speed,
            did_seek: request.seek_time.is_some(),
            request_id: Some(request.request_id.clone()),
        }
    }

    /// What clients are told of a change.
    pub(super) fn state(&self, before: Option<Playback>, now: Playback) -> PlaybackState {
        let manner = |one: Playback| (one.is_playing, one.rate, one.is_looping);
        PlaybackState {
            status: match now.is_playing {
                true => PlaybackStatus::Playing,
                false if now.step >= self.last_step => PlaybackStatus::Ended,
                false => PlaybackStatus::Paused,
            },
            current_time: self.time_ns(now.step),
            playback_speed: now.rate,
            // What changed is told, but not that time goes on: so it is the place.
            did_seek: before.map(manner) == Some(manner(now)),
            request_id: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RECORDING: Recording =
        Recording { epoch_ns: 5 * SECOND_NS, rate_hz: 240, first_step: 60, last_step: 600 };

    fn playback(step: u64) -> Playback {
        Playback { is_playing: false, rate: 1.0, is_looping: false, step, time_s: 0.0 }
    }

    fn request(command: PlaybackCommand, speed: f32, seek: Option<u64>) -> PlaybackControlRequest {
        PlaybackControlRequest {
            playback_command: command,
            playback_speed: speed,
            seek_time: seek,
            request_id: "7".to_owned(),
        }
    }

    #[test]
    fn every_step_is_found_at_its_time_and_until_the_next() {
        for rate_hz in [1, 7, 60, 240, 1000, 99_999] {
            let recording = Recording { rate_hz, first_step: 0, last_step: 100_000, ..RECORDING };
            for step in (0..1000).chain([99_999]) {
                let time_ns = recording.time_ns(step);
                assert_eq!(recording.step_at(time_ns), step, "{rate_hz} Hz");
                let next_ns = recording.time_ns(step + 1);
                assert_eq!(recording.step_at(next_ns - 1), step, "{rate_hz} Hz");
            }
        }
        assert_eq!(RECORDING.range_ns(), (5_250_000_000, 7_500_000_000));
        assert_eq!([0, u64::MAX].map(|time_ns| RECORDING.step_at(time_ns)), [60, 600]);
    }

    #[test]
    fn a_request_becomes_the_commands_for_what_it_changes() {
        let now = Some(playback(60));
        let ask = |request| RECORDING.commands(&request, now);
        assert_eq!(ask(request(PlaybackCommand::Pause, 1.0, None)), []);
        assert_eq!(ask(request(PlaybackCommand::Play, 1.0, None)), [Command::Resume {}]);
        let all = ask(request(PlaybackCommand::Play, 2.0, Some(6 * SECOND_NS)));
        let seek = Command::Seek { step: 240 };
        assert_eq!(all, [seek, Command::Rate { value: 2.0 }, Command::Resume {}]);
        for speed in [f32::NAN, f32::INFINITY, -1.0, 0.0, 11.0] {
            assert_eq!(ask(request(PlaybackCommand::Pause, speed, None)), [], "{speed}");
        }
        let unknown = RECORDING.commands(&request(PlaybackCommand::Pause, 1.0, None), None);
        assert_eq!(unknown, [Command::Rate { value: 1.0 }, Command::Pause {}]);
    }

    #[test]
    fn the_answer_is_what_was_asked_and_a_state_what_is() {
        let asked = request(PlaybackCommand::Play, 2.0, Some(6 * SECOND_NS));
        let answer = RECORDING.answer(&asked, None);
        assert_eq!((answer.status, answer.did_seek), (PlaybackStatus::Playing, true));
        assert_eq!((answer.current_time, answer.request_id), (6 * SECOND_NS, Some("7".to_owned())));
        let state = RECORDING.state(Some(playback(60)), playback(240));
        assert_eq!((state.status, state.did_seek), (PlaybackStatus::Paused, true));
        assert_eq!(state.current_time, 6 * SECOND_NS);
        let playing = Playback { is_playing: true, ..playback(240) };
        let state = RECORDING.state(Some(playback(240)), playing);
        assert_eq!((state.status, state.did_seek), (PlaybackStatus::Playing, false));
        let state = RECORDING.state(Some(playing), playback(600));
        assert_eq!((state.status, state.did_seek), (PlaybackStatus::Ended, false));
    }
}
