//! Warnings about scenes that work, but probably not as intended.

use sim_solver::{Scene, builtin};

/// Two particles, 1 m apart, with a rigid constraint.
const PAIR: &str = "[[particle]]\nposition = [0, 0, 0]\n[[particle]]\nposition = [1, 0, 0]\n\
     [[constraint]]\nparticles = [0, 1]\n";

fn warnings(text: &str) -> Vec<String> {
    sim_solver::warnings(&Scene::from_toml(&format!("version = 1\n{text}"), "test").unwrap())
}

/// Asserts that a scene has one warning, which begins with these words.
#[track_caller]
fn assert_warns(text: &str, expected: &str) {
    let warnings = warnings(text);
    assert_eq!(warnings.len(), 1, "{text}\n{warnings:?}");
    assert!(warnings[0].starts_with(expected), "{}\n  instead of\n{expected}", warnings[0]);
}

#[test]
fn builtin_scenes_cause_no_warning() {
    for name in builtin::names() {
        let scene = Scene::from_toml(builtin::text(name).unwrap(), name).unwrap();
        assert_eq!(sim_solver::warnings(&scene), Vec::<String>::new(), "{name}");
    }
}

#[test]
fn constraints_that_tear_by_the_errors_of_the_solver_cause_a_warning() {
    let rigid = "constraint 0 is rigid and tears by stretch";
    assert_warns(&format!("{PAIR}tear_stretch = 1.5\n"), rigid);
    assert_warns(
        &format!("{PAIR}compliance = 1e-3\ntear_stretch = 1.5\nmax_stretch = 1.2\n"),
        "constraint 0 is kept within a max_stretch that is not above its tear_stretch",
    );
    assert_warns(
        &format!("[solver]\nrate_hz = 1000\nsubsteps = 20\n{PAIR}tear_force = 50\n"),
        "constraint 0 is rigid and tears at 50 N, but the rounding",
    );
    let none = format!("{PAIR}tear_force = 10\nmax_stretch = 1.2\ntear_stretch = inf\n");
    assert!(warnings(&none).is_empty());
}

#[test]
fn constraints_without_direction_and_duplicates_cause_a_warning() {
    assert_warns(
        &format!("{}rest_length = 1\n", PAIR.replace("[1, 0, 0]", "[0, 0, 0]")),
        "particles 0 and 1 coincide",
    );
    assert_warns(
        &format!("{PAIR}[[constraint]]\nparticles = [1, 0]\n"),
        "two constraints join particles 1 and 0",
    );
}

#[test]
fn settings_without_effect_cause_a_warning() {
    assert_warns(
        &format!("[solver]\ntethers = true\n{PAIR}"),
        "tethers have no effect: no particle is pinned or anchored",
    );
    assert_warns(&format!("[wind]\nvelocity = [1, 0, 0]\n{PAIR}"), "the wind has no effect");
    assert_warns(
        &format!("[contact]\nmode = \"surfaces\"\nthickness = 0.1\n{PAIR}"),
        "contact.mode = \"surfaces\" acts as \"particles\"",
    );
    assert_warns(
        &format!("[contact]\nthickness = 0.1\n{PAIR}"),
        "contact.thickness has no effect: contact.mode is \"off\"",
    );
    assert_warns(&format!("up = \"-y\"\n{PAIR}"), "up is \"-y\", but gravity points up, too");
    assert_warns(
        &format!("unit = \"cm\"\n{PAIR}"),
        "gravity is 9.81 cm/s², but on Earth it is 981 cm/s²",
    );
    assert_warns(
        &format!("[solver]\norder = \"listed\"\n{PAIR}"),
        "order = \"listed\" with one iteration gains energy",
    );
    // 2 m at 9.81 m/s^2: 6.3 m/s, and 6.5 mm in 1/960 s.
    let tall = "[contact]\nmode = \"particles\"\nthickness = 0.02\n[[particle]]\nposition = [0, 0, 0]\n\
        [[particle]]\nposition = [0, 2, 0]\n";
    assert_warns(
        tall,
        "particles that fall through the height of the scene, at 6.3 m/s, move 0.33 of the contact",
    );
    assert!(warnings(tall)[0].ends_with("; 6 substeps suffice"));
    assert!(warnings(&format!("[solver]\nsubsteps = 6\n{tall}")).is_empty());
    assert!(warnings(&format!("gravity = [0, 0, 0]\n{tall}")).is_empty());
    let pinned = PAIR.replace("[1, 0, 0]", "[1, 0, 0]\npinned = true");
    assert_warns(
        &format!("[[anchor]]\nparticles = [1]\n{pinned}"),
        "particle 1 is pinned and follows an anchor: the pin has no effect",
    );
}

