//! Meshes from OBJ text: a plane, a sphere and a tube become cloth, or colliders; degenerate parts are
//! omitted with a warning.

use sim_solver::scene::{Mesh, NameRun};
use sim_solver::{Scene, SceneError, Solver};

/// Returns a scene with one mesh.
fn mesh_scene(obj: &str, keys: &str) -> Result<Scene, SceneError> {
    let text = format!("version = 1\n[[generate]]\nshape = \"obj\"\npath = \"mesh.obj\"\n{keys}\n");
    let read = |path: &str| {
        assert_eq!(path, "mesh.obj");
        Ok(obj.to_owned())
    };
    Scene::from_toml_with_files(&text, "test.toml", &read)
}

#[test]
fn faces_with_vertices_of_their_own_cause_a_warning() {
    // Two triangles of a quad; the corners that they share are there twice, one with a negative zero.
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 -0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 4 5 6\n";
    let warnings = sim_solver::warnings(&mesh_scene(obj, "").unwrap());
    let expected = "generate[0]: 2 of its 6 particles start where another one does";
    assert!(warnings.iter().any(|one| one.starts_with(expected)), "{warnings:?}");
    let whole = mesh_scene("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n", "").unwrap();
    assert!(!sim_solver::warnings(&whole).iter().any(|one| one.contains("another one")));
}

/// Faces of a sheet.
#[derive(Clone, Copy, PartialEq)]
enum Faces {
    Quads,
    Triangles,
}

/// Returns a sheet of columns x rows vertices.
fn plane(columns: usize, rows: usize, faces: Faces) -> String {
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
            text += &if faces == Faces::Quads {
                format!("f {} {} {} {}\n", above - 1, below - 1, below, above)
            } else {
                format!("f {0} {1} {2}\nf {0} {2} {3}\n", above - 1, below - 1, below, above)
            };
        }
    }
    text
}

/// Returns rings of vertices around y: a sphere where the radius follows a circle, else a tube.
fn rings_around_y(rings: usize, spokes: usize, radius: impl Fn(f64) -> f64) -> String {
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
    assert!(lengths.fold(0.0, f32::max) < 3.0, "the mesh has lost its form");
}

#[test]
fn a_plane_of_quads_is_the_cloth_of_its_columns_and_rows() {
    let counts =
        mesh_scene(&plane(14, 12, Faces::Quads), "pinned = \"y > -0.05\"").unwrap().counts();
    assert_eq!((counts.particles, counts.pins, counts.triangles), (168, 14, 286));
    // Edges, both diagonals, and bends over two cells.
    assert_eq!(counts.constraints, 310 + 286 + 284);
}

#[test]
fn a_plane_of_triangles_has_one_diagonal_as_edges_and_the_other_as_bends() {
    let counts = mesh_scene(&plane(5, 4, Faces::Triangles), "").unwrap().counts();
    assert_eq!((counts.particles, counts.triangles), (20, 24));
    // 31 edges and 12 diagonals. Each of the 24 inner edges has a bend, but 6 pairs of them coincide.
    assert!(counts.constraints > 43 && counts.constraints <= 43 + 29, "{}", counts.constraints);
}

#[test]
fn the_mass_by_density_is_proportional_to_the_area() {
    let scene = mesh_scene(&plane(11, 11, Faces::Quads), "density = 0.3").unwrap();
    let solver = Solver::new(&scene);
    let mass: f64 =
        (0..121).map(|index| 1.0 / f64::from(solver.particle(index).inverse_mass)).sum();
    assert!((mass - 0.3).abs() < 1e-5, "{mass} kg on 1 m^2");
}

#[test]
fn planes_spheres_and_tubes_stay_finite() {
    let sphere = rings_around_y(9, 12, |share| 0.01 + 0.5 * (std::f64::consts::PI * share).sin());
    let tube = rings_around_y(12, 16, |share| 0.3 - 0.1 * share);
    for (obj, keys) in [
        (plane(10, 8, Faces::Triangles), "pinned = \"y > -0.05 and x < 0.05\""),
        (plane(10, 8, Faces::Quads), "pinned = [0, 9]\ncompliance = { bend = 1e-2 }"),
        (sphere, "density = 0.2\ncompliance = { shear = 1e-3, bend = 1e-2 }"),
        (tube, "density = 0.2\npinned = \"y >= 1\"\ncompliance = { bend = 1e-2 }"),
    ] {
        let scene = mesh_scene(&obj, keys).unwrap();
        assert_eq!(scene.read_warnings, Vec::<String>::new());
        assert_finite_for(&scene, 10_000);
    }
}

