//! The texts of both directions.

use serde_json::{Value, json};
use sim_contract::{Parameter, ParameterValues, Reason};
use viewer_bridge::message::{
    Choice, FromPage, GhostState, GhostText, Hashes, HistoryText, Level, Mark, MarkKind, Mode,
    Node, NodeState, OutcomeText, PageLimits, ParametersText, Playback, RecordingState,
    RecordingText, Refusal, Status, Timeline, ToPage, Undoable, Welcome,
};
use viewer_bridge::scene::catalog::Catalog;
use viewer_bridge::scene::summary::ColliderSurface;

use super::check;

fn to_page() -> Vec<ToPage> {
    let outcome = OutcomeText {
        id: Some(7),
        kind: "cut_constraints",
        status: Status::Applied,
        step: Some(1234),
        applied: 3,
        rejected: 1,
        reason: Some(Reason::AlreadyTorn.into()),
        text: "the constraint is already torn".to_owned(),
        state_step: None,
    };
    let parameters = ParameterValues::default().with(Parameter::TearForce, 20.0);
    vec![
        ToPage::Hello(Box::new(Welcome {
            protocol: 3,
            version: "0.1.0",
            client: 3,
            mode: Mode::Live,
            format: Choice::Auto,
            scenes: Catalog::default().entries().to_vec(),
            recordings: vec!["run 2".to_owned(), "run".to_owned()],
            limits: PageLimits::default(),
        })),
        ToPage::Node(Node { text: "no node runs".to_owned(), ..Node::default() }),
        ToPage::Node(Node {
            state: NodeState::Alive,
            text: String::new(),
            run_id: Some("0123456789abcdef".to_owned()),
            scene: Some("curtain".to_owned()),
            method: Some("xpbd"),
            rate_hz: 240,
            is_paused: false,
            is_replay: false,
            time_scale: 1.0,
            process_id: Some(4711),
        }),
        ToPage::Parameters(Box::new(ParametersText {
            is_complete: true,
            values: Some(parameters),
            initial: Some(ParameterValues::default()),
            initial_colliders: vec![ColliderSurface { friction: 0.5, restitution: 0.25 }],
        })),
        ToPage::Outcome(outcome.clone()),
        ToPage::Outcome(OutcomeText {
            id: None,
            status: Status::Unanswered,
            step: None,
            applied: 0,
            rejected: 0,
            reason: Some(Refusal::NoAnswer),
            text: "the node did not answer; the command may still take effect".to_owned(),
            ..outcome
        }),
        ToPage::Reset { step: 1300 },
        ToPage::Clients { count: 2 },
        ToPage::Notice { level: Level::Warning, text: "look".to_owned() },
        ToPage::History(HistoryText {
            first_step: Some(1200),
            marks: vec![Mark { kind: MarkKind::Tear, step: 1234, count: 3, commands: Vec::new() }],
            text: String::new(),
        }),
        ToPage::Undoable { what: Some(Undoable::Cut) },
        ToPage::Undoable { what: None },
    ]
}

fn to_page_of_a_recording() -> [ToPage; 2] {
    let idle = RecordingText { state: RecordingState::Idle, ..RecordingText::default() };
    let finished = RecordingText {
        state: RecordingState::Finished,
        text: "the recording ended because another scene was loaded".to_owned(),
        name: Some("curtain_2026-11-25T09-12-03Z".to_owned()),
        path: Some("/home/ada/recordings/curtain_2026-11-25T09-12-03Z.mcap".to_owned()),
        seconds: 12.25,
        snapshots: 2937,
        size_bytes: 8_123_456,
        lost: [("/particles".to_owned(), 3), ("/steps".to_owned(), 3)].into(),
    };
    [idle, finished].map(ToPage::Recording)
}

fn to_page_of_a_replay() -> Vec<ToPage> {
    vec![
        ToPage::Timeline(Box::new(Timeline {
            file: "run.mcap".to_owned(),
            scene: "curtain".to_owned(),
            rate_hz: 240,
            first_step: 0,
            last_step: 2400,
            first_time_s: 0.0,
            last_time_s: 10.0,
            marks: vec![
                Mark { kind: MarkKind::Tear, step: 60, count: 3, commands: Vec::new() },
                Mark { kind: MarkKind::Pin, step: 60, count: 1, commands: vec!["pin".to_owned()] },
                Mark {
                    kind: MarkKind::Command,
                    step: 60,
                    count: 4,
                    commands: vec!["cut_radius".to_owned(), "mark: slips".to_owned()],
                },
                Mark { kind: MarkKind::Late, step: 300, count: 2, commands: Vec::new() },
            ],
            hashes: Hashes::Checking,
            hash_text: "checking hashes".to_owned(),
            incomplete: "truncated after byte 4096; shown up to step 2400. \
                `recorder repair run.mcap OUT.mcap` copies what is intact"
                .to_owned(),
        })),
        ToPage::Playback(Playback {
            is_playing: true,
            rate: 1.0,
            is_looping: true,
            loop_steps: Some([240, 480]),
            step: 240,
            time_s: 1.0,
        }),
        ToPage::Ghost(GhostText {
            state: GhostState::Different,
            name: Some("changed".to_owned()),
            given: Some("changed".to_owned()),
            text: "changed differs from step 60 (0.250 s): particle 3, velocity y".to_owned(),
            first_different_step: Some(60),
        }),
    ]
}

