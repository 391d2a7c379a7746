//! The triangles that particles touch, and what they share.

use glam::Vec3;
use sim_scene::constraints::sides::TornSides;
use sim_scene::model::Model;

use super::super::load::LoadPairs;
use super::nearest::{Feature, Nearest, SIDE_TOLERANCE, is_on_side_of, next};
use crate::kernels::lanes::PackedParticle;

/// Largest number of edges that a contact crosses in a substep. A particle that crosses more has left the contact
/// anyway.
const CROSSINGS_MAX: usize = 8;

/// The triangles whose corners all take part in contacts, and their neighbours.
#[derive(Debug, Clone, Default)]
pub(super) struct Surface {
    /// By triangle: the slots of its corners. Neighbours at load are near each other in the list.
    pub(super) corners: Vec<[u32; 3]>,
    /// By triangle and edge: the other triangle at the edge. None at a border, and where more than two meet.
    across: Vec<[Option<Neighbor>; 3]>,
    /// By triangle and edge: slot of the corner of the other triangle, if it is whole, that is not on the edge. Else the
    /// slot at which the edge starts.
    pub(super) opposites: Vec<[u32; 3]>,
    /// By slot: first entry in `fans`, and the end of the last one.
    fan_starts: Vec<u32>,
    /// The triangles around each slot, ascending.
    fans: Vec<u32>,
    /// The sides of the triangles. A triangle with a torn side touches nothing.
    sides: TornSides,
}

/// Another triangle at an edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Neighbor {
    pub(super) triangle: u32,
    /// Slot of its corner that is not on the edge.
    pub(super) opposite: u32,
}

/// Where particles are, relative to one of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) particles: &'a [PackedParticle],
    pub(super) slot: u32,
    /// Number of displacements after which it is.
    pub(super) time: f32,
}

impl View<'_> {
    #[inline(always)]
    pub(super) fn at(&self, slot: u32) -> Vec3 {
        let [PackedParticle(one), PackedParticle(origin)] =
            [slot, self.slot].map(|slot| self.particles[slot as usize]);
        let axis =
            |axis| (one[axis] - origin[axis]) + self.time * (one[axis + 4] - origin[axis + 4]);
        Vec3::new(axis(0), axis(1), axis(2))
    }
}

/// A triangle, and its nearest point.
pub(super) struct Found {
    pub(super) triangle: u32,
    pub(super) nearest: Nearest,
    /// Relative to the viewer.
    pub(super) corners: [Vec3; 3],
}

impl Surface {
    /// `triangles` have slots as corners. They are in the order of the tiles.
    pub(super) fn new(model: &Model, particles: &[u32], triangles: Vec<[u32; 3]>) -> Self {
        let corners = triangles.iter().map(|corners| corners.map(|slot| particles[slot as usize]));
        let mut surface = Self {
            across: across(&triangles),
            sides: TornSides::of_triangles(model.pairs(), corners),
            corners: triangles,
            ..Self::default()
        };
        surface.set_fans(particles.len());
        surface.set_opposites();
        surface
    }

    #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 triangles")]
    fn set_fans(&mut self, slot_count: usize) {
        let mut starts = vec![0_u32; slot_count + 1];
        for slot in self.corners.iter().flatten() {
            starts[*slot as usize + 1] += 1;
        }
        for slot in 0..slot_count {
            starts[slot + 1] += starts[slot];
        }
        self.fans = vec![0; 3 * self.corners.len()];
        let mut places = starts.clone();
        for (triangle, corners) in (0_u32..).zip(&self.corners) {
            for slot in corners {
                let place = &mut places[*slot as usize];
                self.fans[*place as usize] = triangle;
                *place += 1;
            }
        }
        self.fan_starts = starts;
    }

    fn set_opposites(&mut self) {
        let mut opposites = std::mem::take(&mut self.opposites);
        opposites.clear();
        opposites.extend((0_u32..).zip(&self.corners).map(|(triangle, corners)| {
            [0, 1, 2].map(|edge| {
                self.neighbor(triangle, edge).map_or(corners[edge], |other| other.opposite)
            })
        }));
        self.opposites = opposites;
    }