#[test]
fn degenerate_parts_are_omitted_with_a_warning_and_the_rest_stays_finite() {
    let plane = plane(4, 4, Faces::Quads);
    for (extra, warning) in [
        ("v 9 9 9\nv 8 8 8\n", "2 vertices belong to no face and are omitted"),
        ("f 1 2 6 5\n", "face 10 is a duplicate and is omitted"),
        ("f 1 2 3\n", "face 10 has no area and is omitted"),
        ("v 0.1 0 0.3\nf 1 2 17\n", "1 edge has more than two faces and gets no bends"),
        ("v 0.5 0.5 0\nv 0.6 0.6 0\nv 0.7 0.5 0\nv 0.6 0.3 0\nf 4 17 18 19 20\n", ""),
    ] {
        // The fourth case needs an edge that has two faces already.
        let extra = if warning.contains("edge") {
            "v 0.1 0 0.3\nv 0.1 0 -0.3\nf 1 2 17\nf 1 2 18\n"
        } else {
            extra
        };
        let scene = mesh_scene(&format!("{plane}{extra}"), "pinned = \"y > -0.05\"").unwrap();
        let warnings: Vec<_> =
            scene.read_warnings.iter().map(|one| one.trim_start_matches("mesh.obj: ")).collect();
        assert_eq!(warnings, if warning.is_empty() { vec![] } else { vec![warning] });
        assert!(
            sim_solver::warnings(&scene).iter().any(|one| one.contains(warning))
                || warning.is_empty()
        );
        assert_finite_for(&scene, 10_000);
    }
}

#[test]
fn corners_may_be_negative_and_have_textures_and_normals() {
    let text = "# made by hand\nv 0 0 0\nv 1 0 0 1.0\nv 0 1 0\nvt 0 0\nvn 0 0 1\ns off\nf -3/1/1 -2//1 -1/1\n";
    let mesh = Mesh::from_obj(text).unwrap().mesh;
    assert_eq!((mesh.vertices.len(), mesh.faces), (3, vec![vec![0, 1, 2]]));
}

#[test]
fn groups_can_be_pinned() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\ng collar\nf 1 2 3\ng body\nf 2 3 4\n";
    let scene = mesh_scene(text, "pinned = \"group collar\"").unwrap();
    assert_eq!(scene.counts().pins, 3);
    let error = mesh_scene(text, "pinned = \"group hem\"").unwrap_err().to_string();
    assert!(error.contains("the mesh has no group 'hem' (allowed: body, collar)"), "{error}");
}

#[test]
fn a_mesh_can_be_placed_any_number_of_times_and_keeps_its_pins() {
    let block = "[[generate]]\nshape = \"obj\"\npath = \"mesh.obj\"\npinned = \"y < 1\"\n";
    // A quarter of a turn about z, twice the size, and moved; and the mesh as it is.
    let text = format!(
        "version = 1\n{block}scale = 2\nrotation = [0, 0, 1, 1]\norigin = [10, 0, -3]\n{block}"
    );
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let scene = Scene::from_toml_with_files(&text, "a", &|_| Ok(obj.to_owned())).unwrap();
    let solver = Solver::new(&scene);
    let particle = |index: usize| solver.particle(index);
    let positions: Vec<_> = (0..6).map(|index| particle(index).position).collect();
    assert_eq!(positions[3..], [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let placed = [[10.0, 0.0, -3.0], [10.0, 2.0, -3.0], [8.0, 0.0, -3.0]];
    for (found, expected) in positions.iter().zip(placed) {
        let is_near = |(found, expected): (&f32, f32)| (found - expected).abs() < 1e-6;
        assert!(found.iter().zip(expected).all(is_near), "{found:?} {expected:?}");
    }
    // The pins compare the scaled mesh before it is turned and moved.
    let pins: Vec<_> = (0..6).filter(|index| particle(*index).inverse_mass == 0.0).collect();
    assert_eq!(pins, [0, 1, 3, 4]);
    let again = Scene::from_toml(&scene.to_toml(), "a").unwrap();
    assert_eq!(again, scene);
    assert!(!scene.to_toml().contains("origin = [10"), "the printed mesh is placed already");
}

#[test]
fn pins_that_match_nothing_are_named_with_the_coordinates_of_the_mesh() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let keys = "origin = [10, 0, 0]\npinned = \"x > 5\"";
    let warnings = sim_solver::warnings(&mesh_scene(obj, keys).unwrap()).join("\n");
    let expected =
        "generate[0].pinned matches no particle of the shape (x 0 to 1, y 0 to 1, z 0 to 0)";
    assert_eq!(warnings, expected);
}

/// A quad and two triangles. The third face has no area, and the fourth no texture coordinates.
const DETAILED: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 2 0\nv 1 2 0\nvt 0 0\nvt 1 0\nvt 1 0.5\n\
    vt 0 0.5 0\nvt 9 9\nvt 0 nan\nusemtl cotton\ng front side\nf 1/1 2/2 3/3 4/4\ng back\n\
    f 4/-3 3/3/1 5/1\nf 1/1 2/2 1/1\nusemtl silk\nf 3 5 6\n";

#[test]
fn texture_coordinates_and_names_of_faces_are_kept() {
    let mesh = Mesh::from_obj(DETAILED).unwrap().mesh;
    assert_eq!(mesh.faces, [vec![0, 1, 2, 3], vec![3, 2, 4], vec![2, 4, 5]]);
    let details = &mesh.details;
    assert_eq!(
        details.uvs,
        [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.0, 0.5]],
        "unused ones are not"
    );
    assert_eq!(details.face_uvs, [vec![0, 1, 2, 3], vec![3, 2, 0], vec![]]);
    let names = |runs: &[NameRun], faces: &[usize]| -> Vec<Option<String>> {
        faces.iter().map(|face| NameRun::of_face(runs, *face).map(str::to_owned)).collect()
    };
    let some = |name: &str| Some(name.to_owned());
    assert_eq!(
        names(&details.groups, &[0, 1, 2]),
        [some("front side"), some("back"), some("back")]
    );
    assert_eq!(
        names(&details.materials, &[0, 1, 2]),
        [some("cotton"), some("cotton"), some("silk")]
    );
    let scene = mesh_scene(DETAILED, "").unwrap();
    let again = Scene::from_toml(&scene.to_toml(), "test").unwrap();
    assert_eq!(again.generators, scene.generators);
    assert_eq!(again.to_toml(), scene.to_toml());
}

