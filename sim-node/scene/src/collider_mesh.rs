//! The meshes of colliders: triangles with a height, and closed surfaces.

use glam::{DVec3, Vec3};

use crate::definition::collider::ColliderMesh;

/// Rounding of a position in the frame of a mesh, relative to the coordinates.
pub const TOLERANCE: f32 = 4.0 * f32::EPSILON;
/// Height up to which a triangle is a sliver, in tolerances. The tolerance of its neighbours closes the
/// gap that it leaves.
const SLIVER: f32 = 2.0;

/// Removes the triangles that are slivers: they have no normal, or none that f32 can tell. Returns
/// their number.
pub(crate) fn remove_slivers(mesh: &mut ColliderMesh) -> usize {
    let ColliderMesh { vertices, triangles, .. } = mesh;
    let (height_min, count) = (sliver_height(vertices), triangles.len());
    triangles.retain(|one| normal(corners(vertices, *one), height_min).is_some());
    count - triangles.len()
}

/// Returns the corners of a triangle.
pub fn corners(vertices: &[[f32; 3]], triangle: [u32; 3]) -> [[f32; 3]; 3] {
    triangle.map(|corner| vertices[corner as usize])
}

/// Returns the largest coordinate on each axis.
pub fn extents(vertices: &[[f32; 3]]) -> Vec3 {
    let greater = |a: f32, b: f32| if b > a { b } else { a };
    let extent = |axis: usize| vertices.iter().map(|vertex| vertex[axis].abs()).fold(0.0, greater);
    Vec3::new(extent(0), extent(1), extent(2))
}

/// Returns the unit normal of a triangle, or `None` for a sliver: a triangle whose height over its longest edge is at
/// most `height_min`.
pub fn normal(corners: [[f32; 3]; 3], height_min: f64) -> Option<DVec3> {
    let corner = corners.map(|corner| Vec3::from_array(corner).as_dvec3());
    let edges = [corner[1] - corner[0], corner[2] - corner[1], corner[0] - corner[2]];
    let cross = edges[0].cross(edges[1]);
    let area = cross.dot(cross).sqrt();
    let longest = edges.iter().map(|edge| edge.dot(*edge)).fold(0.0, f64::max).sqrt();
    // NaN compares false: a triangle without an extent has no height.
    let has_height = area > height_min * longest;
    has_height.then(|| cross * (1.0 / area))
}

/// Height over the longest edge up to which a triangle is a sliver.
pub fn sliver_height(vertices: &[[f32; 3]]) -> f64 {
    f64::from(SLIVER * TOLERANCE * extents(vertices).element_sum())
}

/// Smallest volume of a component of a solid, relative to the sum of the volumes that each of its triangles spans.
const VOLUME_MIN: f64 = 1e-6;

/// The reason why a mesh is no solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SolidFlaw {
    /// An edge that does not join two triangles of consistent winding.
    OpenEdge {
        /// Positions of its ends.
        ends: [[f32; 3]; 2],
        /// Number of triangles that list the ends in this order, and in the opposite one.
        counts: [usize; 2],
    },
    /// The component with this vertex encloses no volume.
    Flat([f32; 3]),
    /// The component with this vertex faces inwards, and others outwards, or the other way round.
    Reversed([f32; 3]),
}

/// Removes the triangles with two corners at the same position, which no solid needs. Returns their number.
pub(crate) fn remove_collapsed(mesh: &mut ColliderMesh) -> usize {
    let (places, count) = (places(&mesh.vertices), mesh.triangles.len());
    mesh.triangles.retain(|triangle| edges(&places, *triangle).iter().all(|[from, to]| from != to));
    count - mesh.triangles.len()
}

