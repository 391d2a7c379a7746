//! Every kernel and every number of threads gives the bits of the reference, which projects the
//! constraints one after another and treats sheets and crowds as graphs: on every scene, at every size around
//! that of a vector, and with every property of a constraint.

mod crowds;

use sim_solver::{Grab, Kernels, ParameterValue, Push, Scene, Solver, Sphere, TearCause, builtin};

/// Steps all kernels side by side with the same commands, compares every particle, and returns the
/// reference.
fn assert_same_bits(text: &str, name: &str, steps: u32) -> Solver {
    let scene = Scene::from_toml(text, name).unwrap();
    let mut reference = Solver::with_kernels(&scene, Kernels::Reference);
    let others = Kernels::available().filter(|kernels| *kernels != Kernels::Reference);
    let mut others: Vec<_> =
        others.map(|kernels| (kernels, Solver::with_kernels(&scene, kernels))).collect();
    for step in 0..steps {
        command(&mut reference, step);
        reference.step();
        for (kernels, solver) in &mut others {
            command(solver, step);
            solver.step();
            let hashes = (reference.state_hash(), solver.state_hash());
            assert_eq!(hashes.0, hashes.1, "{name}: {kernels:?} differs in step {step}");
            assert_eq!(reference.torn(), solver.torn(), "{name}: {kernels:?}, step {step}");
            assert_eq!(reference.tear_causes(), solver.tear_causes(), "{name}: {kernels:?}");
        }
    }
    reference
}

/// Applies a mix of commands. All kernels refuse the same ones.
fn command(solver: &mut Solver, step: u32) {
    let count = u32::try_from(solver.particle_count()).unwrap();
    if count == 0 {
        return;
    }
    let particle = step.wrapping_mul(7919) % count;
    let [x, y, z] = solver.particle(particle as usize).position;
    let _refused = match step % 23 {
        3 => solver.grab(1, Grab { particle, target: [x + 0.1, y, z], over_s: 0.02 }),
        7 => solver.pin(particle),
        11 => solver.unpin(particle),
        13 => solver.push(Push {
            sphere: Sphere { center: [x, y, z], radius: 0.3 },
            delta: [0.01, 0.0, 0.0],
            limit: None,
        }),
        17 => solver.cut(step % 50),
        19 => {
            release_all(solver, count);
            Ok(())
        }
        _ => Ok(()),
    };
}

fn release_all(solver: &mut Solver, count: u32) {
    for particle in 0..count {
        let _not_held = solver.release(1, particle);
    }
}

#[test]
fn kernels_agree_on_every_built_in_scene() {
    for name in builtin::names() {
        let text = builtin::text(name).unwrap();
        let is_big = Solver::new(&Scene::from_toml(text, name).unwrap()).particle_count() > 500;
        assert_same_bits(text, name, if is_big { 60 } else { 300 });
    }
}

#[test]
fn kernels_agree_on_scenes_with_every_mechanism() {
    for text in [
        include_str!("scenes/everything.toml"),
        include_str!("scenes/stiffness.toml"),
        include_str!("scenes/touching.toml"),
        include_str!("scenes/surfaces.toml"),
        include_str!("scenes/draped.toml"),
        include_str!("scenes/bends.toml"),
    ] {
        assert_same_bits(text, "test", 300);
    }
}

/// Returns a sheet that falls onto a sphere and a floor.
fn sheet(columns: u32, rows: u32, solver: &str, generator: &str) -> String {
    format!(
        "version = 1\n[solver]\nrate_hz = 120\n{solver}\n\
         [[collider]]\nshape = \"plane\"\nnormal = [0.1, 1, 0]\noffset = -0.3\nfriction = 0.4\nrestitution = 0.3\n\
         [[collider]]\nshape = \"sphere\"\ncenter = [0.3, -0.2, 0.3]\nradius = 0.2\n\
         [[collider]]\nshape = \"box\"\ncenter = [1.2, -0.1, 0.5]\nhalf_extents = [0.2, 0.1, 0.2]\nrotation = [0, 0.3, 0, 0.95]\n\
         [[generate]]\nshape = \"cloth\"\ncolumns = {columns}\nrows = {rows}\nspacing = 0.05\ndown = [0, 0, 1]\n{generator}\n"
    )
}

