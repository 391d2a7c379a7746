//! The inside of a closed mesh.

use glam::{DVec3, Vec3};
use sim_scene::collider_mesh::{Sides, edges};
use sim_scene::scene::ColliderMesh;

use super::cells::{Cells, Place};
use super::near::NearTriangles;
use super::tree::{NearestTriangle, TriangleTree};
use super::triangle::{Feature, NearestPoint};

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
    /// `mesh` has no flaw ([`find_flaw`](sim_scene::collider_mesh::find_flaw)). `order` has, by triangle of the tree, the triangle of the mesh.
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
        let is_outwards = sides.components(mesh).first().is_some_and(|part| part.volume > 0.0);
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
    use sim_scene::collider_mesh::find_flaw;

    use super::super::near::{NearMeshes, NearQuery};
    use super::super::triangle::Triangle;
    use super::*;
    use crate::contacts::bounds::Bounds;

    /// Corners on the axes, and a triangle in each octant.
    fn octahedron() -> ColliderMesh {
        let vertex = |index: u32| Vec3::AXES[index as usize / 2] * (1.0 - 2.0 * (index % 2) as f32);
        ColliderMesh {
            vertices: (0..6).map(|index| vertex(index).to_array()).collect(),
            triangles: (0..8)
                .map(|bits| [bits & 1, 2 + (bits >> 1 & 1), 4 + (bits >> 2)])
                .collect(),
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
        let (tree, _) = solid(&octahedron());
        let all: Vec<u32> = (0..8).collect();
        let reversed: Vec<u32> = (0..8).rev().collect();
        // On axes and diagonals of the octahedron, inside and outside.
        for steps in 0..5 * 5 * 5 {
            let at = [steps % 5, steps / 5 % 5, steps / 25].map(|step| step as f32 - 2.0);
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
}
