//! The meshes of colliders: what contacts need, and refuse.

use super::definition::collider::ColliderMesh;
use super::document::{Value, ValueNode};
use super::fields::Reader;
use crate::checks::is_near;
use crate::collider_mesh::{SolidFlaw, find_flaw, remove_collapsed, remove_slivers};

/// Checks the mesh of a collider, and omits slivers. `table` is the table of the collider.
pub(super) fn check(
    reader: &Reader<'_>,
    index: usize,
    table: &ValueNode<'_>,
    mesh: &mut ColliderMesh,
) {
    let collapsed_count = if mesh.is_solid { remove_collapsed(mesh) } else { 0 };
    let flaw = if mesh.is_solid { find_flaw(mesh) } else { None };
    let sliver_count = remove_slivers(mesh);
    if let Some(far) = mesh.vertices.iter().find(|vertex| !is_near(*vertex)) {
        let problem = format!("reach {far:?} (allowed: -1e7 to 1e7)");
        return wrong_list(reader, index, table, "vertices", &problem);
    }
    if mesh.triangles.is_empty() {
        let problem = "have no triangle with an area (allowed: at least one)";
        return wrong_list(reader, index, table, "faces", problem);
    }
    if let Some(problem) = solid_problem(flaw, sliver_count).filter(|_| mesh.is_solid) {
        let file = file(table).map(|(_, _, name)| format!("{name}: ")).unwrap_or_default();
        let problem = format!(
            "{file}{problem} (allowed: false, or a closed mesh of consistent winding; vertices at the same position are \
             one)"
        );
        let start = table.get("solid").unwrap_or(table).start;
        reader.problems.add(start as usize, &format!("collider[{index}].solid"), problem);
    }
    let sliver_count = sliver_count + collapsed_count;
    if sliver_count > 0 {
        let triangles = if sliver_count == 1 { "triangle is" } else { "triangles are" };
        reader.warnings.borrow_mut().push(format!(
            "collider[{index}]: {sliver_count} {triangles} too narrow for a contact and omitted"
        ));
    }
}

/// Returns what is wrong with a solid whose triangles do not enclose it.
fn solid_problem(flaw: Option<SolidFlaw>, sliver_count: usize) -> Option<String> {
    Some(match flaw {
        Some(SolidFlaw::OpenEdge { ends: [from, to], counts: [forth, back] }) => {
            let cause = match forth + back {
                1 => "belongs to one triangle only".to_owned(),
                2 => "joins two triangles of opposite winding".to_owned(),
                count => format!("belongs to {count} triangles"),
            };
            format!("the mesh is not closed: the edge from {from:?} to {to:?} {cause}")
        }
        Some(SolidFlaw::Flat(vertex)) => {
            format!("the part of the mesh with the vertex {vertex:?} encloses no volume")
        }
        Some(SolidFlaw::Reversed(vertex)) => format!(
            "the part of the mesh with the vertex {vertex:?} faces inwards and another part outwards, or the \
             other way round"
        ),
        None if sliver_count > 0 => format!(
            "{sliver_count} of its triangles are too narrow for a contact; merge their vertices"
        ),
        None => return None,
    })
}

/// Reports a wrong mesh at its file, or at a list of a mesh that is written out.
fn wrong_list(reader: &Reader<'_>, index: usize, table: &ValueNode<'_>, list: &str, problem: &str) {
    let (key, start, problem) = match file(table) {
        Some((key, start, name)) => (key, start, format!("{name}: its {list} {problem}")),
        None => (list, table.get(list).unwrap_or(table).start, problem.to_owned()),
    };
    reader.problems.add(start as usize, &format!("collider[{index}].{key}"), problem);
}

/// The key, the place and the name of the file of a mesh.
fn file<'t>(table: &'t ValueNode<'_>) -> Option<(&'static str, u32, &'t str)> {
    ["file", "path"].into_iter().find_map(|key| match table.get(key) {
        Some(ValueNode { start, value: Value::Text(name), .. }) => Some((key, *start, &**name)),
        _ => None,
    })
}
