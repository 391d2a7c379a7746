//! Pages carry colliders and anchors: each step moves them by an equal part of the way.

use integration_tests::{Process, Program, Sandbox};
use serde_json::json;

use super::page::{Bridge, Page};
use crate::wire_decoder::Message;

/// A ball that rises, and a particle on an anchor, at rest 1 m above the origin.
const SCENE: &str = "
version = 1
[solver]
rate_hz = 100
[[particle]]
position = [0, 1, 0]
[[particle]]
position = [0, 0.5, 0]
[[constraint]]
particles = [0, 1]
[[anchor]]
particles = [0]
[[collider]]
shape = 'sphere'
center = [3, 0, 0]
radius = 0.5
velocity = [0, 1, 0]
";

/// The ball's center and the anchored particle after a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Places {
    ball: [f32; 3],
    anchored: [f32; 3],
}

/// A page of a paused node.
struct Stage {
    page: Page,
    step: u64,
    ball: [f32; 3],
}

impl Stage {
    /// Pauses the node, and makes a step.
    fn new(bridge: &Bridge) -> Self {
        let mut page = bridge.page();
        page.applied(json!({ "kind": "pause" }));
        let mut stage = Self { page, step: 0, ball: [0.0; 3] };
        stage.skip_step();
        stage
    }

    /// Makes a step and ignores its frame.
    fn skip_step(&mut self) {
        self.step = self.page.applied(json!({ "kind": "step", "count": 1 }));
    }

    /// Makes a step, and returns what the page sees of it. The bridge has sent the moves for the next step before.
    fn make_step(&mut self) -> Places {
        self.page.send(&json!({ "kind": "step", "count": 1 }));
        self.step += 1;
        let (step, ball) = (self.step, &mut self.ball);
        self.page.receive("the step", |message| match message {
            Message::Colliders(all) => {
                *ball = all.colliders[0].center;
                None
            }
            Message::Frame(frame) if frame.head.stamp.step == step => {
                Some(Places { ball: *ball, anchored: frame.positions[0] })
            }
            _ => None,
        })
    }
}

fn near(a: [f32; 3], b: [f32; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5)
}

fn along_x([x, y, z]: [f32; 3], distance: f32) -> [f32; 3] {
    [x + distance, y, z]
}

#[test]
fn a_page_carries_a_ball_and_an_anchor_in_equal_parts_and_throws_them() {
    let sandbox = Sandbox::new();
    let scene = sandbox.write("stage.toml", SCENE);
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", &scene]);
    let bridge = Bridge::start(&sandbox);
    let mut stage = Stage::new(&bridge);
    assert_eq!(bridge.page().scene().text.anchors, [vec![0]]);

    let begin = stage.make_step();
    let epoch = bridge.page().scene().stamp.epoch;
    let lift = |kind: &str| json!({ "kind": "lift", "epoch": epoch, "object": kind, "index": 0 });
    let carry = |kind: &str| json!({ "kind": "carry", "object": kind, "index": 0, "offset": [0.4, 0, 0], "over_s": 0.04 });
    assert_eq!(stage.page.rejected(carry("collider")), "not_grabbed");
    for message in [lift("collider"), lift("anchor"), carry("collider"), carry("anchor")] {
        let answer = stage.page.command(message);
        assert_eq!(answer["status"], "applied", "{answer}");
    }
    for part in 1..=4_u8 {
        let (places, distance) = (stage.make_step(), 0.1 * f32::from(part));
        assert!(near(places.ball, along_x(begin.ball, distance)), "{places:?} of {begin:?}");
        assert!(near(places.anchored, along_x(begin.anchored, distance)), "{places:?}");
    }
    let there = stage.make_step();
    assert!(near(there.ball, along_x(begin.ball, 0.4)), "it waits: {there:?}");

    let mut other = bridge.page();
    assert_eq!(other.rejected(lift("collider")), "grabbed_by_other");
    let throw = |kind: &str, x: f64| json!({ "kind": "throw", "object": kind, "index": 0, "velocity": [x, 0, 0] });
    assert_eq!(other.rejected(throw("collider", 1.0)), "not_grabbed");
    stage.page.send(&throw("anchor", 0.0));
    assert_eq!(stage.page.command(throw("collider", 3.0))["status"], "applied");
    let flown = stage.make_step();
    let way = flown.ball[0] - there.ball[0];
    assert!((0.028..0.03).contains(&way), "{way} m in 10 ms at 3 m/s, slowing down");
    assert!(near(flown.anchored, there.anchored), "an anchor put down stays: {flown:?}");

    // A reset puts everything back, and ends the throw.
    stage.page.applied(json!({ "kind": "reset" }));
    stage.skip_step();
    let back = stage.make_step();
    let next = stage.make_step();
    assert!(near(next.ball, [3.0, back.ball[1] + 0.01, 0.0]), "{back:?} {next:?}");
    assert!(near(next.anchored, [0.0, 1.0, 0.0]), "{next:?}");
    // A target that was on its way then moves nothing.
    assert_eq!(stage.page.rejected(carry("anchor")), "not_grabbed");
    for (kind, index, reason) in
        [("collider", 1, "unknown_collider"), ("anchor", 1, "unknown_anchor")]
    {
        let message = json!({ "kind": "lift", "epoch": epoch, "object": kind, "index": index });
        assert_eq!(stage.page.rejected(message), reason);
    }
    let message = json!({ "kind": "lift", "epoch": epoch + 1, "object": "anchor", "index": 0 });
    assert_eq!(stage.page.rejected(message), "stale_epoch");
}

#[test]
fn a_carried_object_is_a_change_of_others_to_a_page_that_undoes() {
    let sandbox = Sandbox::new();
    let scene = sandbox.write("stage.toml", SCENE);
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", &scene]);
    let bridge = Bridge::start(&sandbox);
    let (mut page, mut other) = (bridge.page(), bridge.page());
    let epoch = page.scene().stamp.epoch;
    page.frame(|_| true);
    page.applied(json!({ "kind": "cut_constraints", "epoch": epoch, "constraints": [0] }));
    let lift = json!({ "kind": "lift", "epoch": epoch, "object": "collider", "index": 0 });
    assert_eq!(other.command(lift)["status"], "applied");
    assert_eq!(page.rejected(json!({ "kind": "undo" })), "changed_by_others");
}