#[test]
fn great_distances_and_mass_ratios_cause_a_warning() {
    assert_warns(
        &PAIR.replace("[1, 0, 0]", "[101, 0, 0]"),
        "a coordinate reaches 101 m from the origin",
    );
    assert_warns(
        &PAIR.replace("[1, 0, 0]", "[1, 0, 0]\nmass = 2000"),
        "masses range from 1 to 2000 kg",
    );
}

/// A sphere of 0.5 m about the origin.
const SPHERE: &str = "[[collider]]\nshape = \"sphere\"\ncenter = [0, 0, 0]\nradius = 0.5\n";

#[test]
fn a_particle_inside_a_collider_causes_a_warning() {
    assert_warns(
        &format!("{PAIR}{SPHERE}"),
        "1 particle starts inside a collider; the deepest is particle 0, 0.5 m inside collider 0",
    );
}

#[test]
fn the_deepest_particle_of_a_collider_is_named_and_not_the_first() {
    let particle = |x: f32| format!("[[particle]]\nposition = [{x}, 0, 0]\n");
    let row: String = [0.375, 0.125, 0.25, 2.0].map(particle).concat();
    assert_warns(
        &format!("{row}{SPHERE}"),
        "3 particles start inside a collider; the deepest is particle 1, 0.375 m inside collider 0",
    );
    // Particle 0 is 1/8 m inside the sphere, and 3/8 m inside the floor.
    let floor = "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0.375\n";
    assert_warns(
        &format!("{}{SPHERE}{floor}", particle(0.375)),
        "1 particle starts inside a collider; the deepest is particle 0, 0.375 m inside collider 1",
    );
}

#[test]
fn an_empty_scene_causes_a_warning() {
    assert_warns("", "the scene has no particles");
}

#[test]
fn a_rope_of_zero_length_causes_a_warning() {
    let rope = "[[generate]]\nshape = \"rope\"\ncount = 3\nfrom = [0, 1, 0]\nto = [0, 1, 0]\n";
    assert_warns(rope, "generate[0]: the rope has no length, because from and to are equal");
    let bridge = rope.replace("rope", "bridge").replace("count", "width = 1\nplanks");
    assert_warns(&bridge, "generate[0]: the bridge has no length");
}

#[test]
fn pins_that_match_no_particle_cause_a_warning() {
    let rope = "[[generate]]\nshape = \"rope\"\ncount = 3\nfrom = [0, 1, 0]\nto = [1, 1, 0]\n";
    assert_warns(&format!("{rope}pinned = []\n"), "generate[0].pinned matches no particle");
    assert!(warnings(&format!("{rope}pinned = \"none\"\n")).is_empty());
    let mesh = "[[generate]]\nshape = \"obj\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\n\
         faces = [[0, 1, 2]]\n";
    assert_warns(&format!("{mesh}pinned = \"y > 1.5\"\n"), "generate[0].pinned matches no");
    assert!(warnings(&format!("{mesh}pinned = \"y > 0.5\"\n")).is_empty());
    assert_warns(&format!("[[anchor]]\nparticles = []\n{PAIR}"), "anchor[0].particles is empty");
}

