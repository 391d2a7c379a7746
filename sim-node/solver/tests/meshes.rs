//! Meshes from OBJ text: a plane, a ball and a tube like a sleeve become the cloth that they look
//! like; what is degenerate is named and left out.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use sim_solver::scene::Mesh;
use sim_solver::{Scene, SceneError, Solver};

/// A scene of one mesh.
fn scene_of(obj: &str, keys: &str) -> Result<Scene, SceneError> {
    let text = format!("version = 1\n[[generate]]\nshape = \"obj\"\npath = \"mesh.obj\"\n{keys}\n");
    let read = |path: &str| {
        assert_eq!(path, "mesh.obj");
        Ok(obj.to_owned())
    };
    Scene::from_toml_with_files(&text, "test.toml", &read)
}

/// A sheet of columns x rows vertices in quads, or in triangles.
fn plane(columns: usize, rows: usize, is_quads: bool) -> String {
    let mut text = String::new();
    for row in 0..rows {
        for column in 0..columns {
            text += &format!("v {} {} 0\n", column as f32 * 0.1, row as f32 * -0.1);
        }
    }
    for row in 1..rows {
        for column in 1..columns {
            let below = row * columns + column + 1;
            let above = below - columns;
            text += &if is_quads {
                format!("f {} {} {} {}\n", above - 1, below - 1, below, above)
            } else {
                format!("f {0} {1} {2}\nf {0} {2} {3}\n", above - 1, below - 1, below, above)
            };
        }
    }
    text
}

/// Rings of vertices around y: a ball where the radius follows a circle, a sleeve where it does not.
fn around(rings: usize, spokes: usize, radius: impl Fn(f64) -> f64) -> String {
    let mut text = String::new();
    for ring in 0..rings {
        let share = ring as f64 / (rings - 1) as f64;
        for spoke in 0..spokes {
            let angle = std::f64::consts::TAU * spoke as f64 / spokes as f64;
            let r = radius(share);
            text += &format!("v {} {} {}\n", r * angle.cos(), 1.0 - share, r * angle.sin());
        }
    }
    for ring in 1..rings {
        for spoke in 0..spokes {
            let next = (spoke + 1) % spokes;
            let (a, b) = ((ring - 1) * spokes + 1, ring * spokes + 1);
            text += &format!("f {} {} {} {}\n", a + spoke, a + next, b + next, b + spoke);
        }
    }
    text
}

fn assert_finite_for(scene: &Scene, steps: u32) {
    let mut solver = Solver::new(scene);
    for _ in 0..steps {
        solver.step();
    }
    assert_eq!(solver.frozen_count(), 0);
    let lengths = solver.constraints().map(|one| {
        let [a, b] = [one.a, one.b].map(|index| solver.particle(index as usize).position);
        let square: f32 = (0..3).map(|axis| (b[axis] - a[axis]).powi(2)).sum();
        square.sqrt() / one.rest_length
    });
    assert!(lengths.fold(0.0, f32::max) < 3.0, "it is torn out of its form");
}

#[test]
fn a_plane_of_quads_is_the_cloth_of_its_columns_and_rows() {
    let counts = scene_of(&plane(14, 12, true), "pinned = \"y > -0.05\"").unwrap().counts();
    assert_eq!((counts.particles, counts.pins, counts.triangles), (168, 14, 286));
    // Along the edges, both diagonals, over two cells.
    assert_eq!(counts.constraints, 310 + 286 + 284);
}

#[test]
fn a_plane_of_triangles_has_its_diagonals_as_edges_and_the_others_as_bends() {
    let counts = scene_of(&plane(5, 4, false), "").unwrap().counts();
    assert_eq!((counts.particles, counts.triangles), (20, 24));
    // Edges: 31 and 12 diagonals; each of the 24 inner edges has a bend, but 6 pairs of them meet.
    assert!(counts.constraints > 43 && counts.constraints <= 43 + 29, "{}", counts.constraints);
}

#[test]
fn mass_by_density_is_that_of_the_area() {
    let scene = scene_of(&plane(11, 11, true), "density = 0.3").unwrap();
    let solver = Solver::new(&scene);
    let mass: f64 =
        (0..121).map(|index| 1.0 / f64::from(solver.particle(index).inverse_mass)).sum();
    assert!((mass - 0.3).abs() < 1e-5, "{mass} kg on 1 m^2");
}

#[test]
fn planes_balls_and_sleeves_stay_finite() {
    let ball = around(9, 12, |share| 0.01 + 0.5 * (std::f64::consts::PI * share).sin());
    let sleeve = around(12, 16, |share| 0.3 - 0.1 * share);
    for (obj, keys) in [
        (plane(10, 8, false), "pinned = \"y > -0.05 and x < 0.05\""),
        (plane(10, 8, true), "pinned = [0, 9]\ncompliance = { bend = 1e-2 }"),
        (ball, "density = 0.2\ncompliance = { shear = 1e-3, bend = 1e-2 }"),
        (sleeve, "density = 0.2\npinned = \"y >= 1\"\ncompliance = { bend = 1e-2 }"),
    ] {
        let scene = scene_of(&obj, keys).unwrap();
        assert_eq!(scene.findings, Vec::<String>::new());
        assert_finite_for(&scene, 10_000);
    }
}

