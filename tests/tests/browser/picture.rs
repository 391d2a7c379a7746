//! The picture: the cloth is drawn, particles are drawn where the node has them, and errors of the page
//! are detected.

use integration_tests::ctl;
use serde_json::json;

use crate::browser::support::{
    Area, Camera, Picture, Rig, distance, is_cloth, is_particle, is_pin,
};

/// A sheet that swings, because gravity is not parallel to it.
pub(crate) const SWINGING: &str = "
version = 1
gravity = [3, -9.81, 4]

[solver]
substeps = 8
damping = 0.1

[[generate]]
shape = \"cloth\"
columns = 9
rows = 8
spacing = 0.1
mass = 0.01
pinned = \"top\"
";

/// Unpinned particles of the swinging sheet.
pub(crate) const NAMED: [(&str, usize); 5] = [
    ("next to the upper left corner", 10),
    ("left edge", 36),
    ("middle", 40),
    ("lower left corner", 63),
    ("right of the lower edge's middle", 69),
];
/// Limit on the distance between the drawn and the expected position, in px.
pub(crate) const ERROR_MAX: f64 = 2.0;
/// Search radius for a drawn particle, in px: less than the distance between neighbours.
const REACH: f64 = 9.0;

/// Distance between the drawn and the expected position of each named particle, in px. Infinite if no
/// particle is drawn nearby.
pub(crate) fn errors(picture: &Picture, camera: &Camera, positions: &[[f32; 3]]) -> Vec<f64> {
    let error = |particle: usize| {
        let expected = camera.project(positions[particle]);
        let drawn = picture.middle_of(expected, REACH, is_particle);
        drawn.map_or(f64::INFINITY, |drawn| distance(drawn, expected))
    };
    NAMED.iter().map(|(_, particle)| error(*particle)).collect()
}

#[test]
#[ignore = "needs Chromium"]
fn the_cloth_is_drawn_by_webgl2() {
    let mut rig = Rig::new(&["curtain"], "");
    let version = rig.tab.evaluate(
        "(gl => gl.getParameter(gl.VERSION))(document.querySelector('#picture-canvas').getContext('webgl2'))",
    );
    assert!(version.as_str().unwrap().starts_with("WebGL 2.0"), "{version}");
    let renderer = rig.tab.evaluate("viewer.renderer");
    assert!(!renderer.as_str().unwrap().is_empty());
    println!("drawn by {renderer}");

    rig.pause();
    let (camera, picture) = (rig.tab.camera(), rig.tab.screenshot());
    let area = camera.area();
    let cloth = picture.count(&area, is_cloth) as f64;
    // The quadrangle between the corners of the curtain, from the positions of the node.
    let corners = [0, 13, 167, 154].map(|corner| rig.state().particles[corner].position);
    let expected = quadrangle(corners.map(|corner| camera.project(corner)));
    assert!((0.85..1.05).contains(&(cloth / expected)), "{cloth} px of cloth, not {expected}");
    assert!(cloth < 0.7 * area.width * area.height, "no background is visible");
    assert!(picture.count(&area, is_pin) > 14 * 10, "the pins are not marked");

    // Without the cloth: the count above was not of the background.
    let other = rig.another_tab("show.surface=0");
    assert!((other.screenshot().count(&area, is_cloth) as f64) < 0.02 * expected);
}

/// Area of a quadrangle.
fn quadrangle(corners: [[f64; 2]; 4]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let twice: f64 = corners.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum();
    twice.abs() / 2.0
}

#[test]
#[ignore = "needs Chromium"]
fn particles_are_drawn_where_the_node_has_them() {
    let mut rig = Rig::with_scene(SWINGING, &["--paused"], "show.particles=1");
    // The hint covers particles at the lower edge.
    rig.tab.evaluate("document.querySelector('#hint').remove()");
    let before = rig.step(40);
    let before = ShownStep::new(&mut rig, before.step);
    let after = rig.step(30);
    let after = ShownStep::new(&mut rig, after.step);

    for (at, error) in NAMED.iter().zip(errors(&before.picture, &before.camera, &before.positions))
    {
        assert!(error <= ERROR_MAX, "{at:?} is {error} px from its expected position");
    }
    for error in errors(&after.picture, &after.camera, &after.positions) {
        assert!(error <= ERROR_MAX, "{error} px");
    }
    // The check can fail: it does so against the state of another step.
    for (at, error) in NAMED.iter().zip(errors(&before.picture, &before.camera, &after.positions)) {
        assert!(error > ERROR_MAX, "{at:?} hardly moves, so a wrong step would go unnoticed");
    }
}

/// A state of the node with its picture.
struct ShownStep {
    positions: Vec<[f32; 3]>,
    picture: Picture,
    camera: Camera,
}

