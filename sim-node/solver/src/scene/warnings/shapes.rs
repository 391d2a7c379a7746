//! Warnings about generators and anchors.

use crate::scene::definition::Scene;
use crate::scene::generate::pinned::Pinned;
use crate::scene::generate::{Generator, Shape};

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

/// Warns of lists and expressions for particles that match none.
pub(super) fn without_pins(scene: &Scene) -> Vec<String> {
    let matches_none = |one: &Generator| one.pinned == Pinned::List(Vec::new());
    let generators = scene.generators.iter().enumerate().filter(|(_, one)| matches_none(one));
    let anchors = scene.anchors.iter().enumerate().filter(|(_, one)| one.particles.is_empty());
    generators
        .map(|(index, _)| format!("generate[{index}].pinned matches no particle of the shape"))
        .chain(anchors.map(|(index, _)| format!("anchor[{index}].particles is empty")))
        .collect()
}