const LINKS: &str = "links = [\"structural\", \"shear\", \"bend\"]\npinned = \"corners\"";

/// Settings and generator keys that affect constraints.
const VARIANTS: [(&str, &str, &str); 14] = [
    ("rigid", "substeps = 3", LINKS),
    ("passes", "substeps = 2\niterations = 3\nrelaxation = 1.2", LINKS),
    ("tethers", "substeps = 2\ntethers = true", LINKS),
    ("tethers to several roots", "substeps = 2\ntethers = 3", LINKS),
    (
        "soft",
        "substeps = 2\niterations = 2",
        "links = [\"structural\", \"shear\", \"bend\"]\npinned = \"top\"\ncompliance = { structural = 1e-6, shear = 1e-4, bend = 1e-2 }",
    ),
    (
        "pbd",
        "substeps = 2\niterations = 3\nmethod = \"pbd\"",
        "links = [\"structural\", \"shear\"]\npinned = \"top\"\nstiffness = { structural = 0.9, shear = 0.5, bend = 0.1 }",
    ),
    ("limited", "substeps = 1\nmax_stretch = 1.02", LINKS),
    ("torn", "substeps = 2\ntear_stretch = 1.05\ntear_force = 40", LINKS),
    ("one diagonal", "substeps = 2\ntear_distance = 0.01", "diagonals = 1\npinned = \"top-even\""),
    ("bending", "substeps = 2\ntethers = true", "pinned = \"corners\"\nbending = 40"),
    (
        "woven",
        "substeps = 2\niterations = 3\nrelaxation = 1.2\nmax_stretch = 1.1",
        "pinned = \"top-even\"\nbending = [40, 1e3]\ntwist = true",
    ),
    (
        "wind",
        "substeps = 2\ntethers = 1\n[wind]\nvelocity = [3, 9, 2]\ndrag = 0.6\ngust = 0.4\ngust_period = 0.1",
        LINKS,
    ),
    (
        "torn in wind",
        "substeps = 2\ntear_stretch = 1.05\n[wind]\nvelocity = [3, 9, 2]\ndrag = 0.6",
        LINKS,
    ),
    ("torn bends", "substeps = 2\ntear_stretch = 1.05\ntear_force = 40", "bending = [40, 5]"),
];

#[test]
fn kernels_agree_on_sheets_of_every_size_around_a_vector() {
    for (name, solver, generator) in VARIANTS {
        let mut causes = Vec::new();
        for size in [1, 2, 3, 7, 8, 9, 15, 16, 17, 31, 32, 33] {
            for (columns, rows) in [(size, 9), (5, size), (size, size)] {
                let name = format!("{name}, {columns} x {rows}");
                let text = sheet(columns, rows, solver, generator);
                causes.extend_from_slice(assert_same_bits(&text, &name, 24).tear_causes());
            }
        }
        // Scenes with a tear limit do tear.
        let tears = |cause| causes.contains(&cause);
        let by_itself = [TearCause::Force, TearCause::Stretch, TearCause::Distance].map(tears);
        match name {
            "torn" | "torn bends" => assert_eq!(by_itself, [true, true, false]),
            "torn in wind" => assert_eq!(by_itself, [false, true, false]),
            "one diagonal" => assert_eq!(by_itself, [false, false, true]),
            _ => assert_eq!(by_itself, [false; 3], "{name}"),
        }
    }
}

