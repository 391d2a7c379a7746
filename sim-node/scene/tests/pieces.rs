//! Long texts of scenes, which are parsed in pieces: they give the same scenes and the same errors as
//! short ones. The same text is read twice, with short and with long comments where it can be divided.

use sim_scene::scene::{Generator, Pinned, Shape};
use sim_scene::{Scene, SceneError, builtin};

use crate::scenes::EVERY_KEY;

/// Wrong scenes with their errors.
const CASES: &str = include_str!("errors.txt");
/// A comment that makes everything behind it a piece of its own, if it can be one.
const LONG: usize = 300_000;

/// Reads a text in which each `@` stands for a comment of a size.
fn read_with_comments(text: &str, size_bytes: usize) -> Result<Scene, SceneError> {
    let comment = format!("#{}\n", "-".repeat(size_bytes));
    Scene::from_toml(&text.replace('@', &comment), "f.toml")
}

/// Reads a text in pieces. Its result must be the one of the text as one piece.
fn read(text: &str) -> Result<Scene, SceneError> {
    let whole = read_with_comments(text, 1);
    assert_eq!(read_with_comments(text, LONG), whole, "{text}");
    whole
}

fn error(text: &str) -> String {
    read(text).unwrap_err().list()
}

/// Marks each header as the start of a piece.
fn divided(text: &str) -> String {
    let marked =
        |line| if str::starts_with(line, '[') { format!("@{line}") } else { line.to_owned() };
    text.split_inclusive('\n').map(marked).collect()
}

#[test]
fn every_scene_is_the_same_in_pieces() {
    let read_short = |text: &str| Scene::from_toml(text, "f.toml").unwrap();
    let complete = builtin::names().map(|name| read_short(builtin::text(name).unwrap()).to_toml());
    let every_key = EVERY_KEY.replace("        ", "");
    for text in complete.chain([read_short(&every_key).to_toml(), every_key]) {
        assert_eq!(read(&divided(&text)).unwrap(), read_short(&text));
    }
}

#[test]
fn every_wrong_scene_has_the_same_error_in_pieces() {
    let cases = CASES.split("\n\n").skip(1).map(|block| block.split_once("\n=> ").unwrap().0);
    for text in cases {
        assert!(read(&divided(&format!("version = 1\n{text}\n"))).is_err());
    }
}

#[test]
fn keys_of_different_pieces_must_differ() {
    for (text, expected) in [
        ("particle = []\n@[[particle]]\n", "f.toml:4: particle: occurs twice (allowed: once)"),
        ("solver.substeps = 2\n@[solver]\n", "f.toml:4: solver: occurs twice (allowed: once)"),
        ("@[solver]\n@[solver]\n", "f.toml:5: solver: occurs twice (allowed: once)"),
        ("@[wind]\n@[[particle]]\n@[wind]\n", "f.toml:7: wind: occurs twice (allowed: once)"),
        ("@[[particle]]\n@[particle]\n", "f.toml:5: particle: occurs twice (allowed: once)"),
        ("@[wind]\n@[[wind]]\n", "f.toml:5: wind: occurs twice (allowed: once)"),
    ] {
        assert_eq!(error(&format!("version = 1\n{text}")), expected);
    }
}

/// Four particles, and an anchor of three of them.
const ANCHOR: &str = "version = 1\n@[[generate]]\nshape = \"rope\"\ncount = 4\nfrom = [0, 0, 0]\n\
    to = [1, 0, 0]\n@[[anchor]]\nparticles = [@ 0, @ 1, @ 3]\n";

#[test]
fn a_word_in_the_place_of_a_list_does_not_take_the_list_of_a_later_quoted_key() {
    let text = "version = 1\n@[[generate]]\nshape = \"rope\"\ncount = 4\nfrom = [0, 0, 0]\nto = [1, 0, 0]\n\
        pinned = \"first\"\n[[anchor]]\nparticles = [1]\n\"path\" = [{ time = 0 },@ { time = 1 }]\n";
    assert_eq!(read(text).unwrap().anchors.len(), 1);
}