/// Returns the first flaw of a mesh that should enclose a solid. Vertices at the same position are one.
pub fn find_flaw(mesh: &ColliderMesh) -> Option<SolidFlaw> {
    let sides = Sides::new(mesh);
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    for [from, to] in mesh.triangles.iter().flat_map(|one| edges(&sides.places, *one)) {
        let counts = [[from, to], [to, from]].map(|edge| sides.of(edge).len());
        if counts != [1, 1] {
            return Some(SolidFlaw::OpenEdge { ends: [at(from), at(to)], counts });
        }
    }
    let components = sides.components(mesh);
    let is_flat = |one: &&Component| one.volume.abs() <= VOLUME_MIN * one.spanned;
    if let Some(flat) = components.iter().find(is_flat) {
        return Some(SolidFlaw::Flat(at(flat.vertex)));
    }
    let is_first_outwards = components.first().is_some_and(|one| one.volume > 0.0);
    let reversed = components.iter().find(|one| (one.volume > 0.0) != is_first_outwards)?;
    Some(SolidFlaw::Reversed(at(reversed.vertex)))
}

/// Index of the first vertex at the same position, by vertex.
fn places(vertices: &[[f32; 3]]) -> Vec<u32> {
    // Adding 0 turns -0 into 0.
    let place = |vertex: &[f32; 3]| vertex.map(|axis| (axis + 0.0).to_bits());
    let mut sorted: Vec<_> = vertices.iter().map(place).zip(0_u32..).collect();
    sorted.sort_unstable();
    let mut places = vec![0; vertices.len()];
    for same in sorted.chunk_by(|a, b| a.0 == b.0) {
        for (_, vertex) in same {
            places[*vertex as usize] = same[0].1;
        }
    }
    places
}

/// The edges of a triangle, from each corner to the next, with the places of its vertices.
pub fn edges(places: &[u32], triangle: [u32; 3]) -> [[u32; 2]; 3] {
    let [a, b, c] = triangle.map(|vertex| places[vertex as usize]);
    [[a, b], [b, c], [c, a]]
}

/// The triangles at each edge of a mesh.
#[derive(Debug)]
pub struct Sides {
    /// By vertex: the first one at the same position.
    pub places: Vec<u32>,
    /// Ends in the order of a triangle, and the triangle, ascending.
    sorted: Vec<([u32; 2], u32)>,
}

/// Triangles that are connected through edges: a connected component of a mesh.
#[derive(Debug)]
pub struct Component {
    /// One of its vertices.
    vertex: u32,
    /// Six times the volume that they enclose; negative if they face inwards.
    pub volume: f64,
    /// Sum of the magnitudes of its terms.
    spanned: f64,
}

impl Sides {
    /// Finds the triangles at each edge of a mesh.
    pub fn new(mesh: &ColliderMesh) -> Self {
        let places = places(&mesh.vertices);
        let triangles = (0_u32..).zip(&mesh.triangles);
        let mut sorted: Vec<_> = triangles
            .flat_map(|(index, triangle)| edges(&places, *triangle).map(|edge| (edge, index)))
            .collect();
        sorted.sort_unstable();
        Self { places, sorted }
    }

    /// Returns the triangles that list the ends of an edge in this order.
    pub fn of(&self, edge: [u32; 2]) -> &[([u32; 2], u32)] {
        let first = self.sorted.partition_point(|(one, _)| *one < edge);
        let count = self.sorted[first..].iter().take_while(|(one, _)| *one == edge).count();
        &self.sorted[first..first + count]
    }

    /// Returns the connected components of a mesh.
    pub fn components(&self, mesh: &ColliderMesh) -> Vec<Component> {
        let mut is_known = vec![false; mesh.triangles.len()];
        let triangles = (0_u32..).zip(&mesh.triangles);
        let components = triangles.filter_map(|(index, _)| {
            let is_new = !std::mem::replace(&mut is_known[index as usize], true);
            is_new.then(|| self.component(mesh, index, &mut is_known))
        });
        components.collect()
    }

