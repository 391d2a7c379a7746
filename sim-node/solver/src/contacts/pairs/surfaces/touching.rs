//! Tells which candidates touch in a substep.

use glam::Vec3;

use super::super::box_tree::Search;
use super::super::gathered::Room;
use super::super::load::LoadPairs;
use super::candidate::Candidate;
use super::contact::SurfaceContact;
use super::faces::Faces;
use super::surface::{Surface, View, separation};
use crate::kernels::lanes::{LaneWork, PackedParticle, Wide};

/// Finds the candidates that are near at the end of the substep, and moves them on to the nearest triangles.
pub(super) struct TouchWork<'a, 'b> {
    pub(super) touching: Touching<'a>,
    pub(super) candidates: &'a mut [Candidate],
    pub(super) near: &'a mut Room<'b, SurfaceContact>,
}

impl LaneWork for TouchWork<'_, '_> {
    type Output = Search;

    #[inline(always)]
    fn run<W: Wide>(self) -> Search {
        let Self { touching, candidates, near } = self;
        let mut faces = Faces::default();
        let (groups, rest) = candidates.as_chunks_mut::<8>();
        for group in groups {
            let (mut slots, mut triangles) = ([0; 8], [0; 8]);
            for (lane, candidate) in group.iter().enumerate() {
                (slots[lane], triangles[lane]) = (candidate.slot, candidate.triangle);
            }
            faces.find::<W>(touching.surface, touching.states, (slots, triangles));
            for (lane, candidate) in group.iter_mut().enumerate() {
                let contact = if faces.lanes & (1 << lane) != 0 {
                    touching.contact_on_face(candidate, &faces, lane)
                } else {
                    touching.walk_to_contact(candidate)
                };
                if let Some(contact) = contact {
                    near.add(contact)?;
                }
            }
        }
        let mut rest = rest.iter_mut().filter_map(|candidate| touching.walk_to_contact(candidate));
        rest.try_for_each(|contact| near.add(contact))
    }
}

/// The conditions under which candidates touch.
#[derive(Clone, Copy)]
pub(super) struct Touching<'a> {
    pub(super) surface: &'a Surface,
    pub(super) load_pairs: &'a LoadPairs,
    pub(super) states: &'a [PackedParticle],
    /// Contact distance of all that are not near at load.
    pub(super) thickness: f32,
    /// Candidates within this number of contact distances touch.
    pub(super) reach: f32,
}

impl Touching<'_> {
    /// Returns the contact of a candidate whose nearest point is on the face of its triangle.
    #[inline(always)]
    fn contact_on_face(
        &self,
        candidate: &Candidate,
        faces: &Faces,
        lane: usize,
    ) -> Option<SurfaceContact> {
        let (weights, normal) = faces.lane(lane);
        let found = (Vec3::from_array(normal), faces.heights[lane]);
        self.contact(candidate, weights, found)
    }

    /// Moves a candidate on to the nearest triangle, and returns its contact. It has no lanes, so it is not compiled into
    /// the loop over them.
    #[inline(never)]
    fn walk_to_contact(&self, candidate: &mut Candidate) -> Option<SurfaceContact> {
        let Candidate { slot, triangle, .. } = *candidate;
        let view = View { particles: self.states, slot, time: 1.0 };
        let found = self.surface.descend(triangle, (view, self.load_pairs));
        candidate.triangle = found.triangle;
        self.contact(candidate, found.nearest.weights, separation(self.surface, &found, view))
    }

    #[inline(always)]
    fn contact(
        &self,
        candidate: &Candidate,
        weights: [f32; 3],
        (normal, height): (Vec3, f32),
    ) -> Option<SurfaceContact> {
        let Candidate { slot, triangle, .. } = *candidate;
        let distance = self.load_pairs.distance([slot, triangle], self.thickness);
        // False for NaN.
        let is_near = height < self.reach * distance;
        let [a, b, c] = self.surface.corners[triangle as usize];
        let slots = [slot, a, b, c];
        is_near.then_some(SurfaceContact { slots, weights, normal, distance })
    }
}
