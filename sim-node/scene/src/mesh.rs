//! Meshes from Wavefront OBJ text. Vertices, faces, texture coordinates, and the names of groups and
//! materials are read; everything else is ignored.

pub(super) mod details;
pub(super) mod pins;
pub(super) mod source;

use std::collections::{BTreeMap, BTreeSet};

use details::{FaceDetails, NameRun};

/// Most runs of names that a mesh keeps, of groups and of materials. Each is a table in the text of the scene,
/// which takes 2.4 KB to parse.
const NAME_RUNS_MAX: usize = 10_000;

/// Vertices and the faces between them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Positions. Each vertex belongs to a face.
    pub vertices: Vec<[f32; 3]>,
    /// Corners of each face in order: at least 3 different vertices.
    pub faces: Vec<Vec<u32>>,
    /// Vertices of each group and object, ascending.
    pub groups: BTreeMap<String, Vec<u32>>,
    /// Texture coordinates and names of the faces, which exports write.
    pub details: FaceDetails,
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
        let raw = RawMesh::read(text)?;
        let (mut parsed, kept) = raw.mesh()?;
        let (mut details, lost_count) = raw.details(&kept, &parsed.mesh.faces);
        for (runs, kind) in [(&mut details.groups, "group"), (&mut details.materials, "material")] {
            let count = runs.len();
            if count > NAME_RUNS_MAX {
                runs.clear();
                parsed.warnings.push(format!(
                    "the faces change their {kind} {count} times, so the names are omitted (allowed: {NAME_RUNS_MAX})"
                ));
            }
        }
        parsed.mesh.details = details;
        parsed.warnings.extend(match lost_count {
            0 => None,
            1 => Some("1 face refers to texture coordinates that are missing or not finite, and loses them".to_owned()),
            n => Some(format!(
                "{n} faces refer to texture coordinates that are missing or not finite, and lose them"
            )),
        });
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
        Ok(RawMesh::read(text)?.mesh()?.0)
    }
}

/// All vertices and faces of the text.
#[derive(Debug, Default)]
struct RawMesh {
    vertices: Vec<[f32; 3]>,
    /// Texture coordinates; `None` where they are malformed.
    uvs: Vec<Option<[f32; 2]>>,
    faces: Vec<RawFace>,
    /// Names of the groups of faces, in the order of the faces.
    groups: Vec<NameRun>,
    /// Names of the materials of faces.
    materials: Vec<NameRun>,
}

#[derive(Debug)]
struct RawFace {
    corners: Vec<u32>,
    /// By corner: the number of its texture coordinates, which may not exist. Empty without them.
    uvs: Vec<usize>,
}

impl RawMesh {
    fn read(text: &str) -> Result<Self, String> {
        let mut raw = Self::default();
        for (number, line) in (1..).zip(text.lines()) {
            raw.read_line(line).map_err(|problem| format!("line {number}: {problem}"))?;
        }
        Ok(raw)
    }