/// Eight particles share the instructions of a contact, and nothing else: in a row of a sheet, with
/// padding, in a crowd, and in the graph.
#[test]
fn a_particle_has_the_same_contacts_alone_as_among_others() {
    const COLLIDERS: &str = "version = 1\n[solver]\nrate_hz = 120\nsubsteps = 3\n\
         [[collider]]\nshape = \"sphere\"\ncenter = [0.3, -0.2, 0.1]\nradius = 0.22\nfriction = 0.2\n\
         velocity = [0.1, 0.2, 0]\n\
         [[collider]]\nshape = \"box\"\ncenter = [0.6, -0.1, 0.3]\nhalf_extents = [0.1, 0.1, 0.1]\nangular_velocity = [0, 0, 3]\n\
         [[collider]]\nshape = \"plane\"\nnormal = [0.2, 1, 0.1]\noffset = -0.3\nfriction = 0.1\nrestitution = 0.6\n\
         [[collider]]\nshape = \"bounds\"\nmin = [-0.02, -2, -0.02]\nmax = [0.8, 1, 0.5]\nfriction = 0.3\n";
    let sheet = format!(
        "{COLLIDERS}[[generate]]\nshape = \"cloth\"\ncolumns = 13\nrows = 5\nspacing = 0.06\n\
         down = [0, 0.3, 1]\nmass = 0.01\nlinks = []\npinned = [3, 20]\n"
    );
    let scene = Scene::from_toml(&sheet, "sheet").unwrap();
    let mut together = Solver::new(&scene);
    let starts: Vec<_> = together.particles().iter().map(|one| one.position).collect();
    let particle = |at: &[f32; 3]| format!("[[particle]]\nposition = {at:?}\nmass = 0.01\n");
    let all: String = starts.iter().map(&particle).collect();
    let all = COLLIDERS.to_owned() + &all;
    let mut in_crowd = Solver::new(&Scene::from_toml(&all, "crowd").unwrap());
    // Tethers that never act make one figure of all particles.
    let tether = |one| {
        format!(
            "[[constraint]]\nparticles = [{one}, {}]\nkind = \"tether\"\nrest_length = 99\n",
            one + 1
        )
    };
    let joined: String = (0..starts.len() - 1).map(tether).collect();
    let mut in_graph = Solver::new(&Scene::from_toml(&(all + &joined), "graph").unwrap());
    (0..90).for_each(|_| (together.step(), in_crowd.step(), in_graph.step()).0);
    let mut touching_count = 0;
    for (index, start) in starts.iter().enumerate().filter(|(index, _)| ![3, 20].contains(index)) {
        let text = COLLIDERS.to_owned() + &particle(start);
        let mut alone = Solver::new(&Scene::from_toml(&text, "alone").unwrap());
        (0..90).for_each(|_| alone.step());
        let state = alone.particle(0);
        assert_eq!(together.particle(index), state, "particle {index} of the sheet");
        assert_eq!(in_crowd.particle(index), state, "particle {index} of the crowd");
        assert_eq!(in_graph.particle(index), state, "particle {index} of the graph");
        // A free fall of 0.75 s ends 2.8 m lower.
        touching_count += usize::from(state.position[1] > start[1] - 2.0);
    }
    assert_eq!(touching_count, starts.len() - 2, "each particle meets a collider");
}

#[test]
fn kernels_agree_on_a_sheet_that_is_too_narrow_for_rows() {
    assert_same_bits(&sheet(3, 66_000, "", ""), "3 x 66000", 4);
}

#[test]
fn kernels_agree_on_sheets_that_are_split_into_strips() {
    for (name, solver, generator) in VARIANTS {
        for columns in [127, 128, 129, 200, 255, 256, 257, 400] {
            let name = format!("{name}, {columns} x 12");
            assert_same_bits(&sheet(columns, 12, solver, generator), &name, 6);
        }
    }
}

#[test]
fn kernels_agree_on_ropes_of_every_length_around_a_vector() {
    for count in [2, 3, 7, 8, 9, 16, 17, 31, 32, 33, 300] {
        let text = format!(
            "version = 1\n[solver]\nsubsteps = 5\ntethers = true\n[[generate]]\nshape = \"rope\"\n\
             count = {count}\nfrom = [0, 0, 0]\nto = [1, 0, 0]\npinned = \"first\"\n"
        );
        assert_same_bits(&text, &format!("rope of {count}"), 60);
    }
}

/// The ropes lie in rows, and explicit bends turn the sheet into a graph, with more bends at one particle
/// than there are groups.
#[test]
fn kernels_agree_on_bends_of_ropes_and_graphs() {
    let mut text = "version = 1\n[solver]\nsubsteps = 3\niterations = 2\n".to_owned();
    for count in [2, 3, 4, 24, 25, 26, 27, 60] {
        text += &format!(
            "[[generate]]\nshape = \"rope\"\ncount = {count}\nfrom = [0, 0, 0]\nto = [1, 0, 0]\n\
             bending = 0.01\nmass = 0.01\n"
        );
    }
    text += "[[generate]]\nshape = \"cloth\"\ncolumns = 12\nrows = 9\nspacing = 0.1\nbending = 5\n";
    for end in 0..40 {
        let first = 171 + end;
        text += &format!("[[bend]]\nparticles = [{first}, 215, {}]\nrigidity = 0.1\n", first + 49);
        text += &format!(
            "[[bend]]\nparticles = [{first}, {}, {}, {}]\nrigidity = 0.5\n",
            first + 1,
            first + 24,
            first + 25
        );
    }
    assert_same_bits(&text, "bends", 120);
    assert_same_bits_of_threads(&text, "bends", 20);
}

