//! Scenes: counts of the built-in scenes and of shapes, the round trip through TOML, and the ranges of
//! parameters.

use sim_scene::scene::SceneCounts;
use sim_scene::{Scene, SceneError, builtin};
use sim_types::{OffMeaning, PARAMETERS, Parameter, Parts, ValueForm};

fn builtin_scene(name: &str) -> Scene {
    Scene::from_toml(builtin::text(name).unwrap(), name).unwrap()
}

#[test]
fn the_curtain_has_168_particles_596_sticks_and_14_pins() {
    let counts = builtin_scene("curtain").counts();
    let expected = SceneCounts {
        particles: 168,
        constraints: 596,
        bends: 0,
        pins: 14,
        triangles: 286,
        colliders: 1,
        anchors: 0,
    };
    assert_eq!(counts, expected);
}

#[test]
fn the_number_of_bends_has_a_closed_form() {
    let count = |keys: &str| {
        let text = format!("version = 1\n[[generate]]\n{keys}\n");
        Scene::from_toml(&text, "test").unwrap().counts().bends
    };
    for (columns, rows) in [(1, 1), (1, 5), (2, 2), (3, 2), (9, 7)] {
        let cloth = format!("shape = \"cloth\"\ncolumns = {columns}\nrows = {rows}\nspacing = 1\n");
        let lines = columns * rows.max(2) - 2 * columns + rows * columns.max(2) - 2 * rows;
        let cells = (columns - 1) * (rows - 1);
        assert_eq!(count(&format!("{cloth}bending = 1")), lines + cells);
        assert_eq!(count(&format!("{cloth}bending = [1, 2]")), lines);
        assert_eq!(count(&format!("{cloth}bending = [1, 2]\ntwist = true")), lines + cells);
        assert_eq!(count(&format!("{cloth}bending = 1\ntwist = false")), lines);
    }
    for (particles, bends) in [(2, 0), (3, 1), (40, 38)] {
        let rope =
            format!("shape = \"rope\"\ncount = {particles}\nfrom = [0, 0, 0]\nto = [1, 0, 0]");
        assert_eq!([count(&rope), count(&format!("{rope}\nbending = 1"))], [0, bends]);
    }
}

#[test]
fn the_number_of_links_of_a_cloth_has_a_closed_form() {
    let text = "version = 1\n[[generate]]\nshape = \"cloth\"\ncolumns = 14\nrows = 12\nspacing = 1\nlinks = [\"bend\", \"structural\", \"shear\"]\n";
    let both = Scene::from_toml(text, "test").unwrap().counts();
    assert_eq!(both.constraints, 310 + 286 + 284);
    let one = Scene::from_toml(&format!("{text}diagonals = 1\n"), "test").unwrap().counts();
    assert_eq!(one.constraints, 310 + 143 + 284);
}

#[test]
fn a_table_can_be_appended_to_the_complete_text_of_every_builtin_scene() {
    let particle = "[[particle]]\nposition = [0, 0, 0]\npinned = true\n";
    let tables = [
        particle.to_owned(),
        format!("{particle}{particle}[[constraint]]\nparticles = [0, 1]\nrest_length = 1\n"),
        "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = -100\n".to_owned(),
        "[[generate]]\nshape = \"rope\"\ncount = 2\nfrom = [0, 0, 0]\nto = [1, 0, 0]\n".to_owned(),
        format!("{particle}[[anchor]]\nparticles = [0]\n"),
    ];
    for name in builtin::names() {
        let text = builtin_scene(name).to_toml();
        for table in &tables {
            let appended = Scene::from_toml(&format!("{text}{table}"), name);
            // Particles of the first anchor of such a scene have one already.
            let problem = appended.err().map(|error| error.list()).unwrap_or_default();
            assert!(problem.is_empty() || problem.contains("anchor"), "{name}: {problem}\n{table}");
        }
    }
}

#[test]
fn every_builtin_scene_survives_the_round_trip_through_its_complete_text() {
    for name in builtin::names() {
        let scene = builtin_scene(name);
        let text = scene.to_toml();
        let again = Scene::from_toml(&text, "other").unwrap();
        assert_eq!(again, scene, "{text}");
        assert_eq!(again.to_toml(), text);
    }
}