#[test]
fn texture_coordinates_that_do_not_exist_are_omitted_with_a_warning() {
    let lost = |face: &str| {
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt x\n{face}\n");
        let parsed = Mesh::from_obj(&text).unwrap();
        assert_eq!(parsed.mesh.details.face_uvs.concat(), []);
        parsed.warnings
    };
    for face in ["f 1/1 2/1 3/9", "f 1/1 2/1 3/-9", "f 1/1 2/1 3/2", "f 1/0 2/1 3/1"] {
        let expected =
            "1 face refers to texture coordinates that are missing or not finite, and loses them";
        assert_eq!(lost(face), [expected], "{face}");
    }
    for face in ["f 1/1 2 3/1", "f 1 2 3"] {
        assert!(lost(face).is_empty(), "{face}");
    }
}

#[test]
fn a_group_for_each_face_is_omitted_with_a_warning_and_can_be_pinned() {
    let mut obj = String::from("usemtl silk\nv 0 0 0\nv 0 1 0\n");
    for face in 1..=10_001 {
        obj += &format!("v {face} 0 0\nv {face} 1 0\ng face{face}\n");
        let first = 2 * face - 1;
        obj += &format!("f {first} {} {} {}\n", first + 2, first + 3, first + 1);
    }
    let scene = mesh_scene(&obj, "pinned = \"group face7\"").unwrap();
    let warning = "mesh.obj: the faces change their group 10001 times, so the names are omitted (allowed: 10000)";
    assert_eq!(scene.read_warnings, [warning]);
    assert!(scene.to_toml().contains("silk"), "materials are kept");
    assert_eq!(scene.counts().pins, 4);
}

#[test]
fn names_that_make_the_text_too_long_are_omitted_with_a_warning() {
    let long = "m".repeat(17 << 20);
    let obj = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl {long}\nf 1 2 3\n");
    let scene = mesh_scene(&obj, "").unwrap();
    assert!(!scene.to_toml().contains("materials"));
    let warning =
        "texture coordinates, groups and materials are omitted, because the text of the scene";
    assert!(
        sim_solver::warnings(&scene).iter().any(|one| one.starts_with(warning)),
        "{:?}",
        sim_solver::warnings(&scene)
    );
}

#[test]
fn the_complete_text_of_a_scene_contains_its_mesh() {
    let scene =
        mesh_scene(&plane(4, 3, Faces::Quads), "density = 0.2\npinned = \"x < 0.05\"").unwrap();
    let again = Scene::from_toml(&scene.to_toml(), "test").unwrap();
    assert_eq!(again, scene);
    assert_eq!(again.to_toml(), scene.to_toml());
}

