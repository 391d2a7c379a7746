//! Warnings about generators and anchors.

use std::collections::HashSet;

use glam::Vec3;
use sim_scene::scene::{Generator, Pinned, Scene, Shape};

/// Sine of the smallest angle between the sides of a sheet.
const SINE_MIN: f64 = 1e-6;

/// Warns of ropes and bridges whose ends coincide.
pub(super) fn without_length(scene: &Scene) -> Option<String> {
    let (index, name) = scene.generators.iter().enumerate().find_map(|(index, one)| {
        let (name, from, to) = match &one.shape {
            Shape::Rope(rope) => ("rope", rope.from, rope.to),
            Shape::Bridge(bridge) => ("bridge", bridge.from, bridge.to),
            _ => return None,
        };
        (from == to).then_some((index, name))
    })?;
    Some(format!(
        "generate[{index}]: the {name} has no length, because from and to are equal: all of its \
         constraints keep their ends together"
    ))
}

/// Warns of sheets whose rows and columns have one direction.
pub(super) fn on_a_line(scene: &Scene) -> Vec<String> {
    let sentence = |(index, generator): (usize, &Generator)| {
        let (right, down) = match &generator.shape {
            Shape::Cloth(cloth) if cloth.columns > 1 && cloth.rows > 1 => (cloth.right, cloth.down),
            _ => return None,
        };
        let [right, down] = [right, down].map(|vector| Vec3::from_array(vector).as_dvec3());
        let area = right.cross(down).length();
        (area <= SINE_MIN * right.length() * down.length()).then(|| {
            format!(
                "generate[{index}]: right and down are parallel, or one of them is zero, so all particles of the sheet \
                 are on one line"
            )
        })
    };
    scene.generators.iter().enumerate().filter_map(sentence).collect()
}

/// Warns of empty lists of particles. The reader warns of expressions that no vertex of a mesh matches.
pub(super) fn without_pins(scene: &Scene) -> Vec<String> {
    let matches_none = |one: &Generator| one.pinned == Pinned::List(Vec::new());
    let generators = scene.generators.iter().enumerate().filter(|(_, one)| matches_none(one));
    let anchors = scene.anchors.iter().enumerate().filter(|(_, one)| one.particles.is_empty());
    generators
        .map(|(index, _)| format!("generate[{index}].pinned matches no particle of the shape"))
        .chain(anchors.map(|(index, _)| format!("anchor[{index}].particles is empty")))
        .collect()
}

/// Warns of meshes whose faces have vertices of their own where they meet.
pub(super) fn loose_faces(scene: &Scene) -> Vec<String> {
    let sentence = |(index, generator): (usize, &Generator)| {
        let Shape::Obj(mesh) = &generator.shape else { return None };
        let bits = |vertex: &[f32; 3]| vertex.map(|axis| (axis + 0.0).to_bits());
        let places: HashSet<_> = mesh.vertices.iter().map(bits).collect();
        let (count, all) = (mesh.vertices.len() - places.len(), mesh.vertices.len());
        (count > 0).then(|| {
            format!(
                "generate[{index}]: {count} of its {all} particles start where another one does, and nothing holds them \
                 together: the faces of the mesh do not share these vertices; merge them where the mesh was made (in \
                 Blender: Mesh, Merge, By Distance)"
            )
        })
    };
    scene.generators.iter().enumerate().filter_map(sentence).collect()
}