/// Returns a curved mesh of columns x rows vertices, whose triangles have one diagonal.
fn mesh(columns: usize, rows: usize, rest: &str) -> String {
    let places =
        (0..rows).flat_map(|row| (0..columns).map(move |column| (column as f64, row as f64)));
    let vertex = |(x, y): (f64, f64)| [0.1 * x, 0.1 * y, 0.001 * x * (x - y)];
    let vertices: Vec<_> = places.map(vertex).collect();
    let cells =
        (0..rows - 1).flat_map(|row| (1..columns).map(move |column| row * columns + column));
    let triangles = |b: usize| [[b - 1, b, b + columns], [b - 1, b + columns, b + columns - 1]];
    let faces: Vec<_> = cells.flat_map(triangles).collect();
    format!(
        "version = 1\n[[generate]]\nshape = \"obj\"\nvertices = {vertices:?}\nfaces = {faces:?}\n\
         bending = 2\nrest = \"{rest}\"\n"
    )
}

#[test]
fn kernels_agree_on_hinges() {
    for rest in ["flat", "loaded"] {
        assert_same_bits(&mesh(13, 9, rest), rest, 100);
        // Groups of more than 4,096 hinges are divided among threads.
        let large = mesh(230, 150, rest);
        assert_same_bits(&large, rest, 3);
        assert_same_bits_of_threads(&large, rest, 3);
    }
}

#[test]
fn kernels_agree_on_sheets_that_are_joined_to_other_shapes() {
    // An explicit constraint turns the first sheet into a graph. The second remains a sheet.
    let cloth = "[[generate]]\nshape = \"cloth\"\ncolumns = 12\nrows = 9\nspacing = 0.1\n";
    let text = format!(
        "version = 1\n[solver]\nsubsteps = 3\n[[particle]]\nposition = [0, -1, 0]\n\
         [[constraint]]\nparticles = [0, 100]\n[[constraint]]\nparticles = [0, 100]\nrest_length = 0\ncompliance = 1e-4\n\
         {cloth}{cloth}pinned = \"none\"\norigin = [0, 0, 1]\n"
    );
    assert_same_bits(&text, "sewn", 120);
}

#[test]
fn kernels_agree_where_ends_coincide_and_lengths_are_zero() {
    let mut text = "version = 1\n[solver]\nsubsteps = 2\niterations = 2\n".to_owned();
    for index in 0..24 {
        let x = f64::from(index / 2) * 0.25;
        text += &format!("[[particle]]\nposition = [{x}, 0, 0]\npinned = {}\n", index % 5 == 0);
    }
    for index in 0..22 {
        let rest = ["", "rest_length = 0\n", "rest_length = 0.1\nkind = \"tether\"\n"][index % 3];
        text += &format!("[[constraint]]\nparticles = [{index}, {}]\n{rest}", index + 2);
        text += &format!("[[constraint]]\nparticles = [{index}, {}]\n{rest}", index + 1);
    }
    assert_same_bits(&text, "zero", 120);
}

/// Steps one thread and several numbers of threads side by side.
fn assert_same_bits_of_threads(text: &str, name: &str, steps: u32) {
    let scene = Scene::from_toml(text, name).unwrap();
    let mut alone = Solver::new(&scene);
    let mut others: Vec<_> = [2, 3, 4, 8]
        .into_iter()
        .map(|threads| {
            let mut solver = Solver::new(&scene);
            solver.set_threads(threads);
            solver
        })
        .collect();
    for step in 0..steps {
        command(&mut alone, step);
        alone.step();
        for solver in &mut others {
            command(solver, step);
            solver.step();
            let threads = solver.threads();
            assert_eq!(alone.state_hash(), solver.state_hash(), "{name}: {threads}, step {step}");
        }
    }
}