#[test]
fn errors_in_a_mesh_name_the_line_of_the_scene_and_of_the_mesh() {
    for (obj, keys, expected) in [
        (
            "v 1 2\n",
            "",
            "test.toml:4: generate[0].path: mesh.obj: line 1: a vertex is malformed (allowed: three finite numbers)",
        ),
        (
            "v 0 0 0\nf 1 2 3\n",
            "",
            "mesh.obj: line 2: vertex 2 is not defined before this line (allowed: 1 to 1)",
        ),
        ("v 0 0 0\nv 1 0 0\nf 1 2\n", "", "line 3: a face has 2 corners (allowed: 3 or more)"),
        (
            "f a b c\n",
            "",
            "line 1: 'a' is not a corner of a face (allowed: the number of a vertex)",
        ),
        ("", "", "mesh.obj: the mesh has no face with an area (allowed: at least one)"),
        ("v nan 0 0\n", "", "line 1: a vertex is malformed"),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "density = 0",
            "generate[0].density: 0 is out of range",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "pinned = \"w > 3\"",
            "'w > 3' is not an expression for vertices",
        ),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "rows = 3", "rows: unknown key of the shape obj"),
    ] {
        let error = mesh_scene(obj, keys).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}\n  instead of\n{expected}");
        assert!(error.matches("(allowed").count() <= 1, "{error}");
    }
    let text = "version = 1\n[[generate]]\nshape = \"obj\"\npath = \"mesh.obj\"\n";
    let error = Scene::from_toml(text, "x.toml").unwrap_err().to_string();
    assert!(error.contains("a scene without a file cannot name files"), "{error}");
    let text =
        "version = 1\n[[generate]]\nshape = \"obj\"\nvertices = [[0, 0, 0]]\nfaces = [[0, 1, 2]]\n";
    let error = Scene::from_toml(text, "x.toml").unwrap_err().to_string();
    assert!(error.contains("face 0 is [0, 1, 2]"), "{error}");
}

/// Returns a scene with a collider that is a mesh.
fn collider_scene(obj: &str, keys: &str) -> Result<Scene, SceneError> {
    let text =
        format!("version = 1\n[[collider]]\nshape = \"mesh\"\npath = \"mesh.obj\"\n{keys}\n");
    Scene::from_toml_with_files(&text, "test.toml", &|_| Ok(obj.to_owned()))
}

#[test]
fn the_complete_text_of_a_scene_contains_the_scaled_triangles_of_a_collider() {
    let keys = "scale = 0.1\ncenter = [1, 2, 3]\nrotation = [0, 1, 0, 1]\ndistance = 0.01\n\
        velocity = [1, 0, 0]\nangular_velocity = [0, 1, 0]\nfriction = 0.5";
    let scene = collider_scene(&plane(4, 3, Faces::Quads), keys).unwrap();
    let mesh = &scene.collider_meshes()[&0];
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (12, 12));
    assert_eq!(mesh.vertices[11], [0.3 * 0.1, -0.2 * 0.1, 0.0]);
    assert_eq!(mesh.triangles[..2], [[0, 4, 5], [0, 5, 1]]);
    let text = scene.to_toml();
    assert!(!text.contains("scale") && !text.contains("path"), "{text}");
    let again = Scene::from_toml(&text, "test").unwrap();
    assert_eq!(again, scene);
    assert_eq!(again.to_toml(), text);
}

#[test]
fn a_collider_names_what_is_wrong_in_its_file_and_omits_what_no_contact_can_use() {
    let error = collider_scene("v 1 2\n", "").unwrap_err().to_string();
    let expected = "test.toml:4: collider[0].path: mesh.obj: line 1: a vertex is malformed \
        (allowed: three finite numbers)";
    assert_eq!(error, expected);
    // The second face has no area, the third is a sliver, and the edge of three faces is no fault.
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nv 0.5 1e-7 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n\
        f 1 2 5\nf 1 2 6\n";
    let scene = collider_scene(obj, "").unwrap();
    assert_eq!(scene.collider_meshes()[&0].triangles, [[0, 1, 2], [0, 1, 4]]);
    let expected = [
        "mesh.obj: face 2 has no area and is omitted",
        "mesh.obj: 1 vertex belongs to no face and is omitted",
        "collider[0]: 1 triangle is too narrow for a contact and omitted",
    ];
    assert_eq!(scene.read_warnings, expected);
    let error = collider_scene("v 0 0 0\nv 1 0 0\nv 0.5 1e-7 0\nf 1 2 3\n", "").unwrap_err();
    let expected = "test.toml:4: collider[0].path: mesh.obj: its faces have no triangle with an \
        area (allowed: at least one)";
    assert_eq!(error.to_string(), expected);
}
