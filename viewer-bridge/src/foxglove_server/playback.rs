//! Playback control of a recording: requests of clients become commands to the source, and changes of
//! the playback become messages to the clients.

use foxglove::websocket::{PlaybackCommand, PlaybackControlRequest, PlaybackState, PlaybackStatus};

use sim_contract::{Action, Parameter};

use crate::limits::REPLAY_RATES;
use crate::message::{CommandKind, Playback};
use crate::source::recording_times::RecordingTimes;

/// Translates a request into commands, in order. Leaves out what is so already.
pub(super) fn commands(
    times: &RecordingTimes,
    request: &PlaybackControlRequest,
    now: Option<Playback>,
) -> Vec<CommandKind> {
    let seek = request.seek_time.map(|time_ns| CommandKind::Seek { step: times.step_at(time_ns) });
    let rate = request.playback_speed;
    // A speed out of range is ignored; the next state shows the real one.
    let is_new = now.map(|now| now.rate) != Some(rate) && REPLAY_RATES.contains(&rate);
    let rate = is_new.then(|| Action::set(Parameter::TimeScale.name(), rate).into());
    let is_playing = request.playback_command == PlaybackCommand::Play;
    let pace = if is_playing { Action::Resume } else { Action::Pause };
    let pace = (now.map(|now| now.is_playing) != Some(is_playing)).then(|| pace.into());
    [seek, rate, pace].into_iter().flatten().collect()
}

/// Answers a request with the requested state. The source's state follows.
pub(super) fn requested_state(
    times: &RecordingTimes,
    request: &PlaybackControlRequest,
    now: Option<Playback>,
) -> PlaybackState {
    let step = match (request.seek_time, now) {
        (Some(time_ns), _) => times.step_at(time_ns),
        (None, Some(now)) => now.step,
        (None, None) => times.first_step,
    };
    PlaybackState {
        status: match request.playback_command {
            PlaybackCommand::Play => PlaybackStatus::Playing,
            PlaybackCommand::Pause => PlaybackStatus::Paused,
        },
        current_time: times.time_ns(step),
        playback_speed: request.playback_speed,
        did_seek: request.seek_time.is_some(),
        request_id: Some(request.request_id.clone()),
    }
}

/// Describes a change of the playback.
pub(super) fn present_state(
    times: &RecordingTimes,
    before: Option<Playback>,
    now: Playback,
) -> PlaybackState {
    let is_same_mode = |before: Playback| {
        (before.is_playing, before.rate, before.is_looping)
            == (now.is_playing, now.rate, now.is_looping)
    };
    PlaybackState {
        status: match now.is_playing {
            true => PlaybackStatus::Playing,
            false if now.step >= times.last_step => PlaybackStatus::Ended,
            false => PlaybackStatus::Paused,
        },
        current_time: times.time_ns(now.step),
        playback_speed: now.rate,
        // The source does not report the passing of time, so without another change it was a seek.
        did_seek: before.is_some_and(is_same_mode),
        request_id: None,
    }
}

#[cfg(test)]
mod tests {
    use sim_host::clock::SECOND_NS;

    use super::*;

    const TIMES: RecordingTimes =
        RecordingTimes { epoch_ns: 5 * SECOND_NS, rate_hz: 240, first_step: 60, last_step: 600 };

    fn playback(step: u64) -> Playback {
        Playback { rate: 1.0, step, ..Playback::default() }
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
    fn a_request_becomes_commands_for_its_changes_only() {
        let now = Some(playback(60));
        let ask = |request| commands(&TIMES, &request, now);
        assert_eq!(ask(request(PlaybackCommand::Pause, 1.0, None)), []);
        assert_eq!(ask(request(PlaybackCommand::Play, 1.0, None)), [Action::Resume.into()]);
        let all = ask(request(PlaybackCommand::Play, 2.0, Some(6 * SECOND_NS)));
        let rate = |value: f32| CommandKind::from(Action::set("time_scale", value));
        assert_eq!(all, [CommandKind::Seek { step: 240 }, rate(2.0), Action::Resume.into()]);
        for speed in [f32::NAN, f32::INFINITY, -1.0, 0.0, 11.0] {
            assert_eq!(ask(request(PlaybackCommand::Pause, speed, None)), [], "{speed}");
        }
        let unknown = commands(&TIMES, &request(PlaybackCommand::Pause, 1.0, None), None);
        assert_eq!(unknown, [rate(1.0), Action::Pause.into()]);
    }

    #[test]
    fn an_answer_has_the_requested_state_and_a_state_the_present_one() {
        let asked = request(PlaybackCommand::Play, 2.0, Some(6 * SECOND_NS));
        let answer = requested_state(&TIMES, &asked, None);
        assert_eq!((answer.status, answer.did_seek), (PlaybackStatus::Playing, true));
        assert_eq!((answer.current_time, answer.request_id), (6 * SECOND_NS, Some("7".to_owned())));
        let state = present_state(&TIMES, Some(playback(60)), playback(240));
        assert_eq!((state.status, state.did_seek), (PlaybackStatus::Paused, true));
        assert_eq!(state.current_time, 6 * SECOND_NS);
        let playing = Playback { is_playing: true, ..playback(240) };
        let state = present_state(&TIMES, Some(playback(240)), playing);
        assert_eq!((state.status, state.did_seek), (PlaybackStatus::Playing, false));
        let state = present_state(&TIMES, Some(playing), playback(600));
        assert_eq!((state.status, state.did_seek), (PlaybackStatus::Ended, false));
    }
}
