//! What is seen: that the cloth is drawn, that particles are where the node has them, and that the
//! page's errors do not stay unseen.

use serde_json::json;

use crate::support::{Camera, Picture, Stage, distance, is_cloth, is_particle, is_pin};

/// A sheet that swings, because gravity is not along it.
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

/// Particles of the swinging sheet, none of them pinned.
pub(crate) const NAMED: [(&str, usize); 5] = [
    ("next to the upper left corner", 10),
    ("left edge", 36),
    ("middle", 40),
    ("lower left corner", 63),
    ("right of the lower edge's middle", 69),
];
/// How far the picture may be from where a particle is, px.
pub(crate) const ERROR_MAX: f64 = 2.0;
/// Where the picture of a particle is looked for, px: less than to the next one.
const REACH: f64 = 9.0;

/// How far the picture of each named particle is from where it should be, px: infinite where there
/// is none.
pub(crate) fn errors(picture: &Picture, camera: &Camera, positions: &[[f32; 3]]) -> Vec<f64> {
    let error = |particle: usize| {
        let expected = camera.project(positions[particle]);
        let seen = picture.middle_of(expected, REACH, is_particle);
        seen.map_or(f64::INFINITY, |seen| distance(seen, expected))
    };
    NAMED.iter().map(|(_, particle)| error(*particle)).collect()
}

#[test]
#[ignore = "needs Chromium"]
fn the_cloth_is_drawn_by_webgl2() {
    let mut stage = Stage::new(&["curtain"], "");
    let version = stage.tab.ask(
        "(gl => gl.getParameter(gl.VERSION))(document.querySelector('#picture-canvas').getContext('webgl2'))",
    );
    assert!(version.as_str().unwrap().starts_with("WebGL 2.0"), "{version}");
    let renderer = stage.tab.ask("viewer.renderer");
    assert!(!renderer.as_str().unwrap().is_empty());
    println!("drawn by {renderer}");

    stage.pause();
    let (camera, picture) = (stage.tab.camera(), stage.tab.screenshot());
    let area = camera.area();
    let cloth = picture.count(&area, is_cloth) as f64;
    // The quadrangle between the curtain's corners, by the node's positions.
    let corners = [0, 13, 167, 154].map(|corner| stage.state().particles[corner].position);
    let expected = quadrangle(corners.map(|corner| camera.project(corner)));
    assert!((0.85..1.05).contains(&(cloth / expected)), "{cloth} px of cloth, not {expected}");
    assert!(cloth < 0.7 * area.width * area.height, "no background is left");
    assert!(picture.count(&area, is_pin) > 14 * 10, "the pins are not marked");

    // The same without the cloth: it was not the background that was counted.
    let other = stage.another_tab("show.surface=0");
    assert!((other.screenshot().count(&area, is_cloth) as f64) < 0.02 * expected);
}

/// The area of a quadrangle.
fn quadrangle(corners: [[f64; 2]; 4]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let twice: f64 = corners.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum();
    twice.abs() / 2.0
}

#[test]
#[ignore = "needs Chromium"]
fn particles_are_seen_where_the_node_has_them() {
    let mut stage = Stage::with_scene(SWINGING, &["--paused"], "show.particles=1");
    let before = stage.step(40);
    let before = State::shown(&mut stage, before.step);
    let after = stage.step(30);
    let after = State::shown(&mut stage, after.step);

    for (at, error) in NAMED.iter().zip(errors(&before.picture, &before.camera, &before.positions))
    {
        assert!(error <= ERROR_MAX, "{at:?} is {error} px from where it should be");
    }
    for error in errors(&after.picture, &after.camera, &after.positions) {
        assert!(error <= ERROR_MAX, "{error} px");
    }
    // The check itself can fail: against the node's state of another step, it does.
    for (at, error) in NAMED.iter().zip(errors(&before.picture, &before.camera, &after.positions)) {
        assert!(error > ERROR_MAX, "{at:?} hardly moves: nothing would be seen of a wrong step");
    }
}

/// A state of the node with its picture.
struct State {
    positions: Vec<[f32; 3]>,
    picture: Picture,
    camera: Camera,
}

impl State {
    /// The state of the paused node, when the page shows it.
    fn shown(stage: &mut Stage, step: u64) -> Self {
        let state = stage.settled();
        assert_eq!(state.step, step);
        let (camera, picture) = (stage.tab.camera(), stage.tab.screenshot());
        let positions = state.particles.iter().map(|one| one.position).collect();
        Self { positions, picture, camera }
    }
}

#[test]
#[ignore = "needs Chromium"]
fn errors_of_the_page_do_not_stay_unseen() {
    let stage = Stage::new(&["rope", "--paused"], "");
    assert_eq!(stage.tab.errors(), [""; 0]);
    // The policy allows scripts of files only.
    let inline = "document.head.append(Object.assign(document.createElement('script'), { text: 'window.broken = 1' }))";
    let causes: [(&str, &[&str]); 4] = [
        ("console.error('said by the test')", &["said by the test"]),
        ("setTimeout(() => { throw new Error('thrown by the test') })", &["thrown by the test"]),
        (inline, &["Content Security Policy", "ContentSecurityPolicyIssue"]),
        ("fetch('missing')", &["404"]),
    ];
    for (cause, traces) in causes {
        stage.tab.ask(&format!("void ({cause})"));
        for trace in traces {
            stage.tab.expect_error(trace);
        }
    }
    assert_eq!(stage.tab.ask("window.broken ?? null"), json!(null));
}