#[test]
fn an_anchor_can_be_divided_between_particles_and_points_of_its_path() {
    for path in [
        "path = [@ { time = 0 }, @ { time = 1 }, @ { time = 2, translation = [0, 1, 0] }, @]",
        "@[[anchor.path]]\ntime = 0\n@[[anchor.path]]\ntime = 1\n@[[anchor.path]]\ntime = 2\n\
         translation = [0, 1, 0]\n@[[particle]]\nposition = [2, 0, 0]\n@[[generate]]\n\
         shape = \"ragdoll\"\nheight = 1",
    ] {
        let scene = read(&format!("{ANCHOR}{path}\n")).unwrap();
        let anchor = &scene.anchors[0];
        assert_eq!(anchor.particles, [0, 1, 3]);
        let times: Vec<_> = anchor.path.iter().map(|point| point.time).collect();
        assert_eq!((times, anchor.path[2].translation), (vec![0.0, 1.0, 2.0], [0.0, 1.0, 0.0]));
    }
}

#[test]
fn tables_below_other_tables_are_read_in_any_order() {
    let text = "@[[particle]]\nposition = [2, 0, 0]\n@[[anchor.path]]\ntime = 0\n@[wind]\n\
                @[generate.compliance]\nshear = 1\n";
    let scene = read(&format!("{ANCHOR}{text}")).unwrap();
    assert_eq!((scene.particles.len(), scene.anchors[0].path.len()), (1, 1));
}

/// A mesh of two triangles.
const MESH: &str = "version = 1\n@[[generate]]\nshape = \"obj\"\n\
    vertices = [@ [0, 0, 0], @ [1, 0, 0], # ], [\n@ [1, 1, 0], @@ [0, 1, 0]@]\n\
    pinned = [@ 0, @ 3, @ 1,]\nfaces = [@ [0, 1, 2], @ [0, 2, 3]]\nmass = 0.5\n";

#[test]
fn a_mesh_can_be_divided_between_vertices_faces_and_pinned_vertices() {
    let ragdoll = "[[generate]]\nshape = \"ragdoll\"\nheight = 1\n";
    let scene = read(&format!("{MESH}{ragdoll}")).unwrap();
    let [Generator { shape: Shape::Obj(mesh), pinned, mass, .. }, other] =
        scene.generators.as_slice()
    else {
        panic!("{scene:?}")
    };
    let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    assert_eq!((mesh.vertices.as_slice(), *mass), (&vertices[..], 0.5));
    assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(*pinned, Pinned::List(vec![0, 1, 3]));
    assert!(matches!(other.shape, Shape::Ragdoll(_)));
}

#[test]
fn texture_coordinates_can_be_divided_like_vertices() {
    let details = "uvs = [@ [0, 0], @ [1, 0.5], [0, 1]]\nface_uvs = [@ [0, 1, 2], @ []]\n\
        [[generate.groups]]\nname = \"a\"\nfirst = 0\n[[generate.groups]]\nname = \"b\"\nfirst = 1\n";
    let ragdoll = "[[generate]]\nshape = \"ragdoll\"\nheight = 1\n";
    let scene = read(&format!("{MESH}{details}{ragdoll}")).unwrap();
    let Shape::Obj(mesh) = &scene.generators[0].shape else { panic!("{scene:?}") };
    assert_eq!(mesh.details.uvs, [[0.0, 0.0], [1.0, 0.5], [0.0, 1.0]]);
    assert_eq!(mesh.details.face_uvs, [vec![0, 1, 2], vec![]]);
    let names: Vec<_> =
        mesh.details.groups.iter().map(|run| (run.name.as_str(), run.first)).collect();
    assert_eq!(names, [("a", 0), ("b", 1)]);
    assert_eq!((mesh.vertices.len(), scene.generators.len()), (4, 2));
}