/// The law is verified in `physics/bending.rs`: the rigidity sinks by the factor 1 + k h^2 / (m alpha), with
/// k = 3 in the middle of a long strip. The coefficients of a hinge between two right triangles are 2, so its
/// factor is 1 + 8 h^2 B / (m s^2).
#[test]
fn a_rigidity_that_the_substeps_do_not_reach_causes_a_warning_that_names_enough_of_them() {
    let cases = [
        (
            "[[generate]]\nshape = \"cloth\"\ncolumns = 9\nrows = 9\nspacing = 0.05\nmass = 0.01\n\
             bending = 4\n",
            "generate[0].bending: 4 substeps at 240 Hz reach a rigidity of 2.63 N m instead of 4: \
             9 substeps suffice",
        ),
        (
            "[[generate]]\nshape = \"rope\"\ncount = 21\nfrom = [0, 0, 0]\nto = [1, 0, 0]\n\
             mass = 0.01\nbending = 1\n",
            "generate[0].bending: 4 substeps at 240 Hz reach a rigidity of 0.277 N m² instead of \
             1: 20 substeps suffice",
        ),
        (
            "[[generate]]\nshape = \"obj\"\nvertices = [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], \
             [0, 0.1, 0]]\nfaces = [[0, 1, 2], [0, 2, 3]]\nmass = 0.01\nbending = 4\n",
            "generate[0].bending: 4 substeps at 240 Hz reach a rigidity of 2.97 N m instead of 4: \
             8 substeps suffice",
        ),
    ];
    for (text, expected) in cases {
        assert_warns(text, expected);
        let count: u32 = expected.rsplit(' ').nth(2).unwrap().parse().unwrap();
        let with =
            |substeps: u32| warnings(&format!("[solver]\nsubsteps = {substeps}\n{text}")).len();
        assert_eq!([with(count), with(count - 1)], [0, 1], "{expected}");
    }
}

#[test]
fn an_edge_without_a_hinge_causes_a_warning() {
    let mesh = |height: f64| {
        warnings(&format!(
            "[[generate]]\nshape = \"obj\"\nvertices = [[0, 0, 0], [1, 0, 0], [0.5, 1, 0], \
             [0.5, -{height}, 0]]\nfaces = [[0, 1, 2], [0, 3, 1]]\nbending = 1e-6\n"
        ))
    };
    assert_eq!(mesh(0.002), Vec::<String>::new());
    let expected = "generate[0].bending: 1 edge has no hinge, because an adjacent triangle has no height: \
         merge its corners, or divide its longest side";
    assert_eq!(mesh(0.0005), [expected]);
}

/// A sheet of 5 x 5 particles, 0.1 m apart, in the plane z = 0 from y = 0.4 down to y = 0.
const SHEET: &str = "[[generate]]\nshape = \"cloth\"\ncolumns = 5\nrows = 5\nspacing = 0.1\n\
     origin = [0, 0.4, 0]\nmass = 0.01\npinned = \"none\"\n";

/// A plate of 2 m x 2 m at a height, of two triangles, with another 1 cm below it where it is closed.
fn plate(height: f32, is_closed: bool) -> String {
    let corners = |y: f32| format!("[-1, {y}, -1], [1, {y}, -1], [1, {y}, 1], [-1, {y}, 1]");
    let lower = if is_closed { format!(", {}", corners(height - 0.01)) } else { String::new() };
    let faces = if is_closed { "[0, 1, 2, 3], [7, 6, 5, 4]" } else { "[0, 1, 2, 3]" };
    format!(
        "[[collider]]\nshape = \"mesh\"\nvertices = [{}{lower}]\nfaces = [{faces}]\n\
         distance = 0.02\n",
        corners(height)
    )
}

#[test]
fn a_shape_that_starts_across_a_mesh_causes_a_warning_that_names_the_place() {
    // Five vertical constraints pass through the plate, from the second row to the third.
    let expected = "5 constraints, the first of them 18, start across collider 0, a mesh: particles 5 and 10 are on \
                    different sides of it, and each stays on its side; move the mesh or the shape";
    assert_eq!(warnings(&format!("{SHEET}{}", plate(0.25, false))), [expected]);
    // The same plate, 1 cm thick.
    assert_eq!(warnings(&format!("{SHEET}{}", plate(0.255, true))), [expected]);
    // Turned by a half turn about x it is at -0.25 m, and 0.5 m higher it is where it was.
    let turned = format!("{}center = [0, 0.5, 0]\nrotation = [1, 0, 0, 0]\n", plate(0.25, false));
    assert_warns(&format!("{SHEET}{turned}"), "5 constraints");
    assert_warns(
        &format!(
            "{}{}",
            PAIR.replace("[0, 0, 0]", "[0, 1, 0]").replace("[1, 0, 0]", "[0.1, 0, 0.2]"),
            plate(0.25, false)
        ),
        "constraint 0 starts across collider 0, a mesh: particles 0 and 1 are on different",
    );
}

