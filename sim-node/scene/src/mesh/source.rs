//! The keys of a mesh in a table: its file, or its vertices and faces.

use super::{Mesh, ParsedMesh};
use crate::fields::{At, Fields, POSITION};

/// Reads the mesh of a table: the file that a key names, or the keys `vertices` and `faces`. `parse` reads the text of a
/// file.
pub(crate) fn read_mesh(
    fields: &mut Fields<'_>,
    file: &'static str,
    parse: fn(&str) -> Result<ParsedMesh, String>,
) -> Option<Mesh> {
    fields.reader()?;
    fields.get(file);
    match (fields.find(file), fields.find("vertices"), fields.find("faces")) {
        (Some(path), None, None) => mesh_of_file(path, parse),
        (None, Some(vertices), Some(faces)) => {
            let vertices = vertices.points(POSITION);
            let (vertices, faces) = (vertices?, faces.index_lists().map(|list| (list, faces)));
            let faces = faces.and_then(|(list, at)| checked_faces(at, list, vertices.len()));
            Some(Mesh { vertices, faces: faces?, ..Mesh::default() })
        }
        (None, Some(_), None) => {
            fields.require("faces", "lists of 3 or more vertices");
            None
        }
        _ => {
            let problem = "a mesh needs a path, or vertices and faces (allowed: either one)";
            fields.error(file, problem);
            None
        }
    }
}

fn mesh_of_file(path: At<'_>, parse: fn(&str) -> Result<ParsedMesh, String>) -> Option<Mesh> {
    let (reader, name) = (path.reader, path.quoted_text()?);
    match (reader.read_file)(name).and_then(|text| parse(&text)) {
        Ok(parsed) => {
            let warnings = parsed.warnings.iter().map(|warning| format!("{name}: {warning}"));
            reader.warnings.borrow_mut().extend(warnings);
            Some(parsed.mesh)
        }
        Err(problem) => path.error(format!("{name}: {problem}")),
    }
}

/// Returns the faces, if each has 3 or more different corners below `count`.
fn checked_faces(at: At<'_>, faces: Vec<Vec<u32>>, count: usize) -> Option<Vec<Vec<u32>>> {
    let is_right = |face: &Vec<u32>| {
        let mut sorted = face.clone();
        sorted.sort_unstable();
        sorted.dedup();
        let is_inside = sorted.last().is_some_and(|last| (*last as usize) < count);
        is_inside && sorted.len() == face.len() && face.len() >= 3
    };
    let Some(index) = faces.iter().position(|face| !is_right(face)) else { return Some(faces) };
    let face = at.element_text(index, &faces[index]);
    at.error(format!(
        "face {index} is {face} (allowed: 3 or more different vertices below {count})"
    ))
}
