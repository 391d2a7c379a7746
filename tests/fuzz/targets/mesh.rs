//! Meshes: a parsed one keeps the promises of its type, prints as OBJ that reads back the same, and
//! becomes a scene or an error.
#![no_main]

use std::fmt::Write;

use libfuzzer_sys::fuzz_target;
use sim_solver::Scene;
use sim_solver::scene::{Mesh, NameRun};

const SCENE: &str = "version = 1\n[[generate]]\nshape = \"obj\"\npath = \"mesh.obj\"\n";

fuzz_target!(|text: &str| {
    let read_file = |_: &str| Ok(text.to_owned());
    let scene = Scene::from_toml_with_files(SCENE, "scene.toml", &read_file);
    let Ok(parsed) = Mesh::from_obj(text) else {
        assert!(scene.is_err());
        return;
    };
    check(&parsed.mesh);
    let again = Mesh::from_obj(&obj(&parsed.mesh)).expect("a printed mesh is valid").mesh;
    assert_eq!((&again.vertices, &again.faces), (&parsed.mesh.vertices, &parsed.mesh.faces));
    assert_eq!(again.details, parsed.mesh.details);
    if let Ok(scene) = scene {
        let again =
            Scene::from_toml(&scene.to_toml(), "scene.toml").expect("a printed scene is valid");
        assert_eq!(Scene { read_warnings: scene.read_warnings.clone(), ..again }, scene);
    }
});

fn check(mesh: &Mesh) {
    let count = mesh.vertices.len();
    let mut is_used = vec![false; count];
    for face in &mesh.faces {
        let mut corners = face.clone();
        corners.sort_unstable();
        corners.dedup();
        assert!(corners.len() == face.len() && face.len() >= 3);
        corners.iter().for_each(|corner| is_used[*corner as usize] = true);
    }
    assert!(is_used.iter().all(|is_used| *is_used));
    assert!(mesh.vertices.iter().flatten().all(|axis| axis.is_finite()));
    for members in mesh.groups.values() {
        assert!(members.is_sorted() && members.iter().all(|member| (*member as usize) < count));
    }
}

/// Prints a mesh with the details of its faces.
fn obj(mesh: &Mesh) -> String {
    let mut text = String::new();
    for [x, y, z] in &mesh.vertices {
        _ = writeln!(text, "v {x} {y} {z}");
    }
    let details = &mesh.details;
    for [u, v] in &details.uvs {
        _ = writeln!(text, "vt {u} {v}");
    }
    for (index, face) in mesh.faces.iter().enumerate() {
        let name = |runs| NameRun::of_face(runs, index).unwrap_or_default();
        _ = writeln!(text, "g {}\nusemtl {}", name(&details.groups), name(&details.materials));
        let uvs = match details.face_uvs.get(index) {
            Some(uvs) => uvs.as_slice(),
            None if details.uvs.is_empty() => &[],
            None => face,
        };
        let corner = |(place, corner): (usize, &u32)| match uvs.get(place) {
            Some(uv) => format!("{}/{}", corner + 1, uv + 1),
            None => (corner + 1).to_string(),
        };
        let corners: Vec<_> = face.iter().enumerate().map(corner).collect();
        _ = writeln!(text, "f {}", corners.join(" "));
    }
    text
}