/// A tube of 24 x 12 facets around a circle, at a height.
fn torus(height: f64) -> String {
    let vertex = |index: u32| {
        let [around, along] = [(index / 12, 24.0), (index % 12, 12.0)]
            .map(|(place, count)| std::f64::consts::TAU * f64::from(place) / count);
        let radius = 0.25 + 0.1 * along.cos();
        let (x, z) = (radius * around.cos(), radius * around.sin());
        format!("[{x}, {}, {z}]", height + 0.1 * along.sin())
    };
    let face = |index: u32| {
        let (ring, place) = (index / 12, index % 12);
        let at = |ring: u32, place: u32| 12 * (ring % 24) + place % 12;
        let [a, b] = [at(ring, place), at(ring, place + 1)];
        let [c, d] = [at(ring + 1, place + 1), at(ring + 1, place)];
        format!("[{a}, {b}, {c}, {d}]")
    };
    let list = |text: &dyn Fn(u32) -> String| (0..288).map(text).collect::<Vec<_>>().join(", ");
    let (vertices, faces) = (list(&vertex), list(&face));
    format!("[[collider]]\nshape = \"mesh\"\nvertices = [{vertices}]\nfaces = [{faces}]\n")
}

#[test]
fn constraints_through_the_edges_of_a_mesh_cause_a_warning() {
    let sheet = "[[generate]]\nshape = \"cloth\"\ncolumns = 41\nrows = 41\nspacing = 0.02\n\
                 origin = [-0.4, 0.5, -0.4]\ndown = [0, 0, 1]\nmass = 0.001\npinned = \"none\"\n";
    // In the middle, the sheet passes through a ring of edges, between facets at 30 degrees to each other.
    for height in [0.45, 0.46, 0.48, 0.52] {
        assert_warns(&format!("{sheet}{}", torus(height)), "200 constraints, the first");
    }
    // It lies on the top, and beside the tube.
    for height in [0.39, 0.3] {
        assert_eq!(warnings(&format!("{sheet}{}", torus(height))), Vec::<String>::new());
    }
}

#[test]
fn a_shape_that_starts_within_the_distance_of_a_mesh_causes_a_warning() {
    let near = format!("{SHEET}{}", plate(-0.015, false));
    let [warning] = &warnings(&near)[..] else { panic!("{:?}", warnings(&near)) };
    let expected = "5 particles start within the distance of collider 0, a mesh; particle 20 is 0.005 m too near: the \
                    first step pushes it away at once; move the shape, or use a distance of at most 0.015 m";
    assert_eq!(warning, expected);
    for height in [-0.02, -0.0199] {
        assert_eq!(warnings(&format!("{SHEET}{}", plate(height, false))), Vec::<String>::new());
    }
    // Within the rounding of a mesh without a distance.
    let on = plate(-1e-9, false).replace("distance = 0.02", "distance = 0");
    assert_eq!(warnings(&format!("{SHEET}{on}")), Vec::<String>::new());
}

#[test]
fn a_shape_beside_a_mesh_or_fixed_across_it_causes_no_warning() {
    for height in [-0.1, 0.45] {
        assert_eq!(warnings(&format!("{SHEET}{}", plate(height, false))), Vec::<String>::new());
    }
    // The ridge of a roof of 90 degrees is between two particles of a coarse sheet, and cuts nothing off.
    let roof = "[[collider]]\nshape = \"mesh\"\nvertices = [[-1, -1, -1], [0, 0, -1], [1, -1, -1], \
                [-1, -1, 1], [0, 0, 1], [1, -1, 1]]\nfaces = [[0, 1, 4, 3], [1, 2, 5, 4]]\n";
    let over =
        PAIR.replace("[0, 0, 0]", "[-0.1, -0.05, 0]").replace("[1, 0, 0]", "[0.1, -0.05, 0]");
    assert_eq!(warnings(&format!("{over}{roof}")), Vec::<String>::new());
    // Fixed particles touch nothing: a cape may hang on a point inside a body.
    let row = SHEET.replace("\"none\"", "\"top\"");
    assert_eq!(warnings(&format!("{row}{}", plate(0.35, false))), Vec::<String>::new());
}

#[test]
fn a_shape_that_starts_across_a_solid_plate_causes_a_warning() {
    let plate = "[[collider]]\nshape = \"mesh\"\nsolid = true\ncenter = [0.5, 0, 0]\nvertices = [[-0.1, -1, -1], \
                 [0.1, -1, -1], [0, 2, 0], [0, -1, 2]]\nfaces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]\n";
    assert_warns(
        &format!("{PAIR}{plate}"),
        "constraint 0 starts across collider 0, a mesh: particles 0 and 1 are on different sides of it",
    );
}