    /// Takes the triangles with torn sides out.
    pub(super) fn follow_tears(&mut self, torn: &[u32]) {
        self.sides.set_torn(torn.iter().copied());
        self.set_opposites();
    }

    pub(super) fn is_whole(&self, triangle: u32) -> bool {
        self.sides.is_whole(triangle)
    }

    pub(super) fn has_corner(&self, triangle: u32, slot: u32) -> bool {
        self.corners[triangle as usize].contains(&slot)
    }

    /// The corners of a triangle in a view.
    #[inline(always)]
    pub(super) fn place(&self, triangle: u32, view: View<'_>) -> [Vec3; 3] {
        self.corners[triangle as usize].map(|slot| view.at(slot))
    }

    /// Returns the whole triangles around a slot.
    pub(super) fn fan(&self, slot: u32) -> impl Iterator<Item = u32> + '_ {
        let [first, end] = [slot, slot + 1].map(|slot| self.fan_starts[slot as usize] as usize);
        self.fans[first..end].iter().copied().filter(|triangle| self.is_whole(*triangle))
    }

    /// Returns the other triangle at an edge, if it is whole.
    #[inline(always)]
    pub(super) fn neighbor(&self, triangle: u32, edge: usize) -> Option<Neighbor> {
        self.across[triangle as usize][edge].filter(|other| self.is_whole(other.triangle))
    }

    /// Returns a triangle around the nearest point of this one that leads nearer to the viewer, or `None` if the
    /// point is a local minimum of the distance. Triangles that the viewer never touches do not count: where
    /// the cloth folds, the nearest point is often on one of them, and then a point on their rim must hold the layers apart.
    pub(super) fn nearer(
        &self,
        triangle: u32,
        nearest: &Nearest,
        (view, load_pairs): (View<'_>, &LoadPairs),
    ) -> Option<u32> {
        let may_touch = |triangle: u32| !load_pairs.never_touch(view.slot, triangle);
        let corners = self.corners[triangle as usize];
        match nearest.feature {
            Feature::Face => None,
            Feature::Edge(edge) => {
                let neighbor = self.neighbor(triangle, edge)?;
                let ends = [corners[edge], corners[next(edge)]].map(|slot| view.at(slot));
                let is_nearer = is_on_side_of(ends, view.at(neighbor.opposite));
                Some(neighbor.triangle).filter(|other| is_nearer && may_touch(*other))
            }
            Feature::Corner(corner) => {
                let slot = corners[corner];
                let at = view.at(slot);
                self.fan(slot).find(|triangle| {
                    let others = self.corners[*triangle as usize].into_iter();
                    let is_nearer = others.filter(|other| *other != slot).any(|other| {
                        let edge = view.at(other) - at;
                        -edge.dot(at) > SIDE_TOLERANCE * edge.dot(edge)
                    });
                    is_nearer && may_touch(*triangle)
                })
            }
        }
    }

    /// Returns the first whole triangle with the same nearest point as this one that fulfils a condition, as this one
    /// does.
    pub(super) fn first_sharing(
        &self,
        triangle: u32,
        feature: Feature,
        condition: impl Fn(u32) -> bool,
    ) -> u32 {
        let first = match feature {
            Feature::Face => None,
            Feature::Edge(edge) => self
                .neighbor(triangle, edge)
                .map(|other| other.triangle)
                .filter(|other| *other < triangle && condition(*other)),
            Feature::Corner(corner) => {
                let slot = self.corners[triangle as usize][corner];
                self.fan(slot).find(|other| condition(*other))
            }
        };
        first.unwrap_or(triangle)
    }

    /// True if `other` is a triangle, or has its nearest point, too.
    pub(super) fn shares(&self, triangle: u32, feature: Feature, other: u32) -> bool {
        match feature {
            Feature::Face => other == triangle,
            Feature::Edge(edge) => {
                let neighbor = self.neighbor(triangle, edge);
                other == triangle || neighbor.is_some_and(|one| one.triangle == other)
            }
            Feature::Corner(corner) => {
                self.has_corner(other, self.corners[triangle as usize][corner])
            }
        }
    }

    /// Goes from a triangle to the one that is nearest to the viewer, across edges and around corners, as long as each is
    /// nearer than the one before, and not one that the viewer never touches.
    #[inline(always)]
    pub(super) fn descend(
        &self,
        triangle: u32,
        (view, load_pairs): (View<'_>, &LoadPairs),
    ) -> Found {
        let mut found = self.find(triangle, view);
        for _ in 0..CROSSINGS_MAX {
            let nearer = self.nearer(found.triangle, &found.nearest, (view, load_pairs));
            let Some(nearer) = nearer else { break };
            found = self.find(nearer, view);
        }
        found
    }

    #[inline(always)]
    fn find(&self, triangle: u32, view: View<'_>) -> Found {
        let corners = self.place(triangle, view);
        Found { triangle, nearest: Nearest::new(corners), corners }
    }
}

/// Returns the direction from the nearest point to the side on which the path of the viewer starts, and its distance
/// along it. NaN if the particle is on the point.
#[inline(always)]
pub(super) fn separation(surface: &Surface, found: &Found, view: View<'_>) -> (Vec3, f32) {
    let Found { triangle, ref nearest, corners } = *found;
    let apart = -nearest.mean(corners);
    let direction = if nearest.feature == Feature::Face {
        let before = surface.place(triangle, View { time: 0.0, ..view });
        let is_below = normal_of(before).dot(-nearest.mean(before)) < 0.0;
        if is_below { -normal_of(corners) } else { normal_of(corners) }
    } else {
        apart
    };
    let normal = direction / direction.dot(direction).sqrt();
    (normal, normal.dot(apart))
}

/// A normal of a triangle, of any length.
#[inline(always)]
fn normal_of([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}

/// An edge of a triangle.
struct TriangleEdge {
    /// Ascending.
    ends: [u32; 2],
    triangle: u32,
    edge: usize,
}

fn edges(triangles: &[[u32; 3]]) -> impl Iterator<Item = TriangleEdge> + '_ {
    (0_u32..).zip(triangles).flat_map(|(triangle, corners)| {
        [0, 1, 2].map(|edge| {
            let [a, b] = [corners[edge], corners[next(edge)]];
            TriangleEdge { ends: [a.min(b), a.max(b)], triangle, edge }
        })
    })
}

/// By triangle and edge: the other triangle at an edge of exactly two.
fn across(triangles: &[[u32; 3]]) -> Vec<[Option<Neighbor>; 3]> {
    let mut across = vec![[None; 3]; triangles.len()];
    let mut edges: Vec<_> = edges(triangles).collect();
    edges.sort_unstable_by_key(|one| (one.ends, one.triangle));
    for group in edges.chunk_by(|a, b| a.ends == b.ends) {
        if let [a, b] = group {
            for (one, other) in [(a, b), (b, a)] {
                let opposite = triangles[other.triangle as usize][next(next(other.edge))];
                across[one.triangle as usize][one.edge] =
                    Some(Neighbor { triangle: other.triangle, opposite });
            }
        }
    }
    across
}

#[cfg(test)]
mod tests {
    use super::super::samples::{sheet, surface_of};

    #[test]
    fn the_corners_behind_edges_follow_tears() {
        let model = sheet(4, 0.5);
        let (mut surface, _) = surface_of(&model);
        let whole = surface.opposites.clone();
        surface.follow_tears(&[10]);
        let torn: Vec<_> = (0..18).filter(|triangle| !surface.is_whole(*triangle)).collect();
        assert!(!torn.is_empty());
        for (triangle, opposites) in (0_u32..).zip(&surface.opposites) {
            let corners = surface.corners[triangle as usize];
            let expected = [0, 1, 2].map(|edge| {
                surface.neighbor(triangle, edge).map_or(corners[edge], |one| one.opposite)
            });
            assert_eq!(*opposites, expected);
        }
        assert_ne!(surface.opposites, whole);
        surface.follow_tears(&[]);
        assert_eq!(surface.opposites, whole);
    }
}
