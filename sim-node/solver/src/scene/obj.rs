//! Meshes from Wavefront OBJ text: vertices, faces and groups; all else of the format is passed
//! over.

use std::collections::{BTreeMap, BTreeSet};

/// Points and the faces between them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Positions; each belongs to a face.
    pub vertices: Vec<[f32; 3]>,
    /// Corners in order, at least 3 each, none twice in a face.
    pub faces: Vec<Vec<u32>>,
    /// Vertices of the faces of each group and object, ascending.
    pub groups: BTreeMap<String, Vec<u32>>,
}

/// A mesh, and what was left out of it or is hardly meant so: a sentence each.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReadMesh {
    /// What can be simulated.
    pub mesh: Mesh,
    /// What was found in the text.
    pub findings: Vec<String>,
}

impl Mesh {
    /// Reads OBJ text. Faces without area, faces that stand twice and vertices of no face are left
    /// out and named.
    ///
    /// # Errors
    /// A line that is no vertex or face, or no face at all: the text says which line and why.
    pub fn from_obj(text: &str) -> Result<ReadMesh, String> {
        let mut raw = Raw::default();
        for (number, line) in (1..).zip(text.lines()) {
            raw.read_line(line).map_err(|problem| format!("line {number}: {problem}"))?;
        }
        raw.check()
    }
}

/// The faces of the text, with all of its vertices.
#[derive(Debug, Default)]
struct Raw {
    vertices: Vec<[f32; 3]>,
    faces: Vec<Vec<u32>>,
    /// Face by face: its group.
    groups: Vec<String>,
    group: String,
}

impl Raw {
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
                        "a face of {} corners (allowed: 3 or more)",
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

    /// The vertex of `7`, `7/1`, `7//2`, `7/1/2`, or counted back from the last one, `-1`.
    fn corner(&self, word: &str) -> Result<u32, String> {
        let number = word.split('/').next().unwrap_or_default();
        let number: i64 = number.parse().map_err(|_| format!("'{word}' is no corner of a face"))?;
        let count = i64::try_from(self.vertices.len()).unwrap_or(i64::MAX);
        let index = if number < 0 { count + number } else { number - 1 };
        if (0..count).contains(&index) {
            u32::try_from(index).map_err(|_| "too many vertices".to_owned())
        } else {
            Err(format!("there is no vertex {number} yet (allowed: 1 to {count})"))
        }
    }

    /// Leaves out what cannot be simulated, and says so.
    fn check(self) -> Result<ReadMesh, String> {
        let mut findings = Findings::default();
        let mut seen = BTreeSet::new();
        let mut kept = Vec::new();
        for (place, (face, group)) in (1..).zip(self.faces.iter().zip(&self.groups)) {
            let mut sorted = face.clone();
            sorted.sort_unstable();
            if sorted.windows(2).any(|pair| pair[0] == pair[1]) || self.is_flat(face) {
                findings.flat.push(place);
            } else if seen.insert(sorted) {
                kept.push((face, group));
            } else {
                findings.twice.push(place);
            }
        }
        if kept.is_empty() {
            return Err("it has no face with an area".to_owned());
        }
        let used: BTreeSet<u32> = kept.iter().flat_map(|(face, _)| face.iter().copied()).collect();
        findings.unused = self.vertices.len() - used.len();
        findings.crowded = crowded_edges(kept.iter().map(|(face, _)| face.as_slice()));
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
        Ok(ReadMesh { mesh, findings: findings.sentences() })
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
        _ => Err("a vertex needs three finite numbers".to_owned()),
    }
}

/// A face as triangles from its first corner.
pub(super) fn fan(face: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    (1..face.len() - 1).map(|corner| [face[0], face[corner], face[corner + 1]])
}

pub(super) fn area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let side = |to: [f64; 3]| [to[0] - a[0], to[1] - a[1], to[2] - a[2]];
    let (u, v) = (side(b), side(c));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    (cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]).sqrt() / 2.0
}

/// The edges of a face, each from its lower to its higher vertex.
pub(super) fn edges(face: &[u32]) -> impl Iterator<Item = [u32; 2]> + '_ {
    (0..face.len()).map(|corner| {
        let (a, b) = (face[corner], face[(corner + 1) % face.len()]);
        if a < b { [a, b] } else { [b, a] }
    })
}

/// How many edges have more than two faces.
fn crowded_edges<'a>(faces: impl Iterator<Item = &'a [u32]>) -> usize {
    let mut counts = BTreeMap::new();
    for edge in faces.flat_map(edges) {
        *counts.entry(edge).or_insert(0_u32) += 1;
    }
    counts.values().filter(|count| **count > 2).count()
}

/// What was found, by kind.
#[derive(Debug, Default)]
struct Findings {
    /// Numbers of faces, from 1.
    flat: Vec<usize>,
    twice: Vec<usize>,
    unused: usize,
    crowded: usize,
}

impl Findings {
    fn sentences(&self) -> Vec<String> {
        let mut all = Vec::new();
        if let Some(first) = self.flat.first() {
            all.push(format!(
                "{} faces have no area, the first is face {first}: left out",
                self.flat.len()
            ));
        }
        if let Some(first) = self.twice.first() {
            all.push(format!(
                "{} faces stand twice, the first is face {first}: left out",
                self.twice.len()
            ));
        }
        if self.unused > 0 {
            all.push(format!("{} vertices belong to no face: left out", self.unused));
        }
        if self.crowded > 0 {
            all.push(format!(
                "{} edges have more than two faces: no bends across them",
                self.crowded
            ));
        }
        all
    }
}