/// Every key of a scene, each with another value than its default.
pub(crate) const EVERY_KEY: &str = r#"
        version = 1
        name = "all of it"
        origin = [1e9, -2.5, 0.1]
        dimensions = 3
        up = "-y"
        unit = "px"
        gravity = [0.1, 981, -0.0]
        [solver]
        rate_hz = 1000
        substeps = 3
        iterations = 5
        method = "pbd"
        order = "listed"
        damping = 0.7
        max_speed = 1e4
        relaxation = 1.3
        tethers = 3
        max_stretch = 1.1
        tear_stretch = 1.25
        tear_distance = 0
        tear_force = 1e3
        [wind]
        velocity = [3, 0, 0.1]
        drag = 0.3
        gust = 0.5
        gust_period = 2
        [[collider]]
        shape = "plane"
        normal = [0, 2, 0.1]
        offset = -0.3
        restitution = 0.3
        friction = 0.5
        velocity = [0, 0.1, 0]
        [[collider]]
        shape = "box"
        center = [0, 1, 2]
        half_extents = [0.1, 0.2, 0.3]
        rotation = [0, 0, 0.5, 0.5]
        angular_velocity = [0, 1, 0]
        [[collider]]
        shape = "sphere"
        center = [0, 1, 2]
        radius = 0.1
        [[collider]]
        shape = "capsule"
        a = [0, 1, 2]
        b = [0, 1, 3]
        radius = 0.1
        [[collider]]
        shape = "bounds"
        min = [-9, -9, -9]
        max = [9, 9, 9]
        [[anchor]]
        particles = [3, 0]
        origin = [0, 1, 0]
        repeat = true
        path = [{ time = 0 }, { time = 0.3, translation = [0, 0.1, 0], rotation = [0, 0, 0.1, 1] }]
        [[particle]]
        position = [0.1, 0.2, 0.3]
        mass = 0.3
        velocity = [1, 2, 3]
        [[particle]]
        position = [1, 0, 0]
        pinned = true
        [[constraint]]
        particles = [0, 2]
        kind = "tether"
        stiffness = 0.25
        rest_length = 0
        max_stretch = 1.3
        tear_stretch = inf
        tear_distance = 0.2
        tear_force = 12.5
        [[collider]]
        shape = "mesh"
        center = [9, 0, 0]
        distance = 0.01
        vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
        faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
        solid = true
        [[generate]]
        shape = "rope"
        count = 5
        from = [0, 0, 0]
        to = [1, 1, 1]
        mass = 0.1
        stiffness = { structural = 0.9, bend = 0.3 }
        pinned = [1, 3]
        tear_stretch = 1.7
        [[generate]]
        shape = "cloth"
        columns = 3
        rows = 2
        spacing = 0.1
        origin = [0.5, 0.5, 0.5]
        right = [0, 0, 1]
        down = [0, 1, 0]
        links = ["bend"]
        diagonals = 1
        pinned = "corners"
        bending = [0.1, 0.25]
        twist = true

        [[generate]]
        shape = "rope"
        count = 3
        from = [2, 0, 0]
        to = [3, 0, 0]
        bending = 0.3

        [[generate]]
        shape = "obj"
        vertices = [[3, 0, 0], [3, 1, 0], [4, 0, 0], [4, 1, 0.5]]
        faces = [[0, 1, 2], [1, 3, 2]]
        bending = 0.6
        rest = "loaded"

        [[bend]]
        particles = [0, 1, 2]
        rigidity = 0.7
    "#;

#[test]
fn a_scene_with_every_key_survives_the_round_trip_through_its_complete_text() {
    let scene = Scene::from_toml(EVERY_KEY, "dir/file.toml").unwrap();
    assert_eq!(Scene::from_toml(&scene.to_toml(), "x").unwrap(), scene);
    assert_eq!(scene.particles[0].mass.to_bits(), 0.3_f32.to_bits());
}

#[test]
fn each_long_list_of_a_printed_scene_is_one_text() {
    let text = Scene::from_toml(EVERY_KEY, "file.toml").unwrap().to_toml();
    for key in ["vertices", "faces"] {
        assert_eq!(text.matches(&format!("\n{key} = \"")).count(), 2, "{text}");
        assert_eq!(text.matches(&format!("\n{key} = [")).count(), 0, "{text}");
    }
}

/// Every shape that a scene of 2 dimensions may have, with its required keys.
const PLANAR_SHAPES: [&str; 6] = [
    "shape = \"cloth\"\ncolumns = 3\nrows = 2\nspacing = 1\n",
    "shape = \"mesh\"\ncolumns = 3\nrows = 2\nspacing = 1\n",
    "shape = \"rope\"\ncount = 3\nfrom = [0, 0, 0]\nto = [1, 0, 0]\n",
    "shape = \"web\"\nradius = 1\nspokes = 5\nrings = 2\n",
    "shape = \"ragdoll\"\nheight = 1\n",
    "shape = \"obj\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\n",
];

