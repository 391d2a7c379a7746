//! Effects: shadows, the weave, and solid ropes, limbs, planks and poles. They are off on the software
//! renderer of these tests, and turned on by the address. Each test compares a page with effects and one
//! without, of the same paused state.

use crate::browser::support::{Area, Camera, Picture, Rig, Tab, is_cloth};

/// A sheet over a part of another one, and a floor under both.
const SHEETS: &str = "
version = 1

[[collider]]
shape = \"plane\"
normal = [0, 1, 0]
offset = 0

[[generate]]
shape = \"cloth\"
columns = 9
rows = 9
spacing = 0.1
origin = [-0.4, 1.3, -0.4]
down = [0, 0, 1]
pinned = \"corners\"

[[generate]]
shape = \"cloth\"
columns = 21
rows = 21
spacing = 0.1
origin = [-1, 0.8, -1]
down = [0, 0, 1]
pinned = \"corners\"
";
/// Motion of a shadow in x and z per unit of height, from the direction of the light.
const SHADOW: [f32; 2] = [0.5 / 0.8, -0.62 / 0.8];

/// A page with effects and one without, of the same paused state.
struct Pair {
    rig: Rig,
    plain: Tab,
}

impl Pair {
    /// Shows a paused scene, a built-in one by its name or the text of another one.
    fn new(scene: &str) -> Self {
        let fragment = "show.effects=1&show.pins=0&show.particles=0";
        let rig = if scene.contains('\n') {
            Rig::with_scene(scene, &["--paused"], fragment)
        } else {
            Rig::new(&[scene, "--paused"], fragment)
        };
        let plain = rig.another_tab("show.pins=0&show.particles=0");
        Self { rig, plain }
    }

    fn camera(&self) -> Camera {
        self.rig.tab.camera()
    }

    /// Returns an area of the pictures with and without effects.
    fn drawn(&self, area: Area) -> [Picture; 2] {
        [self.rig.tab.drawn(area), self.plain.drawn(area)]
    }

