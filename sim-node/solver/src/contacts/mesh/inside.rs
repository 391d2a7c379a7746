//! The inside of a closed mesh.

use glam::{DVec3, Vec3};

use super::cells::{Cells, Place};
use super::near::NearTriangles;
use super::tree::{NearestTriangle, TriangleTree};
use super::triangle::{Feature, NearestPoint};
use crate::scene::definition::collider::ColliderMesh;

/// Smallest volume of a part of a solid, relative to the sum of the volumes that each of its triangles spans.
const VOLUME_MIN: f64 = 1e-6;

/// The reason why a mesh is no solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SolidFlaw {
    /// An edge that does not join two triangles of consistent winding.
    OpenEdge {
        ends: [[f32; 3]; 2],
        /// Number of triangles that list the ends in this order, and in the opposite one.
        counts: [usize; 2],
    },
    /// The connected part with this vertex encloses no volume.
    Flat([f32; 3]),
    /// The connected part with this vertex faces inwards, and others outwards, or the other way round.
    Reversed([f32; 3]),
}

/// Removes the triangles with two corners at the same position, which no solid needs. Returns their number.
pub(crate) fn remove_collapsed(mesh: &mut ColliderMesh) -> usize {
    let (places, count) = (places(&mesh.vertices), mesh.triangles.len());
    mesh.triangles.retain(|triangle| edges(&places, *triangle).iter().all(|[from, to]| from != to));
    count - mesh.triangles.len()
}

