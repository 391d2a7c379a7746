//! Meshes from Wavefront OBJ text. Vertices, faces and groups are read; everything else is ignored.

pub(super) mod pins;

use std::collections::{BTreeMap, BTreeSet};

/// Vertices and the faces between them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Positions. Each vertex belongs to a face.
    pub vertices: Vec<[f32; 3]>,
    /// Corners of each face in order: at least 3 different vertices.
    pub faces: Vec<Vec<u32>>,
    /// Vertices of each group and object, ascending.
    pub groups: BTreeMap<String, Vec<u32>>,
}

/// A parsed mesh with warnings.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ParsedMesh {
    /// The part of the mesh that can be simulated.
    pub mesh: Mesh,
    /// Faces and vertices that were omitted, and doubtful edges: one sentence each.
    pub warnings: Vec<String>,
}

impl Mesh {
    /// Parses OBJ text. Faces without area, duplicate faces and vertices without a face are omitted,
    /// with a warning.
    ///
    /// # Errors
    /// A vertex or face is malformed, or the text has no face with an area. The text names the line.
    pub fn from_obj(text: &str) -> Result<ParsedMesh, String> {
        let mut parsed = Self::surface_from_obj(text)?;
        let crowded = crowded_edges(parsed.mesh.faces.iter().map(Vec::as_slice));
        parsed.warnings.extend(match crowded {
            0 => None,
            1 => Some("1 edge has more than two faces and gets no bends".to_owned()),
            n => Some(format!("{n} edges have more than two faces and get no bends")),
        });
        Ok(parsed)
    }

    /// Like [`Self::from_obj`], for a mesh whose edges do not matter.
    pub(crate) fn surface_from_obj(text: &str) -> Result<ParsedMesh, String> {
        let mut raw = RawMesh::default();
        for (number, line) in (1..).zip(text.lines()) {
            raw.read_line(line).map_err(|problem| format!("line {number}: {problem}"))?;
        }
        raw.into_mesh()
    }
}

/// All vertices and faces of the text.
#[derive(Debug, Default)]
struct RawMesh {
    vertices: Vec<[f32; 3]>,
    faces: Vec<Vec<u32>>,
    /// By face: its group.
    groups: Vec<String>,
    /// Group of the faces that follow.
    group: String,
}

impl RawMesh {
    fn read_line(&mut self, line: &str) -> Result<(), String> {
        let line = line.split('#').next().unwrap_or_default();
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => self.vertices.push(vertex(words)?),
            Some("f") => {
                let corners: Result<Vec<_>, _> = words.map(|word| self.corner(word)).collect();
                let corners = corners?;
                if corners.len() < 3 {
                    return Err(format!(
                        "a face has {} corners (allowed: 3 or more)",
                        corners.len()
                    ));
                }
                self.faces.push(corners);
                self.groups.push(self.group.clone());
            }
            Some("g" | "o") => self.group = words.collect::<Vec<_>>().join(" "),
            _ => {}
        }
        Ok(())
    }

    /// Returns the vertex index of `7`, `7/1`, `7//2` or `7/1/2`. Negative numbers count back from
    /// the last vertex.
    fn corner(&self, word: &str) -> Result<u32, String> {
        let number = word.split('/').next().unwrap_or_default();
        let number: i64 = number.parse().map_err(|_| {
            format!("'{word}' is not a corner of a face (allowed: the number of a vertex)")
        })?;
        let count = i64::try_from(self.vertices.len()).unwrap_or(i64::MAX);
        let index = if number < 0 { count + number } else { number - 1 };
        if (0..count).contains(&index) {
            u32::try_from(index).map_err(|_| "too many vertices".to_owned())
        } else {
            Err(format!("vertex {number} is not defined before this line (allowed: 1 to {count})"))
        }
    }

    /// Omits everything that cannot be simulated, with warnings.
    fn into_mesh(self) -> Result<ParsedMesh, String> {
        let mut omitted = Omissions::default();
        let mut seen = BTreeSet::new();
        let mut kept = Vec::new();
        for (number, (face, group)) in (1..).zip(self.faces.iter().zip(&self.groups)) {
            let mut sorted = face.clone();
            sorted.sort_unstable();
            if sorted.windows(2).any(|pair| pair[0] == pair[1]) || self.is_flat(face) {
                omitted.flat.push(number);
            } else if seen.insert(sorted) {
                kept.push((face, group));
            } else {
                omitted.duplicate.push(number);
            }
        }
        if kept.is_empty() {
            return Err("the mesh has no face with an area (allowed: at least one)".to_owned());
        }
        let used: BTreeSet<u32> = kept.iter().flat_map(|(face, _)| face.iter().copied()).collect();
        omitted.unused = self.vertices.len() - used.len();
        let new_index: BTreeMap<u32, u32> = used.iter().copied().zip(0..).collect();
        let mut mesh = Mesh::default();
        mesh.vertices.extend(used.iter().map(|index| self.vertices[*index as usize]));
        for (face, group) in kept {
            let face: Vec<_> = face.iter().map(|index| new_index[index]).collect();
            mesh.groups.entry(group.clone()).or_default().extend(&face);
            mesh.faces.push(face);
        }
        for members in mesh.groups.values_mut() {
            members.sort_unstable();
            members.dedup();
        }
        Ok(ParsedMesh { mesh, warnings: omitted.sentences() })
    }

    fn is_flat(&self, face: &[u32]) -> bool {
        let corner = |index: u32| self.vertices[index as usize].map(f64::from);
        fan(face).map(|triangle| area(triangle.map(corner))).sum::<f64>() == 0.0
    }
}