    fn read_line(&mut self, line: &str) -> Result<(), String> {
        let line = line.split('#').next().unwrap_or_default();
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => self.vertices.push(vertex(words)?),
            Some("vt") => self.uvs.push(texture_coordinates(words)),
            Some("f") => self.read_face(words)?,
            Some("g" | "o") => begin_run(&mut self.groups, words, self.faces.len()),
            Some("usemtl") => begin_run(&mut self.materials, words, self.faces.len()),
            _ => {}
        }
        Ok(())
    }

    fn read_face<'a>(&mut self, words: impl Iterator<Item = &'a str>) -> Result<(), String> {
        let words: Vec<_> = words.collect();
        let corners: Result<Vec<_>, _> = words.iter().map(|word| self.corner(word)).collect();
        let corners = corners?;
        if corners.len() < 3 {
            return Err(format!("a face has {} corners (allowed: 3 or more)", corners.len()));
        }
        let uvs: Option<Vec<_>> = words.iter().map(|word| self.uv(word)).collect();
        self.faces.push(RawFace { corners, uvs: uvs.unwrap_or_default() });
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

    /// Returns the place of the texture coordinates of `7/1` or `7/1/2`, or `None` without them.
    fn uv(&self, word: &str) -> Option<usize> {
        let number: isize = word.split('/').nth(1)?.parse().ok()?;
        // Places that do not exist are found later.
        let count = isize::try_from(self.uvs.len()).unwrap_or(isize::MAX);
        let place = if number < 0 { count.saturating_add(number) } else { number - 1 };
        Some(usize::try_from(place).unwrap_or(usize::MAX))
    }

    /// Omits everything that cannot be simulated, with warnings. Returns the kept faces with the mesh.
    fn mesh(&self) -> Result<(ParsedMesh, Vec<usize>), String> {
        let mut omitted = Omissions::default();
        let mut seen = BTreeSet::new();
        let mut kept = Vec::new();
        for (index, face) in self.faces.iter().enumerate() {
            let mut sorted = face.corners.clone();
            sorted.sort_unstable();
            if sorted.windows(2).any(|pair| pair[0] == pair[1]) || self.is_flat(&face.corners) {
                omitted.flat.push(index + 1);
            } else if seen.insert(sorted) {
                kept.push(index);
            } else {
                omitted.duplicate.push(index + 1);
            }
        }
        if kept.is_empty() {
            return Err("the mesh has no face with an area (allowed: at least one)".to_owned());
        }
        let corners = |index: &usize| self.faces[*index].corners.as_slice();
        let used: BTreeSet<u32> = kept.iter().flat_map(corners).copied().collect();
        omitted.unused = self.vertices.len() - used.len();
        let new_index: BTreeMap<u32, u32> = used.iter().copied().zip(0..).collect();
        let mut mesh = Mesh::default();
        mesh.vertices.extend(used.iter().map(|index| self.vertices[*index as usize]));
        for index in &kept {
            let face: Vec<_> = corners(index).iter().map(|index| new_index[index]).collect();
            let group = NameRun::of_face(&self.groups, *index);
            mesh.groups.entry(group.unwrap_or_default().to_owned()).or_default().extend(&face);
            mesh.faces.push(face);
        }
        for members in mesh.groups.values_mut() {
            members.sort_unstable();
            members.dedup();
        }
        Ok((ParsedMesh { mesh, warnings: omitted.sentences() }, kept))
    }

    /// Returns the details of the kept faces, whose corners are `faces`, and the number of faces that lose
    /// texture coordinates.
    fn details(&self, kept: &[usize], faces: &[Vec<u32>]) -> (FaceDetails, usize) {
        let exists = |uv: &usize| self.uvs.get(*uv).is_some_and(Option::is_some);
        let (mut lost_count, mut all) = (0, Vec::with_capacity(kept.len()));
        for index in kept {
            let uvs = self.faces[*index].uvs.as_slice();
            let is_whole = uvs.iter().all(exists);
            lost_count += usize::from(!is_whole);
            all.push(if is_whole { uvs } else { &[] });
        }
        let used: BTreeSet<usize> = all.iter().copied().flatten().copied().collect();
        let new_index: BTreeMap<usize, u32> = used.iter().copied().zip(0..).collect();
        let mut details = FaceDetails {
            uvs: used.iter().filter_map(|uv| self.uvs[*uv]).collect(),
            face_uvs: all.iter().map(|uvs| uvs.iter().map(|uv| new_index[uv]).collect()).collect(),
            groups: NameRun::of_kept(&self.groups, kept),
            materials: NameRun::of_kept(&self.materials, kept),
        };
        if details.uvs.is_empty() || details.face_uvs == faces {
            details.face_uvs = Vec::new();
        }
        (details, lost_count)
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

/// Returns the first two of one to three finite numbers.
fn texture_coordinates<'a>(words: impl Iterator<Item = &'a str>) -> Option<[f32; 2]> {
    let numbers: Result<Vec<f32>, _> = words.take(2).map(str::parse).collect();
    let uv = match numbers.ok()?[..] {
        [u] => [u, 0.0],
        [u, v] => [u, v],
        _ => return None,
    };
    uv.iter().all(|axis| axis.is_finite()).then_some(uv)
}

/// Gives the faces that follow a name, without control characters, which scenes do not have.
fn begin_run<'a>(runs: &mut Vec<NameRun>, words: impl Iterator<Item = &'a str>, face_count: usize) {
    let name = words.collect::<Vec<_>>().join(" ").replace(char::is_control, "");
    let first = u32::try_from(face_count).unwrap_or(u32::MAX);
    runs.push(NameRun { name, first });
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
