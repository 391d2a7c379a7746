//! Tells which triangles in reach have a point that is nearest to a particle and comes near it.

use super::super::box_tree::Search;
use super::super::load::LoadPairs;
use super::super::tile::take_lowest;
use super::faces::{Corners, mean, nearest_on_faces};
use super::nearest::{Feature, Nearest, clamped, next};
use super::surface::{Surface, View};
use super::triangle_tiles::SurfaceSearch;
use crate::kernels::lanes::{LaneWork, PackedParticle, Wide};
use crate::kernels::vectors::{difference, dot, scaled, sum};

/// Share of a distance that exceeds its rounding.
const ROUNDING: f32 = 1e-4;

/// A particle, a triangle, and the part of it that is nearest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct NearPoint {
    pub(super) slot: u32,
    pub(super) triangle: u32,
    pub(super) feature: Feature,
}

/// Finds, for each particle and triangle in `pairs`, the part of the triangle with the nearest point, and passes it to
/// `accept` if that is a local minimum of the distance from the triangles that the particle may touch, and comes near the
/// particle.
pub(super) struct NearbyWork<'a, F> {
    pub(super) surface: &'a Surface,
    pub(super) load_pairs: &'a LoadPairs,
    pub(super) search: &'a SurfaceSearch<'a>,
    pub(super) pairs: &'a [[u32; 2]],
    pub(super) accept: &'a mut F,
}

impl<F: FnMut(NearPoint) -> Search> LaneWork for NearbyWork<'_, F> {
    type Output = Search;

    #[inline(always)]
    fn run<W: Wide>(self) -> Search {
        let Self { surface, load_pairs, search, pairs, accept } = self;
        for pairs in pairs.chunks(8) {
            let NearLanes { on_face, mut near } = near_lanes::<W>(surface, search, pairs);
            while let Some(lane) = take_lowest(&mut near) {
                let pair = pairs[lane as usize];
                let point = if on_face & (1 << lane) == 0 {
                    nearby((surface, load_pairs), search, pair)
                } else {
                    let [slot, triangle] = pair;
                    let feature = Feature::Face;
                    let can_touch = can_touch(surface, search.states, pair);
                    can_touch.then_some(NearPoint { slot, triangle, feature })
                };
                if let Some(point) = point {
                    accept(point)?;
                }
            }
        }
        Search::Continue(())
    }
}

/// A bit for each of at most eight particles and their triangles.
struct NearLanes {
    /// The nearest point is on the face.
    on_face: u32,
    /// The particle comes near this point. Beside the face, it may do so.
    near: u32,
}

#[inline(always)]
fn near_lanes<W: Wide>(
    surface: &Surface,
    search: &SurfaceSearch<'_>,
    pairs: &[[u32; 2]],
) -> NearLanes {
    // Copies of the first pair fill the rest, so that a pair is examined in the same way wherever a batch ends.
    let (mut slots, mut triangles) = ([pairs[0][0]; 8], [pairs[0][1]; 8]);
    for (lane, [slot, triangle]) in pairs.iter().enumerate() {
        (slots[lane], triangles[lane]) = (*slot, *triangle);
    }
    let corners = Corners::<W>::new(surface, search.states, (slots, triangles), search.span);
    let (on_face, weights) = nearest_on_faces(corners.starts);
    let (point, later) = (mean(weights, corners.starts), mean(weights, corners.ends));
    let length = dot(point, point).sqrt();
    // The distance along the direction in which they are apart now.
    let at_end = dot(point, later) / length;
    let distance = W::splat(search.distance);
    let near = W::bits(length.is_below(distance)) | W::bits(at_end.is_below(distance));
    let beside_near = if on_face == 0xff { 0 } else { edges_near(&corners, search.distance) };
    let used = (1 << pairs.len()) - 1;
    NearLanes { on_face, near: (near & on_face | beside_near & !on_face) & used }
}