#[test]
fn degenerate_meshes_are_named_and_what_is_left_stays_finite() {
    let plane = plane(4, 4, true);
    for (extra, finding) in [
        ("v 9 9 9\nv 8 8 8\n", "2 vertices belong to no face: left out"),
        ("f 1 2 6 5\n", "1 faces stand twice, the first is face 10: left out"),
        ("f 1 2 3\n", "1 faces have no area, the first is face 10: left out"),
        ("v 0.1 0 0.3\nf 1 2 17\n", "1 edges have more than two faces: no bends across them"),
        ("v 0.5 0.5 0\nv 0.6 0.6 0\nv 0.7 0.5 0\nv 0.6 0.3 0\nf 4 17 18 19 20\n", ""),
    ] {
        // The fourth adds a third face to an edge that has one: give it a second one first.
        let extra = if finding.contains("edges") {
            "v 0.1 0 0.3\nv 0.1 0 -0.3\nf 1 2 17\nf 1 2 18\n"
        } else {
            extra
        };
        let scene = scene_of(&format!("{plane}{extra}"), "pinned = \"y > -0.05\"").unwrap();
        let found: Vec<_> =
            scene.findings.iter().map(|one| one.trim_start_matches("mesh.obj: ")).collect();
        assert_eq!(found, if finding.is_empty() { vec![] } else { vec![finding] });
        assert!(scene.warnings().iter().any(|one| one.contains(finding)) || finding.is_empty());
        assert_finite_for(&scene, 10_000);
    }
}

#[test]
fn corners_can_be_counted_back_and_have_textures_and_normals() {
    let text = "# made by hand\nv 0 0 0\nv 1 0 0 1.0\nv 0 1 0\nvt 0 0\nvn 0 0 1\ns off\nf -3/1/1 -2//1 -1/1\n";
    let read = Mesh::from_obj(text).unwrap();
    assert_eq!((read.mesh.vertices.len(), read.mesh.faces), (3, vec![vec![0, 1, 2]]));
}

#[test]
fn groups_can_be_pinned() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\ng collar\nf 1 2 3\ng body\nf 2 3 4\n";
    let scene = scene_of(text, "pinned = \"group collar\"").unwrap();
    assert_eq!(scene.counts().pins, 3);
    let error = scene_of(text, "pinned = \"group hem\"").unwrap_err().to_string();
    assert!(error.contains("there is no group 'hem' (allowed: body, collar)"), "{error}");
}

#[test]
fn the_effective_text_needs_the_file_no_more() {
    let scene = scene_of(&plane(4, 3, true), "density = 0.2\npinned = \"x < 0.05\"").unwrap();
    let again = Scene::from_toml(&scene.to_toml(), "test").unwrap();
    assert_eq!(again, scene);
    assert_eq!(again.to_toml(), scene.to_toml());
}

#[test]
fn what_is_wrong_with_a_mesh_is_named_with_its_place() {
    for (obj, keys, expected) in [
        (
            "v 1 2\n",
            "",
            "test.toml:4: generate[0].path: mesh.obj: line 1: a vertex needs three finite",
        ),
        ("v 0 0 0\nf 1 2 3\n", "", "mesh.obj: line 2: there is no vertex 2 yet (allowed: 1 to 1)"),
        ("v 0 0 0\nv 1 0 0\nf 1 2\n", "", "line 3: a face of 2 corners (allowed: 3 or more)"),
        ("f a b c\n", "", "line 1: 'a' is no corner of a face"),
        ("", "", "it has no face with an area (allowed: a readable OBJ file)"),
        ("v nan 0 0\n", "", "line 1: a vertex needs three finite numbers"),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "density = 0",
            "generate[0].density: 0 is out of range",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "pinned = \"w > 3\"",
            "'w > 3' is no choice of vertices",
        ),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "rows = 3", "rows: unknown field of a obj"),
    ] {
        let error = scene_of(obj, keys).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}\n  instead of\n{expected}");
    }
    let text = "version = 1\n[[generate]]\nshape = \"obj\"\npath = \"mesh.obj\"\n";
    let error = Scene::from_toml(text, "x.toml").unwrap_err().to_string();
    assert!(error.contains("no files can be read here"), "{error}");
    let text =
        "version = 1\n[[generate]]\nshape = \"obj\"\nvertices = [[0, 0, 0]]\nfaces = [[0, 1, 2]]\n";
    let error = Scene::from_toml(text, "x.toml").unwrap_err().to_string();
    assert!(error.contains("face 0 is none"), "{error}");
}