#[test]
fn a_shape_that_starts_in_a_solid_mesh_causes_a_warning() {
    let tetrahedron = "[[collider]]\nshape = \"mesh\"\nvertices = [[-1, -1, -1], [5, -1, -1], [-1, 5, -1], [-1, -1, 5]]\n\
                       faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]\n";
    let solid = format!("{PAIR}{tetrahedron}solid = true\n");
    assert_warns(
        &solid,
        "2 particles start inside a collider; the deepest is particle 0, 1 m inside collider 0",
    );
    let apart = format!("{}{tetrahedron}solid = true\n", PAIR.replace(", 0, 0]", ", 5, 0]"));
    assert_eq!(warnings(&apart), Vec::<String>::new());
}

#[test]
fn a_thickness_that_reaches_second_neighbours_causes_a_warning() {
    let contact = |thickness: f32| {
        format!(
            "gravity = [0, 0, 0]\n[contact]\nmode = \"particles\"\nthickness = {thickness}\n{SHEET}"
        )
    };
    assert_warns(
        &contact(0.2),
        "contact.thickness: 0.2 m is 2 times the spacing of generate[0], 0.1 m: its particles that are \
         nearer than 0.32 m at load never touch, so small folds pass through themselves; use at most the \
         spacing",
    );
    assert_warns(
        &contact(0.4),
        "contact.thickness: 0.4 m is 4 times the spacing of generate[0], 0.1 m: its particles that are nearer than \
         0.64 m at load never touch, so small folds pass through themselves, and what touches can be thrown apart; \
         use at most the spacing",
    );
    assert_eq!(warnings(&contact(0.12)), Vec::<String>::new());
}

#[test]
fn a_thickness_that_leaves_room_between_particles_causes_a_warning() {
    let contact = |thickness: f32, mode: &str| {
        format!(
            "gravity = [0, 0, 0]\n[contact]\nmode = \"{mode}\"\nthickness = {thickness}\n{SHEET}"
        )
    };
    assert_warns(
        &contact(0.02, "particles"),
        "contact.thickness: 0.02 m is 0.2 times the spacing of generate[0], 0.1 m: other particles pass \
         between its particles; use at least three quarters of the spacing, or mode = \"surfaces\" for cloth",
    );
    assert_eq!(warnings(&contact(0.08, "particles")), Vec::<String>::new());
    assert_warns(
        &contact(0.02, "surfaces"),
        "contact.thickness: 0.02 m is 0.2 times the spacing of generate[0], 0.1 m: its folds tangle; use at least half \
         of the spacing",
    );
    assert_eq!(warnings(&contact(0.05, "surfaces")), Vec::<String>::new());
    let rope = "[[generate]]\nshape = \"rope\"\ncount = 11\nfrom = [0, 0, 0]\nto = [1, 0, 0]\nmass = 0.01\n\
                pinned = \"none\"\n";
    let warned = warnings(&contact(0.02, "surfaces").replace(SHEET, &format!("{SHEET}{rope}")));
    assert!(warned.iter().any(|one| {
        one.ends_with("other particles pass between its particles; use at least three quarters of the spacing")
    }));
    // A figure has gaps between its limbs.
    let figure = contact(0.1, "particles")
        .replace(SHEET, "[[generate]]\nshape = \"ragdoll\"\nheight = 1.7\n");
    assert_eq!(warnings(&figure), Vec::<String>::new());
}

#[test]
fn contacts_of_shapes_that_all_refuse_them_cause_a_warning() {
    let scene = format!(
        "gravity = [0, 0, 0]\n[contact]\nmode = \"particles\"\nthickness = 0.2\n{SHEET}contact = false\n"
    );
    assert_eq!(
        warnings(&scene),
        [
            "contact.mode has no effect: every [[generate]] has contact = false; remove it from those that shall touch"
        ]
    );
    let particle = "[[particle]]\nposition = [5, 5, 5]\n";
    assert_eq!(warnings(&format!("{scene}{particle}")), Vec::<String>::new());
}