#[test]
fn threads_give_the_same_bits_on_every_built_in_scene() {
    for name in builtin::names() {
        assert_same_bits_of_threads(builtin::text(name).unwrap(), name, 30);
    }
}

/// A cloth that folds on a ball, and a rope that falls on it.
#[test]
fn threads_give_the_same_bits_where_cloths_touch() {
    for mode in ["particles", "surfaces"] {
        let text = format!(
            "version = 1\n[solver]\nrate_hz = 60\nsubsteps = 16\n[contact]\nmode = \"{mode}\"\n\
             thickness = 0.02\n[[generate]]\nshape = \"cloth\"\ncolumns = 50\nrows = 50\n\
             spacing = 0.02\npinned = \"none\"\nmass = 0.001\norigin = [-0.5, 0.22, -0.5]\n\
             right = [1, 0, 0]\ndown = [0, 0, 1]\n[[generate]]\nshape = \"rope\"\ncount = 40\n\
             from = [-0.4, 0.3, 0.1]\nto = [0.4, 0.32, 0]\nmass = 0.001\npinned = \"none\"\n\
             [[collider]]\nshape = \"sphere\"\ncenter = [0, 0.1, 0]\nradius = 0.1\n\
             [[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\nfriction = 0.3\n"
        );
        assert_same_bits_of_threads(&text, mode, 60);
    }
}

/// Sheets fall on each other, with contacts at several times their spacing: more candidates than there is room for.
#[test]
fn threads_give_the_same_bits_where_contacts_are_left_out() {
    for (mode, spacing) in [("particles", 0.012), ("surfaces", 0.005)] {
        let mut text = format!(
            "version = 1\n[solver]\nrate_hz = 60\nsubsteps = 4\n[contact]\nmode = \"{mode}\"\n\
             thickness = 0.02\n[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\n"
        );
        for sheet in 0..16 {
            let height = 0.03 + spacing * f64::from(sheet);
            text += &format!(
                "[[generate]]\nshape = \"cloth\"\ncolumns = 12\nrows = 12\nspacing = 0.01\n\
                 pinned = \"none\"\nmass = 0.001\norigin = [0.001, {height}, 0]\n\
                 right = [1, 0, 0]\ndown = [0, 0.01, 1]\n"
            );
        }
        assert_same_bits_of_threads(&text, mode, 4);
        let mut solver = Solver::new(&Scene::from_toml(&text, mode).unwrap());
        solver.set_threads(2);
        (0..4).for_each(|_| solver.step());
        assert!(solver.contact_overflow_count() > 0, "{mode}: all candidates had room");
    }
}

#[test]
fn threads_give_the_same_bits_on_large_sheets() {
    for (name, solver, generator) in VARIANTS {
        for (columns, rows) in [(70, 240), (300, 90)] {
            let name = format!("{name}, {columns} x {rows}");
            assert_same_bits_of_threads(&sheet(columns, rows, solver, generator), &name, 10);
        }
    }
}

/// A sheet and a graph of the same size fall on rough ground, which turns below them.
#[test]
fn threads_give_the_same_bits_on_a_mesh() {
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for place in 0..41 * 41 {
        let (column, row) = (place % 41, place / 41);
        let height = -0.002 * f64::from((7 * column + 3 * row) % 9);
        vertices.push([0.25 * f64::from(column) - 0.2, height, 0.25 * f64::from(row) - 0.2]);
        if column < 40 && row < 40 {
            faces.push([place, place + 41, place + 42, place + 1]);
        }
    }
    let ground = format!(
        "[[collider]]\nshape = \"mesh\"\nvertices = {vertices:?}\nfaces = {faces:?}\n\
         center = [0, -0.001, 0]\nangular_velocity = [0.01, 0.1, 0]\nfriction = 0.4\n"
    );
    let text = sheet(180, 180, "substeps = 2", LINKS) + &ground;
    assert_same_bits_of_threads(&text, "rows", 10);
    let sewn = format!("{text}[[constraint]]\nparticles = [500, 900]\n");
    assert_same_bits_of_threads(&sewn, "graph", 10);
}

