//! The colliders of a scene, for programs that read a recording without its scene.

use std::fmt::Write;

use sim_contract::PlainF32;
use sim_solver::Scene;
use sim_solver::scene::{ColliderMesh, SceneCollider};
use xxhash_rust::xxh3::xxh3_64;

use super::colliders::{ColliderBodyRow, ColliderDetails};

/// The meshes and details of the colliders of a scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SceneColliders {
    /// The meshes, each once.
    pub files: Vec<MeshFile>,
    /// By collider.
    pub details: Vec<ColliderDetails>,
}

/// A mesh as an OBJ file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MeshFile {
    /// The XXH3-64 of the text as 16 hex digits, and `.obj`.
    pub name: String,
    /// Vertices relative to the center of the collider and before its rotation, with the scale applied, and faces.
    pub text: String,
}

impl SceneColliders {
    /// Returns those of a scene.
    pub fn new(scene: &Scene) -> Self {
        let mut all = Self::default();
        for collider in &scene.colliders {
            let path = collider.mesh.as_ref().map(|mesh| all.add(mesh));
            all.details.push(details(collider, path));
        }
        all
    }

    /// Adds a mesh, unless it is there. Returns the name of its file.
    fn add(&mut self, mesh: &ColliderMesh) -> String {
        let text = obj_text(mesh);
        let name = mesh_file_name(text.as_bytes());
        if self.files.iter().all(|file| file.name != name) {
            self.files.push(MeshFile { name: name.clone(), text });
        }
        name
    }
}

fn details(collider: &SceneCollider, path: Option<String>) -> ColliderDetails {
    ColliderDetails {
        path,
        solid: collider.mesh.as_ref().map(|mesh| mesh.is_solid),
        body: collider.body.map(|body| ColliderBodyRow {
            mass: PlainF32(body.mass),
            inertia: body.inertia.map(PlainF32),
        }),
    }
}

/// Returns the name of a mesh with this content.
pub(crate) fn mesh_file_name(content: &[u8]) -> String {
    format!("{:016x}.obj", xxh3_64(content))
}

fn obj_text(mesh: &ColliderMesh) -> String {
    let mut text = String::new();
    for [x, y, z] in &mesh.vertices {
        let _written = writeln!(text, "v {x} {y} {z}");
    }
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|corner| corner + 1);
        let _written = writeln!(text, "f {a} {b} {c}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_meshes_are_one_file_with_the_hash_of_its_content() {
        let collider = |center: &str, x: &str| {
            format!(
                "[[collider]]\nshape = \"mesh\"\ncenter = {center}\nscale = 2\n\
                 vertices = [[{x}, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\n"
            )
        };
        let text = format!(
            "version = 1\n{}{}{}",
            collider("[0, 0, 0]", "0.1"),
            collider("[0, 5, 0]", "0.1"),
            collider("[0, 9, 0]", "0.2")
        );
        let scene = Scene::from_toml(&text, "test").unwrap();
        let SceneColliders { files, details } = SceneColliders::new(&scene);
        let texts: Vec<_> = files.iter().map(|file| file.text.as_str()).collect();
        assert_eq!(
            texts,
            ["v 0.2 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\n", "v 0.4 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\n"]
        );
        for file in &files {
            assert_eq!(file.name, format!("{:016x}.obj", xxh3_64(file.text.as_bytes())));
        }
        let paths: Vec<_> = details.iter().map(|one| one.path.as_deref()).collect();
        let [first, second] = [&files[0], &files[1]].map(|file| Some(file.name.as_str()));
        assert_eq!(paths, [first, first, second]);
        let empty = Scene::from_toml("version = 1", "test").unwrap();
        assert_eq!(SceneColliders::new(&empty), SceneColliders::default());
    }
}