#[test]
fn a_mesh_of_a_collider_can_be_divided_between_vertices_and_faces() {
    let text = "version = 1\n@[[collider]]\nshape = \"sphere\"\ncenter = [0, 0, 0]\nradius = 1\n\
        @[[collider]]\nshape = \"mesh\"\n\
        vertices = [@ [0, 0, 0], @ [1, 0, 0], @ [1, 1, 0], @@ [0, 1, 0]@]\n\
        faces = [@ [0, 1, 2], @ [0, 2, 3]]\nfriction = 0.5\n\
        @[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\n";
    let scene = read(text).unwrap();
    let mesh = &scene.collider_meshes()[&1];
    assert_eq!((mesh.vertices.len(), scene.colliders.len()), (4, 3));
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(scene.colliders[1].friction, 0.5);
    let error = error(&text.replace("[0, 2, 3]", "[0, 2, true]"));
    let expected = "collider[1].faces: is true (allowed: a whole number)";
    assert_eq!(error.split_once(": ").unwrap().1, expected);
}

#[test]
fn errors_in_divided_tables_count_the_elements_of_earlier_pieces() {
    let anchor = |path: &str| format!("{ANCHOR}{path}\n");
    let mesh = |from: &str, to: &str| MESH.replacen(from, to, 1);
    for (text, expected) in [
        (mesh("[0, 1, 0]", "[0, 1]"), "generate[0].vertices: has 2 entries (allowed: 3 numbers)"),
        (
            mesh("[1, 0, 0]", "[1, 0, \"0\"]"),
            "generate[0].vertices: is the text \"0\" (allowed: a number)",
        ),
        (
            mesh("[1, 0, 0]", "[1, 0, 1e9]"),
            "generate[0].vertices: 1e9 is out of range (allowed: -1e7 to 1e7; put a greater distance into `origin`)",
        ),
        (mesh("[0, 2, 3]", "[0, 2, true]"), "generate[0].faces: is true (allowed: a whole number)"),
        (
            mesh("[0, 2, 3]", "[0, 2, 4]"),
            "generate[0].faces: face 1 is [0, 2, 4] (allowed: 3 or more different vertices below 4)",
        ),
        (mesh("3, @ 1,", "3, @ -1,"), "generate[0].pinned: -1 is out of range (allowed: 0 to 3)"),
        (mesh("0, @ 3,", "0, @ , 3,"), "syntax: extra comma in array (allowed: value)"),
        (
            mesh("[1, 0, 0], ", "[1, 0, 0] "),
            "syntax: missing comma between array elements (allowed: `,`)",
        ),
        (mesh("[0, 2, 3]]\nmass = 0.5", "[0, 2, 3]"), "syntax: unclosed array (allowed: `]`)"),
        (
            mesh("[0, 2, 3]]\n", "[0, 2, 3]\n"),
            "syntax: missing comma between array elements (allowed: `,`)",
        ),
        (mesh("mass = 0.5", "pinned = []"), "pinned: occurs twice (allowed: once)"),
        (
            anchor("path = [@ { time = 0 }, @ { time = 1 }, @ { time = 2, at = 2 }]"),
            "anchor[0].path[2].at: unknown key (allowed: time, translation, rotation)",
        ),
        (
            anchor("path = [@ { time = 0 }, @ { time = 1 }, @ { time = 1 }]"),
            "anchor[0].path[2].time: 1 is not after 1 (allowed: ascending times)",
        ),
        (
            anchor(
                "@[[anchor.path]]\ntime = 0\n@[[anchor.path]]\ntime = 1\n@[[anchor.path]]\ntime = []",
            ),
            "anchor[0].path[2].time: is a list (allowed: a number)",
        ),
        (
            anchor(
                "@[[anchor.path]]\ntime = 0\n@[[anchor.path]]\ntime = 1\n@[[anchor]]\nparticles = 1",
            ),
            "anchor[1].particles: is the number 1 (allowed: a list)",
        ),
        (
            anchor(
                "@[[anchor.path]]\ntime = 0\n@[[anchor.path]]\ntime = 1\n@[[generate]]\nshape = \"obj\"\npath = 1",
            ),
            "generate[1].path: is the number 1 (allowed: text in quotes)",
        ),
        (anchor("path = []\n@[[anchor.path]]\ntime = 0"), "path: occurs twice (allowed: once)"),
    ] {
        let error = error(&text);
        assert_eq!(error.split_once(": ").unwrap().1, expected, "{text}");
    }
}