impl ShownStep {
    /// Waits until the page shows the state of the paused node.
    fn new(rig: &mut Rig, step: u64) -> Self {
        let state = rig.settled();
        assert_eq!(state.step, step);
        let (camera, picture) = (rig.tab.camera(), rig.tab.screenshot());
        let positions = state.particles.iter().map(|one| one.position).collect();
        Self { positions, picture, camera }
    }
}

#[test]
#[ignore = "needs Chromium"]
fn the_view_follows_a_figure_that_has_fallen_down() {
    let mut rig = Rig::new(&["ragdoll", "--paused"], "");
    let before = rig.tab.number("viewer.camera.distance");
    rig.tab.key(' ');
    rig.tab.wait(&format!("viewer.camera.distance < 0.85 * {before}"));
    // The glide takes less than a second.
    let step = rig.tab.number("viewer.step");
    rig.tab.wait(&format!("viewer.step > {step} + 90"));
    let state = rig.pause();
    let camera = rig.tab.camera();
    let area = camera.area();
    for particle in &state.particles {
        let [x, y] = camera.project(particle.position);
        let [x, y] = [(x - area.x) / area.width, (y - area.y) / area.height];
        assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y), "a joint is at {x}, {y}");
    }
}

#[test]
#[ignore = "needs Chromium"]
fn fit_view_ignores_what_has_fallen_away_and_a_reset_restores_the_first_view() {
    let mut rig = Rig::new(&["rope", "--paused"], "");
    let view = "JSON.stringify([viewer.camera.target, viewer.camera.distance].flat().map(one => one.toPrecision(4)))";
    let first = rig.tab.evaluate(view);
    // The lower half of the rope falls.
    ctl(&rig.sandbox, &["cut", "20"]);
    rig.step(480);
    let state = rig.settled();
    assert!(state.particles[40].position[1] < -10.0);
    rig.tab.key('f');
    rig.tab.pass_animation_frames(2);
    assert_ne!(rig.tab.evaluate(view), first);
    let camera = rig.tab.camera();
    let area = camera.area();
    let pixels: Vec<_> =
        state.particles[..21].iter().map(|one| camera.project(one.position)).collect();
    let extent = |axis: usize| {
        let all = pixels.iter().map(|pixel| pixel[axis]);
        (all.clone().fold(f64::MAX, f64::min), all.fold(f64::MIN, f64::max))
    };
    let [(left, right), (top, bottom)] = [0, 1].map(extent);
    assert!(left > area.x && right < area.x + area.width && top > area.y, "{pixels:?}");
    let filled = ((right - left) / area.width).max((bottom - top) / area.height);
    assert!((0.6..1.0).contains(&filled), "the rope fills {filled} of the picture");

    rig.tab.key('r');
    rig.tab.wait(&format!("viewer.step > {} && {view} === {first}", state.step));
}

/// A sheet on a ball that reaches half a millimetre through it, as balls do between particles that rest on them.
const ON_A_BALL: &str = "
version = 1

[[collider]]
shape = \"sphere\"
center = [0, 0.5005, 0]
radius = 0.5

[[generate]]
shape = \"cloth\"
columns = 5
rows = 5
spacing = 0.1
origin = [-0.2, 1, -0.2]
down = [0, 0, 1]
pinned = \"none\"
";

#[test]
#[ignore = "needs Chromium"]
fn a_ball_does_not_show_through_the_cloth_on_it() {
    let rig = Rig::with_scene(ON_A_BALL, &["--paused"], "camera=0,1,0,1.5,0.4,1.2");
    let area = Area::around(rig.tab.camera().project([0.0, 1.0, 0.0]), 6.0);
    let picture = rig.tab.drawn(area);
    assert_eq!(picture.count(&area, is_cloth), picture.count(&area, |_| true));
}

#[test]
#[ignore = "needs Chromium"]
fn errors_of_the_page_are_detected() {
    let rig = Rig::new(&["rope", "--paused"], "");
    assert_eq!(rig.tab.errors(), [""; 0]);
    // The content security policy forbids inline scripts.
    let inline = "document.head.append(Object.assign(document.createElement('script'), { text: 'window.broken = 1' }))";
    let causes: [(&str, &[&str]); 4] = [
        ("console.error('logged by the test')", &["logged by the test"]),
        ("setTimeout(() => { throw new Error('thrown by the test') })", &["thrown by the test"]),
        (inline, &["Content Security Policy", "ContentSecurityPolicyIssue"]),
        ("fetch('missing')", &["404"]),
    ];
    for (cause, traces) in causes {
        rig.tab.evaluate(&format!("void ({cause})"));
        for trace in traces {
            rig.tab.expect_error(trace);
        }
    }
    assert_eq!(rig.tab.evaluate("window.broken ?? null"), json!(null));
}
