//! The meshes of a scene as files, for other programs. The scene itself has them, too.

use std::fmt::Write;

use sim_solver::Scene;
use sim_solver::scene::ColliderMesh;
use xxhash_rust::xxh3::xxh3_64;

/// A mesh as an OBJ file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MeshFile {
    /// The XXH3-64 of the text as 16 hex digits, and `.obj`.
    pub name: String,
    /// Vertices relative to the center of the collider and before its rotation, with the scale applied, and faces.
    pub text: String,
}

/// Returns the meshes of the colliders, each once.
pub fn mesh_files(scene: &Scene) -> Vec<MeshFile> {
    let mut files: Vec<MeshFile> = Vec::new();
    for mesh in scene.collider_meshes().values() {
        let text = obj_text(mesh);
        let name = mesh_file_name(text.as_bytes());
        if files.iter().all(|file| file.name != name) {
            files.push(MeshFile { name, text });
        }
    }
    files
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
        let files = mesh_files(&scene);
        let texts: Vec<_> = files.iter().map(|file| file.text.as_str()).collect();
        assert_eq!(
            texts,
            ["v 0.2 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\n", "v 0.4 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\n"]
        );
        for file in &files {
            assert_eq!(file.name, format!("{:016x}.obj", xxh3_64(file.text.as_bytes())));
        }
        assert_eq!(mesh_files(&Scene::from_toml("version = 1", "test").unwrap()), []);
    }
}