    /// Returns the mean brightness around a point of the scene, with and without effects.
    fn brightness(&self, at: [f32; 3]) -> [f64; 2] {
        let area = Area::around(self.camera().project(at), 3.0);
        self.drawn(area).map(|picture| mean(&picture.brightness()))
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard deviation.
fn deviation(values: &[f64]) -> f64 {
    let middle = mean(values);
    let squares: Vec<_> = values.iter().map(|value| (value - middle).powi(2)).collect();
    mean(&squares).sqrt()
}

#[test]
#[ignore = "needs Chromium"]
fn software_renderers_draw_no_effects_unless_the_user_turns_them_on() {
    let rig = Rig::new(&["curtain", "--paused"], "");
    assert_eq!(rig.tab.evaluate("viewer.toggles.effects"), false);
    let plain = rig.tab.hash();
    rig.tab.key('x');
    rig.tab.wait("viewer.toggles.effects");
    assert_ne!(rig.tab.hash(), plain);
    rig.tab.key('x');
    rig.tab.wait("!viewer.toggles.effects");
    // A phone has no keys, but the panel.
    rig.tab.evaluate("document.querySelector('#effects').click()");
    rig.tab.wait("viewer.toggles.effects && document.querySelector('#effects').checked");
    rig.tab.key('x');
    rig.tab.wait("!viewer.toggles.effects && !document.querySelector('#effects').checked");
    assert_eq!(rig.tab.hash(), plain);
}

#[test]
#[ignore = "needs Chromium"]
fn a_sheet_casts_a_shadow_on_another_one_and_a_soft_one_on_the_ground() {
    let pair = Pair::new(SHEETS);
    // Left of the upper sheet as the picture shows it, on the lower one.
    let [x, z] = SHADOW.map(|per_height| per_height * 0.5);
    let (shaded, lit) = ([x + 0.25, 0.8, z + 0.1], [-0.8, 0.8, 0.8]);
    let [with, without] = pair.brightness(shaded);
    assert!(with < 0.8 * without, "{with} in the shadow, {without} without effects");
    let [with, without] = pair.brightness(lit);
    assert!(with > 0.85 * without, "{with} in the light, {without} without effects");

    // Across the border of the shadow of the lower sheet on the ground.
    let [x, z] = SHADOW.map(|per_height| per_height * 0.8);
    let camera = pair.camera();
    let border = camera.project([x + 1.0, 0.0, z + 0.3]);
    let area = Area { x: border[0] - 15.0, y: border[1] - 0.5, width: 30.0, height: 1.0 };
    let [with, without] = pair.drawn(area).map(|picture| picture.brightness());
    let between = |values: &[f64]| {
        let (least, most) = values.iter().fold((f64::MAX, f64::MIN), |(least, most), value| {
            (least.min(*value), most.max(*value))
        });
        assert!(most - least > 20.0, "no border: {values:?}");
        let range = least + 0.2 * (most - least)..least + 0.8 * (most - least);
        values.iter().filter(|value| range.contains(value)).count()
    };
    assert!(between(&with) >= between(&without) + 2, "hard: {with:?}, without: {without:?}");
}

#[test]
#[ignore = "needs Chromium"]
fn the_weave_shows_on_the_cloth_and_not_in_the_colours_of_the_strain() {
    let pair = Pair::new("curtain");
    let area = Area::around(pair.camera().project([0.1, 0.6, 0.0]), 25.0);
    let [with, without] = pair.drawn(area).map(|picture| {
        assert!(picture.count(&area, is_cloth) > 2000);
        deviation(&picture.brightness())
    });
    assert!(with > 2.0 * without + 1.0, "{with} with threads, {without} without");
    for tab in [&pair.rig.tab, &pair.plain] {
        tab.key('h');
        tab.wait("viewer.toggles.heat");
    }
    let [with, without] = pair.drawn(area).map(|picture| deviation(&picture.brightness()));
    assert!(with < without + 1.0, "{with} with threads, {without} without");
}

#[test]
#[ignore = "needs Chromium"]
fn a_bridge_has_planks_in_place_of_cloth() {
    let pair = Pair::new("rope-bridge");
    let area = pair.camera().area();
    let is_wood = |[red, green, blue]: [u8; 3]| {
        let [red, green, blue] = [red, green, blue].map(i32::from);
        red > green + 12 && green > blue + 12 && red < 2 * green
    };
    let counts = pair
        .drawn(area)
        .map(|picture| [picture.count(&area, is_wood), picture.count(&area, is_cloth)]);
    let [[wood, cloth], [plain_wood, plain_cloth]] = counts;
    assert!(wood > 500 && cloth == 0, "{wood} px of wood, {cloth} px of cloth");
    assert!(plain_wood < 20 && plain_cloth > 500, "{plain_wood} px, {plain_cloth} px");
}

#[test]
#[ignore = "needs Chromium"]
fn a_flag_has_a_pole_where_its_pins_are_and_a_curtain_none() {
    let differs = |pair: &Pair, at: [f32; 3]| {
        let [with, without] = pair.brightness(at);
        (with - without).abs() > 12.0
    };
    let flag = Pair::new("flag");
    for height in [2.05, 0.9] {
        assert!(differs(&flag, [0.0, height, 0.0]), "no pole at {height}");
        assert!(!differs(&flag, [-0.2, height, 0.0]), "a pole beside the pins");
    }
    drop(flag);
    let curtain = Pair::new("curtain");
    for x in [-0.65, 0.0, 0.65] {
        assert!(!differs(&curtain, [x, 1.15, 0.0]), "a pole at {x}");
    }
}

#[test]
#[ignore = "needs Chromium"]
fn ropes_and_limbs_have_thickness() {
    for (scene, at) in [("rope", [1.0, 2.0, 0.0]), ("ragdoll", [0.0, 1.7, 0.0])] {
        let pair = Pair::new(scene);
        let [x, y] = pair.camera().project(at);
        let area = Area { x: x - 20.0, y: y - 30.0, width: 40.0, height: 60.0 };
        let thickness = pair.drawn(area).map(|picture| {
            // Darker than the sky and the ground.
            picture.brightness().iter().filter(|value| **value < 180.0).count()
        });
        let [with, without] = thickness;
        assert!(without > 20 && 10 * with > 13 * without, "{scene}: {with} px, {without} px");
    }
}