#[test]
fn every_shape_in_two_dimensions_survives_the_round_trip_through_its_complete_text() {
    for shape in PLANAR_SHAPES {
        let text = format!("version = 1\ndimensions = 2\n[[generate]]\n{shape}");
        let scene = Scene::from_toml(&text, "x").unwrap();
        assert_eq!(Scene::from_toml(&scene.to_toml(), "x"), Ok(scene), "{shape}");
    }
}

#[test]
fn a_web_out_of_the_plane_of_two_dimensions_is_refused() {
    let web = |normal: &str| {
        let shape = PLANAR_SHAPES[3];
        let text = format!("version = 1\ndimensions = 2\n[[generate]]\n{shape}normal = {normal}\n");
        Scene::from_toml(&text, "x")
    };
    assert!(web("[0, 0, -2]").is_ok());
    for normal in ["[1, 0, 0]", "[0.1, 0, 1]"] {
        let error = web(normal).unwrap_err();
        assert!(error.first().problem.contains("in a scene of 2 dimensions"), "{error}");
    }
}

#[test]
fn an_empty_scene_is_valid_and_named_after_its_file() {
    let scene = Scene::from_toml("version = 1\n", "some/where/nothing.toml").unwrap();
    assert_eq!(scene.name, "nothing");
    assert_eq!(scene.counts().particles, 0);
}

#[test]
fn a_decimal_is_rounded_once_to_f32() {
    // Just above the middle between 1 and the next f32. Rounded to f64 first, it would become the
    // middle itself, and then 1.
    let text = "version = 1\n[[particle]]\nposition = [1.000000059604644775390625000001, 0, 0]\n";
    let scene = Scene::from_toml(text, "test").unwrap();
    assert_eq!(scene.particles[0].position[0].to_bits(), 1.0_f32.to_bits() + 1);
}

/// Returns the scene with a parameter, if its reader accepts the value.
fn with_parameter(parameter: Parameter, value: f32) -> Result<Scene, SceneError> {
    let info = parameter.info();
    let name = info.name;
    let value =
        if info.form == ValueForm::Whole { value.to_string() } else { format!("{value:?}") };
    let table = match (info.scene_key.split_once('.'), info.parts) {
        (Some((table, key)), _) => format!("[{table}]\n{key} = {value}"),
        (None, Parts::Kinds) => format!(
            "[solver]\nmethod = \"{}\"\n[[generate]]\nshape = \"rope\"\ncount = 2\n\
             from = [0, 0, 0]\nto = [1, 0, 0]\n{name} = {{ structural = {value} }}",
            info.method.unwrap().name()
        ),
        (None, Parts::Blocks) => format!(
            "[[generate]]\nshape = \"rope\"\ncount = 3\nfrom = [0, 0, 0]\nto = [1, 0, 0]\n\
             {name} = {value}"
        ),
        (None, Parts::Colliders) => format!(
            "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\n{name} = {value}"
        ),
        (None, Parts::None) => format!("{name} = {value}"),
    };
    Scene::from_toml(&format!("version = 1\n{table}"), "test")
}

#[test]
fn scenes_accept_exactly_the_range_of_each_parameter() {
    let numbers = PARAMETERS.iter().filter(|info| info.form != ValueForm::Vector);
    for info in numbers.filter(|info| info.parameter != Parameter::TimeScale) {
        let (parameter, range) = (info.parameter, info.range);
        let step = if info.form == ValueForm::Whole { 1.0 } else { 0.0 };
        let below = if step == 0.0 { range.min.next_down() } else { range.min - step };
        let above = if step == 0.0 { range.max.next_up() } else { range.max + step };
        for value in [below, range.min, range.max, above] {
            let is_accepted = with_parameter(parameter, value).is_ok();
            let is_off = parameter.info().off == OffMeaning::NoLimit && value == f32::INFINITY;
            assert_eq!(is_accepted, range.contains(value) || is_off, "{parameter:?} {value:?}");
        }
    }
}

#[test]
fn the_defaults_of_a_scene_are_those_of_the_table_of_parameters() {
    let scene = Scene::from_toml("version = 1\n[wind]\n", "test").unwrap();
    for setting in scene.parameter_values().settings() {
        let default = setting.parameter.info().default;
        // Still air is the default of the table, too, but its drag is not 0 once there is wind.
        if setting.parameter != Parameter::WindDrag {
            assert_eq!(setting.value, default, "{:?}", setting.parameter);
        }
    }
}