fn vertex<'a>(words: impl Iterator<Item = &'a str>) -> Result<[f32; 3], String> {
    let numbers: Result<Vec<f32>, _> = words.take(3).map(str::parse).collect();
    match numbers.ok().as_deref() {
        Some([x, y, z]) if [x, y, z].iter().all(|axis| axis.is_finite()) => Ok([*x, *y, *z]),
        _ => Err("a vertex is malformed (allowed: three finite numbers)".to_owned()),
    }
}

/// Splits a face into triangles from its first corner.
pub(super) fn fan(face: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    (1..face.len() - 1).map(|corner| [face[0], face[corner], face[corner + 1]])
}

/// Returns the area of a triangle.
pub(super) fn area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let side = |to: [f64; 3]| [to[0] - a[0], to[1] - a[1], to[2] - a[2]];
    let (u, v) = (side(b), side(c));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    (cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]).sqrt() / 2.0
}

/// Returns the edges of a face, each from the lower to the higher vertex.
pub(super) fn edges(face: &[u32]) -> impl Iterator<Item = [u32; 2]> + '_ {
    (0..face.len()).map(|corner| {
        let (a, b) = (face[corner], face[(corner + 1) % face.len()]);
        if a < b { [a, b] } else { [b, a] }
    })
}

/// Counts the edges with more than two faces.
fn crowded_edges<'a>(faces: impl Iterator<Item = &'a [u32]>) -> usize {
    let mut counts = BTreeMap::new();
    for edge in faces.flat_map(edges) {
        *counts.entry(edge).or_insert(0_u32) += 1;
    }
    counts.values().filter(|count| **count > 2).count()
}

/// Omitted parts of a mesh.
#[derive(Debug, Default)]
struct Omissions {
    /// Faces without area, numbered from 1.
    flat: Vec<usize>,
    /// Faces with the corners of an earlier one, numbered from 1.
    duplicate: Vec<usize>,
    /// Number of vertices without a face.
    unused: usize,
}

impl Omissions {
    fn sentences(&self) -> Vec<String> {
        let first = |faces: &[usize]| faces.first().map_or(0, |first| *first);
        let (flat, duplicate) = (first(&self.flat), first(&self.duplicate));
        let sentences = [
            match self.flat.len() {
                0 => None,
                1 => Some(format!("face {flat} has no area and is omitted")),
                n => Some(format!(
                    "{n} faces have no area and are omitted; the first is face {flat}"
                )),
            },
            match self.duplicate.len() {
                0 => None,
                1 => Some(format!("face {duplicate} is a duplicate and is omitted")),
                n => Some(format!(
                    "{n} faces are duplicates and are omitted; the first is face {duplicate}"
                )),
            },
            match self.unused {
                0 => None,
                1 => Some("1 vertex belongs to no face and is omitted".to_owned()),
                n => Some(format!("{n} vertices belong to no face and are omitted")),
            },
        ];
        sentences.into_iter().flatten().collect()
    }
}