/// Returns a bit for each triangle with an edge that a particle may come nearer to than `distance`: no point of it
/// approaches by more than the longest path of a corner.
#[inline(always)]
fn edges_near<W: Wide>(Corners { starts, ends }: &Corners<W>, distance: f32) -> u32 {
    let (mut nearest, mut longest) = (W::splat(f32::INFINITY), W::splat(0.0));
    for corner in 0..3 {
        let (from, to) = (starts[corner], starts[next(corner)]);
        let along = difference(to, from);
        let share = clamped(-dot(from, along) / dot(along, along));
        let point = sum(from, scaled(along, share));
        let square = dot(point, point);
        nearest = W::select(square.is_below(nearest), square, nearest);
        let path = difference(ends[corner], from);
        longest = longest.max_or_rhs(dot(path, path));
    }
    let reach = (W::splat(distance) + longest.sqrt()) * W::splat(1.0 + ROUNDING);
    W::bits(nearest.is_below(reach * reach))
}

/// Finds the part of one triangle. It has no lanes, so it is not compiled into the loop over them.
#[inline(never)]
fn nearby(
    (surface, load_pairs): (&Surface, &LoadPairs),
    search: &SurfaceSearch<'_>,
    pair: [u32; 2],
) -> Option<NearPoint> {
    let SurfaceSearch { states, span, distance, .. } = *search;
    let [slot, triangle] = pair;
    let view = View { particles: states, slot, time: 0.0 };
    let corners = surface.place(triangle, view);
    let nearest = Nearest::new(corners);
    let later = surface.place(triangle, View { time: span, ..view });
    let (point, later) = (nearest.mean(corners), nearest.mean(later));
    let length = point.dot(point).sqrt();
    let is_near = length < distance || point.dot(later) / length < distance;
    let is_minimum = || surface.nearer(triangle, &nearest, (view, load_pairs)).is_none();
    let is_found = is_near && can_touch(surface, states, pair) && is_minimum();
    is_found.then_some(NearPoint { slot, triangle, feature: nearest.feature })
}

/// True if a particle is no corner of a triangle, which is whole, and one of them is free.
fn can_touch(surface: &Surface, states: &[PackedParticle], [slot, triangle]: [u32; 2]) -> bool {
    let is_free = |slot: u32| states[slot as usize].0[3] > 0.0;
    surface.is_whole(triangle)
        && !surface.has_corner(triangle, slot)
        && (is_free(slot) || surface.corners[triangle as usize].iter().any(|one| is_free(*one)))
}

#[cfg(test)]
mod tests {
    //! Eight triangles at once against one after the other.
    use super::super::super::tile_tree::TileTree;
    use super::super::samples::{Random, sheet, surface_of};
    use super::*;
    use crate::kernels::Kernels;

    #[test]
    fn eight_triangles_at_once_are_near_as_one_after_the_other() {
        let (surface, particles) = surface_of(&sheet(4, 0.5));
        let (mut random, tree) = (Random(1), TileTree::new(16));
        let never = (0..16).map(|slot| [slot, (5 * slot) % 18]).collect();
        let load_pairs = LoadPairs::from_pairs(never, Vec::new(), (16, Search::Continue(())));
        let mut face_count = 0;
        for _ in 0..200 {
            let states = [0; 16].map(|_| PackedParticle([0; 8].map(|_| random.number())));
            // Two groups of eight, and a rest.
            let pairs = [0; 19].map(|_| [random.below(16), random.below(18)]);
            for kernels in Kernels::available() {
                let search = SurfaceSearch {
                    tree: &tree,
                    states: &states,
                    particles: &particles,
                    begins_paths: true,
                    passed: 0.0,
                    span: 0.5,
                    distance: 0.8,
                    kernels,
                };
                let (surface, load_pairs, search) = (&surface, &load_pairs, &search);
                let (pairs, mut found) = (&pairs, Vec::new());
                let accept = &mut |point| {
                    found.push(point);
                    Search::Continue(())
                };
                let work = NearbyWork { surface, load_pairs, search, pairs, accept };
                assert!(kernels.run(work).is_continue());
                let expected =
                    pairs.iter().map(|pair| nearby((surface, load_pairs), search, *pair));
                let expected: Vec<_> = expected.flatten().collect();
                assert_eq!(found, expected, "{kernels:?}");
                face_count += found.iter().filter(|one| one.feature == Feature::Face).count();
            }
        }
        assert!(face_count > 50, "{face_count}");
    }
}