/// One message of each kind that a page may send.
const FROM_PAGE: [&str; 45] = [
    r#"{"type":"hello","protocol":3,"token":"00","format":"u16","parts":true}"#,
    r#"{"type":"hello","protocol":3}"#,
    r#"{"type":"ack","frame":77}"#,
    r#"{"type":"forces","is_on":true}"#,
    r#"{"type":"speeds","is_on":true}"#,
    r#"{"type":"inspect","particles":[0,7]}"#,
    r#"{"kind":"grab","particle":90,"target":[0.5,0.2,0.3],"over_s":0.05,"id":1}"#,
    r#"{"kind":"move","particle":90,"target":[0.5,0.4,0.3]}"#,
    r#"{"kind":"release","particle":90}"#,
    r#"{"kind":"brush","eye":[0,0,5],"ray":[0,0,-1],"radius":0.2,"delta":[0.01,0,0],"over_s":0.016,"cap":0.05,"stroke":6}"#,
    r#"{"kind":"push","center":[0,1,0],"radius":0.3,"delta":[0,0,0.02],"limit":0.05}"#,
    r#"{"kind":"pin","particle":3}"#,
    r#"{"kind":"unpin","particle":3}"#,
    r#"{"kind":"cut_constraints","epoch":3,"constraints":[1,2,3],"stroke":5,"id":2}"#,
    r#"{"kind":"cut_segment","from":[-1,0,0],"to":[1,0,0],"direction":[0,0,1]}"#,
    r#"{"kind":"cut_radius","center":[0,0,0],"radius":0.1}"#,
    r#"{"kind":"move_collider","collider":0,"translation":[0.5,0,0],"rotation":[0,0.6,0,0.8]}"#,
    r#"{"kind":"move_anchor","anchor":0,"translation":[0,0.3,0]}"#,
    r#"{"kind":"lift","epoch":3,"object":"anchor","index":0}"#,
    r#"{"kind":"carry","object":"anchor","index":0,"offset":[0.1,0,0],"over_s":0.02}"#,
    r#"{"kind":"throw","object":"collider","index":1,"velocity":[2,0,0]}"#,
    r#"{"kind":"pause"}"#,
    r#"{"kind":"resume"}"#,
    r#"{"kind":"step","count":10}"#,
    r#"{"kind":"step_back","count":10}"#,
    r#"{"kind":"cut","constraint":7}"#,
    r#"{"kind":"mark","text":"slips"}"#,
    r#"{"kind":"reset"}"#,
    r#"{"kind":"load","scene":"rope"}"#,
    r#"{"kind":"set","parameter":"gravity","value":[0,-1.62,0]}"#,
    r#"{"kind":"set","parameter":"tear_force","value":null,"stroke":4}"#,
    r#"{"kind":"set","parameter":"compliance","value":0.0001,"constraint_kind":"shear"}"#,
    r#"{"kind":"look","step":1200,"toward":"after"}"#,
    r#"{"kind":"rewind","to_step":1200}"#,
    r#"{"kind":"undo"}"#,
    r#"{"kind":"undo","takes_others":true,"id":3}"#,
    r#"{"kind":"record","id":4}"#,
    r#"{"kind":"stop_recording"}"#,
    r#"{"kind":"seek","step":1200}"#,
    r#"{"kind":"ghost","name":"changed"}"#,
    r#"{"kind":"ghost"}"#,
    r#"{"kind":"set","parameter":"time_scale","value":0.5}"#,
    r#"{"kind":"loop","is_on":true}"#,
    r#"{"kind":"loop","is_on":true,"first_step":240,"last_step":480}"#,
    r#"{"kind":"drive_body","collider":0,"translation":[0.5,0,0],"velocity":[0,-1,0],"force":[0,0,2]}"#,
];

#[test]
fn the_texts_are_frozen() {
    for text in FROM_PAGE {
        FromPage::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"));
    }
    let parse = |text: &str| serde_json::from_str::<Value>(text).unwrap();
    let to_page: Vec<_> = to_page()
        .into_iter()
        .chain(to_page_of_a_recording())
        .chain(to_page_of_a_replay())
        .map(|message| parse(&message.to_json()))
        .collect();
    let from_page: Vec<_> = FROM_PAGE.iter().map(|text| parse(text)).collect();
    check("texts.json", &json!({ "to_page": to_page, "from_page": from_page }));
}