#[test]
fn a_thickness_with_more_neighbours_than_the_solver_remembers_causes_a_warning() {
    let expected = "contact.thickness: at load, there are more than 32 pairs of particles, each counted once, or 128 \
                    triangles for each particle, on average, within";
    let contact = |mode: &str, thickness: f32| {
        let sheet = SHEET.replace("columns = 5\nrows = 5", "columns = 24\nrows = 24");
        let contact = format!("[contact]\nmode = \"{mode}\"\nthickness = {thickness}\n");
        warnings(&format!("gravity = [0, 0, 0]\n{contact}{sheet}"))
    };
    for mode in ["particles", "surfaces"] {
        let is_overfull =
            |thickness| contact(mode, thickness).iter().any(|one| one.starts_with(expected));
        assert_eq!([0.1, 0.2, 0.4].map(is_overfull), [false, false, true], "{mode}");
    }
}

#[test]
fn gravity_that_does_not_point_down_causes_a_warning() {
    assert_warns(
        &format!("up = \"z\"\n{PAIR}"),
        "up is \"z\", but gravity = [0.0, -9.81, 0.0] points sideways: for things to fall down, use gravity = [0.0, 0.0, -9.81]",
    );
    assert_warns(
        &format!("gravity = [2, 0.1, 0]\n{PAIR}"),
        "up is \"y\", but gravity = [2.0, 0.1, 0.0] points sideways",
    );
    // A slope, weightlessness, and gravity along z.
    for calm in
        ["gravity = [9, -2, 0]", "gravity = [0, 0, 0]", "up = \"z\"\ngravity = [0, 0, -9.81]"]
    {
        assert_eq!(warnings(&format!("{calm}\n{PAIR}")), Vec::<String>::new());
    }
}

#[test]
fn particles_of_several_shapes_in_one_place_cause_a_warning() {
    let apart =
        "and nothing holds them together: move them apart, or join each two by a constraint";
    let particle = |x: u32, more: &str| format!("[[particle]]\nposition = [{x}, 0, 0]\n{more}");
    let two = format!("{}{}{}", particle(1, ""), particle(2, ""), particle(1, ""));
    let expected = format!(
        "1 particle starts where another one does (particle 2 where particle 0 is), {apart}"
    );
    assert_eq!(warnings(&two), [expected]);
    assert_eq!(
        warnings(&format!("{two}[[constraint]]\nparticles = [0, 2]\n")),
        Vec::<String>::new()
    );
    assert_eq!(warnings(&particle(1, "pinned = true\n").repeat(3)), Vec::<String>::new());
    // The second sheet was copied, and not moved.
    let expected = format!(
        "generate[1]: all of its 25 particles start where another one does (particle 25 where particle 0 is), {apart}"
    );
    assert_eq!(warnings(&SHEET.repeat(2)), [expected]);
    let beside = SHEET.replace("origin = [0,", "origin = [0.4,");
    let expected = format!(
        "generate[1]: 5 of its 25 particles start where another one does (particle 25 where particle 4 is), {apart}"
    );
    assert_eq!(warnings(&format!("{SHEET}{beside}")), [expected]);
    let seam =
        |row: u32| format!("[[constraint]]\nparticles = [{}, {}]\n", 5 * row + 4, 25 + 5 * row);
    let sewn: String = (0..5).map(seam).collect();
    assert_eq!(warnings(&format!("{sewn}{SHEET}{beside}")), Vec::<String>::new());
}

#[test]
fn a_damping_that_leaves_nothing_of_a_velocity_causes_a_warning() {
    let scene = |damping: f32| {
        format!("[solver]\nrate_hz = 240\nsubsteps = 4\ndamping = {damping}\n{SHEET}")
    };
    assert_warns(
        &scene(2000.0),
        "damping = 2000 1/s leaves nothing of a velocity: from 960 1/s on, one divided by the length of a substep, \
         particles only creep",
    );
    assert_eq!(warnings(&scene(900.0)), Vec::<String>::new());
}

#[test]
fn a_sheet_on_a_line_causes_a_warning() {
    for right in ["[0, 0, 0]", "[0, -1, 0]", "[0, 3, 0]"] {
        assert_warns(
            &format!("{SHEET}right = {right}\n"),
            "generate[0]: right and down are parallel, or one of them is zero, so all particles of the sheet are on one line",
        );
    }
    assert_eq!(warnings(&format!("{SHEET}right = [1, 0.5, 0]\n")), Vec::<String>::new());
}