    /// Returns the component with this triangle.
    fn component(&self, mesh: &ColliderMesh, first: u32, is_known: &mut [bool]) -> Component {
        let position = |vertex: u32| Vec3::from_array(mesh.vertices[vertex as usize]).as_dvec3();
        let vertex = mesh.triangles[first as usize][0];
        let mut component = Component { vertex, volume: 0.0, spanned: 0.0 };
        let mut waiting = vec![first];
        while let Some(index) = waiting.pop() {
            let triangle = mesh.triangles[index as usize];
            let [a, b, c] = triangle.map(|one| position(one) - position(vertex));
            let volume = a.dot(b.cross(c));
            component.volume += volume;
            component.spanned += volume.abs();
            let edges = edges(&self.places, triangle).into_iter();
            let across = edges.flat_map(|[from, to]| self.of([to, from])).map(|(_, other)| *other);
            let is_new = |other: &u32| !std::mem::replace(&mut is_known[*other as usize], true);
            waiting.extend(across.filter(is_new));
        }
        component
    }
}

#[cfg(test)]
#[allow(clippy::panic, reason = "a panic is how a test fails")]
mod tests {
    use super::*;

    const CUBE: [[u32; 3]; 12] = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];

    fn cube() -> ColliderMesh {
        let corner = |bits: u32| [0, 1, 2].map(|axis| (bits >> axis & 1) as f32);
        ColliderMesh {
            vertices: (0..8).map(corner).collect(),
            triangles: CUBE.into(),
            is_solid: true,
        }
    }

    #[test]
    fn meshes_that_enclose_no_solid_have_a_flaw_and_vertices_at_one_position_are_one() {
        assert_eq!(find_flaw(&cube()), None);
        let counts = |mesh: &ColliderMesh| match find_flaw(mesh) {
            Some(SolidFlaw::OpenEdge { counts, .. }) => counts,
            other => panic!("{other:?}"),
        };
        let without = ColliderMesh { triangles: CUBE[1..].into(), ..cube() };
        assert_eq!(counts(&without), [1, 0]);
        let mut turned = cube();
        turned.triangles[5].swap(0, 1);
        assert_eq!(counts(&turned), [2, 0]);
        let doubled = ColliderMesh { triangles: [&CUBE[..], &CUBE[..1]].concat(), ..cube() };
        assert_eq!(counts(&doubled), [2, 1]);
        // Each triangle has vertices of its own.
        let vertices = CUBE.iter().flatten().map(|vertex| cube().vertices[*vertex as usize]);
        let triangles = (0..12).map(|index| [3 * index, 3 * index + 1, 3 * index + 2]);
        let apart = ColliderMesh {
            vertices: vertices.collect(),
            triangles: triangles.collect(),
            is_solid: true,
        };
        assert_eq!(find_flaw(&apart), None);
        let flat = ColliderMesh { triangles: vec![[0, 1, 2], [0, 2, 1]], ..cube() };
        assert_eq!(find_flaw(&flat), Some(SolidFlaw::Flat([0.0; 3])));
    }

    /// Two cubes, of which the second one may face the other way.
    fn cubes(is_reversed: bool) -> ColliderMesh {
        let mut cubes = cube();
        cubes.vertices.extend(cube().vertices.iter().map(|[x, y, z]| [x + 3.0, *y, *z]));
        cubes.triangles.extend(CUBE.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|vertex| vertex + 8);
            if is_reversed { [b, a, c] } else { [a, b, c] }
        }));
        cubes
    }

    #[test]
    fn parts_must_face_the_same_way() {
        assert_eq!(find_flaw(&cubes(false)), None);
        assert!(matches!(find_flaw(&cubes(true)), Some(SolidFlaw::Reversed([x, ..])) if x >= 3.0));
    }

    #[test]
    fn collapsed_triangles_are_removed() {
        let mut mesh = cube();
        mesh.vertices.push([1.0, 0.0, -0.0]);
        mesh.triangles.insert(3, [1, 8, 5]);
        assert_eq!(remove_collapsed(&mut mesh), 1);
        assert_eq!(mesh.triangles, CUBE);
    }
}