/// A sheet and a graph of the same size start in a block, which turns.
#[test]
fn threads_give_the_same_bits_in_a_solid_mesh() {
    let block = "[[collider]]\nshape = \"mesh\"\ncenter = [4, 0.01, 4]\nfriction = 0.4\nsolid = true\n\
        angular_velocity = [0.01, 0.1, 0]\nvertices = [[-3, -1, -3], [3, -1, -3], [3, -1, 3], [-3, -1, 3], [0, 1, 0]]\n\
        faces = [[0, 1, 2, 3], [1, 0, 4], [2, 1, 4], [3, 2, 4], [0, 3, 4]]\n";
    let text = sheet(180, 180, "substeps = 2", LINKS) + block;
    assert_same_bits_of_threads(&text, "rows", 10);
    let sewn = format!("{text}[[constraint]]\nparticles = [500, 900]\n");
    assert_same_bits_of_threads(&sewn, "graph", 10);
}

#[test]
fn threads_give_the_same_bits_on_large_graphs() {
    // A constraint from each of two sheets to the other turns both into a graph.
    for (name, solver, generator) in VARIANTS {
        let text = sheet(150, 140, solver, generator);
        let sewn = format!("{text}[[constraint]]\nparticles = [500, 900]\n");
        assert_same_bits_of_threads(&sewn, name, 6);
    }
}

#[test]
fn kernels_agree_after_parameters_have_changed() {
    let text = sheet(33, 17, "substeps = 2\ntethers = true", LINKS);
    let scene = Scene::from_toml(&text, "set").unwrap();
    let settings = [
        ("tear_force", ParameterValue::Number(30.0)),
        ("iterations", ParameterValue::Number(3.0)),
        ("compliance", ParameterValue::Number(1e-5)),
        ("max_stretch", ParameterValue::Number(1.1)),
        ("wind.drag", ParameterValue::Number(0.5)),
        ("substeps", ParameterValue::Number(4.0)),
        ("tear_force", ParameterValue::Off),
        ("compliance", ParameterValue::Number(0.0)),
    ];
    let mut hashes = Vec::new();
    for kernels in Kernels::available() {
        let mut solver = Solver::with_kernels(&scene, kernels);
        for (name, setting) in settings {
            solver.set(name, setting, None).unwrap();
            (0..10).for_each(|_| solver.step());
        }
        hashes.push(solver.state_hash());
    }
    assert!(hashes.windows(2).all(|two| two[0] == two[1]), "{hashes:x?}");
}

/// A particle that a tether pulls back from 2e8 m passes the sphere on a path that f32 rounds to 16 m.
#[test]
fn a_particle_that_returns_from_very_far_has_the_same_contacts_in_all_kernels() {
    let text = "version = 1\n[solver]\nrate_hz = 60\nsubsteps = 2\ntethers = true\nmax_stretch = 1.5\n\
        [[collider]]\nshape = \"sphere\"\ncenter = [0.2, 0.4, -0.3]\nradius = 0.2\n\
        velocity = [0, 0, 1]\nfriction = 0.4\n\
        [[anchor]]\nparticles = [0]\npath = [{ time = 0 }, { time = 0.1, translation = [0.1, 0, 0] }]\n\
        [[generate]]\nshape = \"cloth\"\ncolumns = 5\nrows = 4\nspacing = 0.1\norigin = [0, 1, 0]\n\
        mass = 0.01\nlinks = [\"structural\", \"shear\", \"bend\"]\npinned = [4]\n";
    let scene = Scene::from_toml(text, "far").unwrap();
    let start = Solver::new(&scene);
    for particle in 5..start.particle_count() {
        let mut particles = start.particles().to_vec();
        particles[particle].position = [0.0, -134_217_730.0, -199_019_710.0];
        let hashes: Vec<_> = Kernels::available()
            .map(|kernels| {
                let mut solver = Solver::with_kernels(&scene, kernels);
                solver.restore(&particles, &start.keyframe()).unwrap();
                [(); 3].map(|()| {
                    solver.step();
                    solver.state_hash()
                })
            })
            .collect();
        assert!(
            hashes.windows(2).all(|pair| pair[0] == pair[1]),
            "particle {particle}: {hashes:?}"
        );
    }
}