/// Returns the first flaw of a mesh that should enclose a solid. Vertices at the same position are one.
pub(crate) fn find_flaw(mesh: &ColliderMesh) -> Option<SolidFlaw> {
    let sides = Sides::new(mesh);
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    for [from, to] in mesh.triangles.iter().flat_map(|one| edges(&sides.places, *one)) {
        let counts = [[from, to], [to, from]].map(|edge| sides.of(edge).len());
        if counts != [1, 1] {
            return Some(SolidFlaw::OpenEdge { ends: [at(from), at(to)], counts });
        }
    }
    let parts = sides.parts(mesh);
    let is_flat = |part: &&Part| part.volume.abs() <= VOLUME_MIN * part.spanned;
    if let Some(flat) = parts.iter().find(is_flat) {
        return Some(SolidFlaw::Flat(at(flat.vertex)));
    }
    let is_first_outwards = parts.first().is_some_and(|part| part.volume > 0.0);
    let reversed = parts.iter().find(|part| (part.volume > 0.0) != is_first_outwards)?;
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
fn edges(places: &[u32], triangle: [u32; 3]) -> [[u32; 2]; 3] {
    let [a, b, c] = triangle.map(|vertex| places[vertex as usize]);
    [[a, b], [b, c], [c, a]]
}

/// The triangles at each edge.
struct Sides {
    /// By vertex: the first one at the same position.
    places: Vec<u32>,
    /// Ends in the order of a triangle, and the triangle, ascending.
    sorted: Vec<([u32; 2], u32)>,
}

/// Triangles that are connected through edges.
struct Part {
    /// One of its vertices.
    vertex: u32,
    /// Six times the volume that they enclose; negative if they face inwards.
    volume: f64,
    /// Sum of the magnitudes of its terms.
    spanned: f64,
}

impl Sides {
    fn new(mesh: &ColliderMesh) -> Self {
        let places = places(&mesh.vertices);
        let triangles = (0_u32..).zip(&mesh.triangles);
        let mut sorted: Vec<_> = triangles
            .flat_map(|(index, triangle)| edges(&places, *triangle).map(|edge| (edge, index)))
            .collect();
        sorted.sort_unstable();
        Self { places, sorted }
    }

    /// Returns the triangles that list the ends of an edge in this order.
    fn of(&self, edge: [u32; 2]) -> &[([u32; 2], u32)] {
        let first = self.sorted.partition_point(|(one, _)| *one < edge);
        let count = self.sorted[first..].iter().take_while(|(one, _)| *one == edge).count();
        &self.sorted[first..first + count]
    }

    /// Returns the connected parts of a mesh.
    fn parts(&self, mesh: &ColliderMesh) -> Vec<Part> {
        let mut is_known = vec![false; mesh.triangles.len()];
        let triangles = (0_u32..).zip(&mesh.triangles);
        let parts = triangles.filter_map(|(index, _)| {
            let is_new = !std::mem::replace(&mut is_known[index as usize], true);
            is_new.then(|| self.part(mesh, index, &mut is_known))
        });
        parts.collect()
    }

    /// Returns the part with this triangle.
    fn part(&self, mesh: &ColliderMesh, first: u32, is_known: &mut [bool]) -> Part {
        let position = |vertex: u32| Vec3::from_array(mesh.vertices[vertex as usize]).as_dvec3();
        let vertex = mesh.triangles[first as usize][0];
        let mut part = Part { vertex, volume: 0.0, spanned: 0.0 };
        let mut waiting = vec![first];
        while let Some(index) = waiting.pop() {
            let triangle = mesh.triangles[index as usize];
            let [a, b, c] = triangle.map(|one| position(one) - position(vertex));
            let volume = a.dot(b.cross(c));
            part.volume += volume;
            part.spanned += volume.abs();
            let edges = edges(&self.places, triangle).into_iter();
            let across = edges.flat_map(|[from, to]| self.of([to, from])).map(|(_, other)| *other);
            let is_new = |other: &u32| !std::mem::replace(&mut is_known[*other as usize], true);
            waiting.extend(across.filter(is_new));
        }
        part
    }
}

/// Tells whether points are inside a closed mesh.
#[derive(Debug)]
pub(super) struct Inside {
    outwards: Outwards,
    /// None until [`Inside::find_cells`].
    cells: Option<Cells>,
}

/// Tells the side of points by the normal of the nearest part of the surface (Signed Distance Computation Using the Angle
/// Weighted Pseudonormal: Baerentzen, Aanaes 2005).
#[derive(Debug)]
struct Outwards {
    /// 1 if the triangles face outwards, -1 if they face inwards.
    facing: f32,
    /// By triangle, in the order of the tree.
    normals: Vec<Normals>,
}

/// Directions at the edges and corners of a triangle, of any length, to the side that it faces.
#[derive(Debug, Clone, Copy)]
struct Normals {
    /// By edge, from each corner to the next: the sum of the normals of both triangles.
    edges: [Vec3; 3],
    /// By corner: the sum of the normals of all triangles around it, each times its angle there.
    corners: [Vec3; 3],
}

/// The point of a surface that is nearest to another point.
pub(super) struct SurfacePoint {
    /// Unit vector out of the solid: on the line between both, or that of the face if they are too near.
    pub(super) normal: Vec3,
    /// Distance from the surface; negative inside.
    pub(super) height: f32,
}

impl Inside {
    /// `mesh` has no flaw ([`find_flaw`]). `order` has, by triangle of the tree, the triangle of the mesh.
    pub(super) fn new(mesh: &ColliderMesh, order: &[u32]) -> Self {
        Self { outwards: Outwards::new(mesh, order), cells: None }
    }

    /// Finds the cells that are far from the surface. That pays off for the points of many steps.
    pub(super) fn find_cells(&mut self, tree: &TriangleTree) {
        let height = |point| Some(self.surface_near(tree, point, 0.0)?.height);
        self.cells = Some(Cells::new(&tree.bounds(), &height, tree.rounding));
    }

    /// Returns the point of the surface that is nearest to a point, whose rounding is at most `tolerance`. `None` for
    /// NaN.
    pub(super) fn surface_near(
        &self,
        tree: &TriangleTree,
        point: Vec3,
        tolerance: f32,
    ) -> Option<SurfacePoint> {
        Some(self.outwards.surface_point(tree, &tree.nearest(point)?, tolerance))
    }

    /// True if a point, whose rounding is at most `tolerance`, is inside. `near` are the triangles around it: they spare a
    /// search, and change no result.
    pub(super) fn contains(
        &self,
        tree: &TriangleTree,
        point: Vec3,
        near: &NearTriangles,
        tolerance: f32,
    ) -> bool {
        if !tree.bounds().contains(point.to_array()) {
            return false;
        }
        match self.cells.as_ref().map_or(Place::NearSurface, |cells| cells.at(point)) {
            Place::Inside => true,
            Place::Outside => false,
            Place::NearSurface => {
                let nearest = near.nearest(tree, point).or_else(|| tree.nearest(point));
                let surface = nearest.map(|one| self.outwards.surface_point(tree, &one, tolerance));
                surface.is_some_and(|surface| surface.height < 0.0)
            }
        }
    }
}

impl Outwards {
    fn new(mesh: &ColliderMesh, order: &[u32]) -> Self {
        let sides = Sides::new(mesh);
        let edges = |triangle: u32| edges(&sides.places, mesh.triangles[triangle as usize]);
        let at = |vertex: u32| Vec3::from_array(mesh.vertices[vertex as usize]).as_dvec3();
        let mut faces = Vec::with_capacity(mesh.triangles.len());
        let mut at_corners = vec![DVec3::ZERO; mesh.vertices.len()];
        for (index, _) in (0_u32..).zip(&mesh.triangles) {
            let edges = edges(index);
            let arms = edges.map(|[from, to]| at(to) - at(from));
            let face = arms[0].cross(arms[1]).normalize();
            for (corner, [vertex, _]) in edges.into_iter().enumerate() {
                let angle = arms[corner].angle_between(-arms[(corner + 2) % 3]);
                at_corners[vertex as usize] += face * angle;
            }
            faces.push(face);
        }
        let at_edge = |[from, to]: [u32; 2]| {
            let both = sides.of([from, to]).iter().chain(sides.of([to, from]));
            both.fold(DVec3::ZERO, |sum, (_, triangle)| sum + faces[*triangle as usize]).as_vec3()
        };
        let normals = order.iter().map(|triangle| Normals {
            edges: edges(*triangle).map(at_edge),
            corners: edges(*triangle).map(|[corner, _]| at_corners[corner as usize].as_vec3()),
        });
        let normals = normals.collect();
        let is_outwards = sides.parts(mesh).first().is_some_and(|part| part.volume > 0.0);
        Self { facing: if is_outwards { 1.0 } else { -1.0 }, normals }
    }

    /// Returns the point of the nearest triangle. The rounding of the other point is at most `tolerance`.
    fn surface_point(
        &self,
        tree: &TriangleTree,
        nearest: &NearestTriangle,
        tolerance: f32,
    ) -> SurfacePoint {
        let NearestPoint { feature, apart } = nearest.nearest;
        let triangle = nearest.triangle as usize;
        let face = tree.triangles[triangle].normal() * self.facing;
        let normals = &self.normals[triangle];
        let distance = apart.dot(apart).sqrt();
        let out = match feature {
            Feature::Edge(edge) if distance > tolerance => normals.edges[edge] * self.facing,
            Feature::Corner(corner) if distance > tolerance => {
                normals.corners[corner] * self.facing
            }
            // On a face, and so near an edge or corner that the direction from it is rounding.
            _ => return SurfacePoint { normal: face, height: face.dot(apart) },
        };
        // Only the sign depends on angles, whose last digits differ between systems.
        let sign = if out.dot(apart) < 0.0 { -1.0 } else { 1.0 };
        SurfacePoint { normal: apart * (sign / distance), height: sign * distance }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]
mod tests {
    //! The sign against the winding number, which needs no nearest point.
    use super::super::near::{NearMeshes, NearQuery};
    use super::super::triangle::Triangle;
    use super::*;
    use crate::contacts::bounds::Bounds;

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

    /// A ball whose vertices are at random distances from its center, so that it has spikes and pits.
    fn thorny_ball(random: &mut impl FnMut() -> f32) -> ColliderMesh {
        let (rings, sectors) = (9_u32, 14_u32);
        let mut vertices = vec![[0.0, 0.7, 0.0], [0.0, -0.7, 0.0]];
        for ring in 1..rings {
            for sector in 0..sectors {
                let angle = |part: u32, of: u32| std::f32::consts::PI * part as f32 / of as f32;
                let (radius, height) = angle(ring, rings).sin_cos();
                let (sine, cosine) = angle(2 * sector, sectors).sin_cos();
                let length = 0.3 + 0.7 * random();
                vertices.push([radius * cosine, height, radius * sine].map(|axis| length * axis));
            }
        }
        let at = |ring: u32, sector: u32| 2 + ring * sectors + sector % sectors;
        let mut triangles = Vec::new();
        for sector in 0..sectors {
            triangles.push([0, at(0, sector + 1), at(0, sector)]);
            triangles.push([1, at(rings - 2, sector), at(rings - 2, sector + 1)]);
            for ring in 0..rings - 2 {
                let [a, b] = [at(ring, sector), at(ring, sector + 1)];
                let [c, d] = [at(ring + 1, sector + 1), at(ring + 1, sector)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        ColliderMesh { vertices, triangles, is_solid: true }
    }

    /// Sum of the solid angles of the triangles, in full turns: 1 inside and 0 outside (Van Oosterom, Strackee 1983).
    fn winding_number(mesh: &ColliderMesh, point: Vec3) -> f64 {
        let turns = mesh.triangles.iter().map(|triangle| {
            let corner = |vertex: u32| Vec3::from_array(mesh.vertices[vertex as usize]) - point;
            let [a, b, c] = triangle.map(|vertex| corner(vertex).as_dvec3());
            let lengths = [a, b, c].map(DVec3::length);
            let below = lengths[0] * lengths[1] * lengths[2]
                + a.dot(b) * lengths[2]
                + b.dot(c) * lengths[0]
                + c.dot(a) * lengths[1];
            a.dot(b.cross(c)).atan2(below) / std::f64::consts::TAU
        });
        turns.sum()
    }

    /// Numbers from 0 to 1.
    fn random_numbers() -> impl FnMut() -> f32 {
        let mut state = 1_u32;
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        }
    }

    fn solid(mesh: &ColliderMesh) -> (TriangleTree, Inside) {
        let corners = |one: &[u32; 3]| one.map(|vertex| mesh.vertices[vertex as usize]);
        let triangles = mesh.triangles.iter().map(|one| Triangle::new(corners(one), 0.0).unwrap());
        let (tree, order) = TriangleTree::new(triangles.collect());
        let mut inside = Inside::new(mesh, &order);
        inside.find_cells(&tree);
        (tree, inside)
    }

    /// The box around a point, larger by `reach` on each side, as a query.
    fn query(point: Vec3, reach: f32) -> NearQuery {
        let bounds = Bounds::around([point.to_array()]);
        NearQuery { collider: 0, particle: 0, bounds, margin: reach }
    }

    #[test]
    fn triangles_around_a_point_spare_a_search_and_change_no_result() {
        let mut random = random_numbers();
        let (mut spared_count, mut inside_count) = (0, 0);
        for _ in 0..20 {
            let (tree, inside) = solid(&thorny_ball(&mut random));
            for _ in 0..500 {
                let point = Vec3::new(random(), random(), random()) * 2.0 - 1.0;
                let found = tree.nearest(point).unwrap();
                let mut lists = NearMeshes::new(1);
                // A list that was made for another place.
                let before = point + 0.1 * (Vec3::new(random(), random(), random()) - 0.5);
                let near = lists.find(&tree, &query(before, 0.2 * random()));
                if let Some(listed) = near.nearest(&tree, point) {
                    assert_eq!((listed.triangle, listed.nearest), (found.triangle, found.nearest));
                    spared_count += 1;
                }
                let is_inside = inside.contains(&tree, point, near, 1e-6);
                let surface = inside.surface_near(&tree, point, 1e-6).unwrap();
                assert_eq!(is_inside, surface.height < 0.0, "{point}");
                inside_count += u32::from(is_inside);
            }
        }
        assert!(spared_count > 1000 && inside_count > 1000, "{spared_count}, {inside_count}");
    }

    #[test]
    fn the_first_of_equally_near_triangles_is_nearest_in_any_order() {
        let (tree, _) = solid(&cube());
        let all: Vec<u32> = (0..12).collect();
        let reversed: Vec<u32> = (0..12).rev().collect();
        // On axes and diagonals of the cube, inside and outside.
        for steps in 0..5 * 5 * 5 {
            let at = [steps % 5, steps / 5 % 5, steps / 25].map(|step| step as f32 - 1.5);
            let point = Vec3::from_array(at);
            let expected = tree.nearest(point).unwrap();
            for order in [&all, &reversed] {
                let found = tree.nearest_of(order, point, 100.0).unwrap();
                assert_eq!(found.triangle, expected.triangle, "{point}");
            }
        }
    }

    #[test]
    fn a_point_is_inside_where_the_surface_winds_around_it() {
        let mut random = random_numbers();
        let mut inside_count = 0;
        for _ in 0..20 {
            let mesh = thorny_ball(&mut random);
            assert_eq!(find_flaw(&mesh), None);
            let (tree, inside) = solid(&mesh);
            for _ in 0..500 {
                let point = Vec3::new(random(), random(), random()) * 2.0 - 1.0;
                let surface = |point| inside.surface_near(&tree, point, 1e-6).unwrap();
                let nearest = surface(point);
                let expected = if nearest.height < 0.0 { 1.0 } else { 0.0 };
                let turns = winding_number(&mesh, point);
                assert!((turns - expected).abs() < 1e-3, "{point}: {turns}, {}", nearest.height);
                inside_count += u32::from(nearest.height < 0.0);
                let foot = surface(point - nearest.normal * nearest.height);
                assert!(foot.height.abs() < 1e-5, "{}", foot.height);
            }
        }
        assert!(inside_count > 1000, "{inside_count}");
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
