//! Particles and constraints of any graph: batches of eight constraints that share no particle.

mod batch;
mod cells;

use std::ops::Range;

use batch::Batch;
use cells::{BodyCells, EndWork, PredictWork, body_pull_back};

use super::motion::Motion;
use super::patch::Extras;
use super::team::{Scratch, Team};
use super::terms::{Features, Fields, Give, Pass, Term};
use crate::kernels::{Body, Eight};
use crate::order::Order;
use crate::pages::refill;
use crate::particles::Particle;
use crate::scene::Model;

/// Everything that no patch has.
#[derive(Debug, Clone, Default)]
pub(crate) struct Graph {
    /// The bodies, and one more that pads of batches refer to: nothing moves it.
    pub(super) bodies: Vec<Body>,
    /// By body: its index in the scene.
    pub(super) particles: Vec<u32>,
    /// By body: the displacement that was predicted; only where there are colliders.
    pub(super) predicted: Vec<[f32; 3]>,
    /// By body: the velocity that the wind gives in a substep; only where there is wind.
    pub(super) gains: Vec<[f32; 3]>,
    /// By body: its tether; only where there are any.
    pub(super) tethers: Vec<Tether>,
    groups: Vec<Group>,
    /// The two bodies of each constraint, by eights.
    ends: Vec<[[u32; 8]; 2]>,
    /// Their inverse masses.
    weights: Vec<[Eight; 2]>,
    /// The fields of the constraints, each as long as `ends`.
    terms: Vec<f32>,
    features: Features,
    /// Of all constraints, where they do not differ.
    give: Give,
}

/// How far a body may be from its root.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tether {
    /// Where the root is at the end of the substep.
    pub(super) root: [f32; 3],
    /// Infinite where there is none.
    pub(super) length: f32,
}

/// Constraints of a group, or bodies, from which on two threads are faster than one.
const SHARED_MIN: usize = 4096;

/// Bodies that are worked on together: few enough to stay near, and a multiple of eight.
pub(super) const RUN: usize = 256;

/// Eights of one group.
#[derive(Debug, Clone)]
struct Group {
    eights: Range<usize>,
    /// Constraints; what follows them in the last eight is padding.
    count: usize,
    /// No two share a particle.
    is_independent: bool,
}

impl Graph {
    /// `body_of` gives the body of a particle, or none where a patch has it. The second part of the
    /// result are the places of the constraints, with their indices.
    pub(super) fn new(
        model: &Model,
        order: &Order,
        particles: Vec<u32>,
        body_of: impl Fn(u32) -> Option<u32>,
    ) -> (Self, Vec<(u32, usize)>) {
        let mut graph = Self { particles, ..Self::default() };
        refill(&mut graph.bodies, graph.particles.len() + 1, Body::default());
        let mut places = Vec::new();
        for (group, range) in order.groups.iter().enumerate() {
            let links: Vec<_> = order.indices[range.clone()]
                .iter()
                .filter_map(|index| {
                    let [a, b] = model.pair(*index);
                    Some((*index, [body_of(a)?, body_of(b)?]))
                })
                .collect();
            if !links.is_empty() {
                graph.push(&links, group < order.independent_count, &mut places);
            }
        }
        refill(&mut graph.weights, graph.ends.len(), [[0.0; 8]; 2]);
        (graph, places)
    }

    fn push(
        &mut self,
        links: &[(u32, [u32; 2])],
        is_independent: bool,
        places: &mut Vec<(u32, usize)>,
    ) {
        let first = self.ends.len();
        #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 particles")]
        let pad = (self.bodies.len() - 1) as u32;
        for eight in links.chunks(8) {
            let mut ends = [[pad; 8]; 2];
            for (lane, (index, [a, b])) in eight.iter().enumerate() {
                assert!(*a.max(b) < pad, "a constraint of a body that there is not");
                places.push((*index, 8 * self.ends.len() + lane));
                (ends[0][lane], ends[1][lane]) = (*a, *b);
            }
            self.ends.push(ends);
        }
        let eights = first..self.ends.len();
        self.groups.push(Group { eights, count: links.len(), is_independent });
    }

    pub(super) fn count(&self) -> usize {
        self.particles.len()
    }

    /// Room for what a scene has.
    pub(super) fn lay_out(&mut self, features: Features, extras: Extras, give: Give) {
        (self.features, self.give) = (features, give);
        let count = |is_wanted: bool| if is_wanted { self.particles.len() } else { 0 };
        self.predicted = vec![[0.0; 3]; count(extras.colliders)];
        self.gains = vec![[0.0; 3]; count(extras.wind)];
        let none = Tether { root: [0.0; 3], length: f32::INFINITY };
        self.tethers = vec![none; count(extras.tethers)];
        let length = 8 * self.ends.len();
        refill(&mut self.terms, features.field_count() * length, 0.0);
        for pad in 0..length {
            self.set_term(pad, &Term::NONE);
        }
    }

    pub(super) fn set_term(&mut self, place: usize, term: &Term) {
        self.fields().set(place, term);
    }

    pub(super) fn take_mark(&mut self, place: usize) -> f32 {
        self.fields().take_mark(place)
    }

    fn fields(&mut self) -> Fields<'_> {
        Fields::new(&mut self.terms, 8 * self.ends.len(), self.features)
    }

    /// Takes over the state at the start of a step: velocities in the place of displacements.
    pub(super) fn unpack(&mut self, states: &[Particle]) {
        let mut is_other_weight = false;
        for (body, particle) in self.bodies.iter_mut().zip(&self.particles) {
            let state = &states[*particle as usize];
            let ([x, y, z], [vx, vy, vz]) = (state.position, state.velocity);
            is_other_weight |= body.0[3] != state.inverse_mass;
            *body = Body([x, y, z, state.inverse_mass, vx, vy, vz, 0.0]);
        }
        if is_other_weight {
            self.weigh();
        }
    }

    /// Takes the state back to where it is published.
    pub(super) fn pack(&self, states: &mut [Particle], h: f32) -> u64 {
        let mut frozen_count = 0;
        for (body, particle) in self.bodies.iter().zip(&self.particles) {
            let Body([x, y, z, _, dx, dy, dz, _]) = *body;
            let state = &mut states[*particle as usize];
            frozen_count += u64::from(super::pack(state, [x, y, z], [dx, dy, dz], h));
        }
        frozen_count
    }

    /// Lets every free body fall.
    pub(super) fn predict(&mut self, team: &mut Team, motion: &Motion<'_>) {
        let (count, kernels, gains) = (self.count(), team.kernels, &self.gains);
        let part_count = part_count(count, team.members());
        if part_count == 1 {
            kernels.run(PredictWork { bodies: &mut self.bodies[..count], gains, motion });
        } else {
            let length = count.div_ceil(part_count).next_multiple_of(8);
            let parts = self.bodies[..count].chunks_mut(length).enumerate();
            let work = |(part, bodies): &mut (usize, &mut [Body]), _: &mut Scratch| {
                let gains = gains.get(*part * length..).unwrap_or_default();
                kernels.run(PredictWork { bodies, gains, motion });
            };
            team.each(parts, work, |_| {});
        }
        for (predicted, body) in self.predicted.iter_mut().zip(&self.bodies) {
            let Body([_, _, _, _, x, y, z, _]) = *body;
            *predicted = [x, y, z];
        }
    }

    /// Tethers, contacts, and the way that is left.
    pub(super) fn end_substep(&mut self, team: &mut Team, motion: &Motion<'_>) {
        for (body, tether) in self.bodies.iter_mut().zip(&self.tethers) {
            if tether.length < f32::INFINITY {
                body_pull_back(body, tether);
            }
        }
        let (count, kernels) = (self.count(), team.kernels);
        let length = count.div_ceil(part_count(count, team.members())).next_multiple_of(RUN).max(1);
        let predicted = &self.predicted;
        let parts = self.bodies[..count].chunks_mut(length).enumerate();
        let work = |(part, bodies): &mut (usize, &mut [Body]), scratch: &mut Scratch| {
            for (run, bodies) in bodies.chunks_mut(RUN).enumerate() {
                let first = *part * length + run * RUN;
                let predicted = predicted.get(first..first + bodies.len()).unwrap_or_default();
                let cells = BodyCells { bodies, predicted };
                kernels.run(EndWork { cells, contacts: &mut scratch.contacts, motion });
            }
        };
        team.each(parts, work, |_| {});
    }

    /// Somebody has pinned or let go a particle.
    fn weigh(&mut self) {
        for (ends, weights) in self.ends.iter().zip(&mut self.weights) {
            for (ends, weights) in ends.iter().zip(weights) {
                for (body, weight) in ends.iter().zip(weights) {
                    *weight = self.bodies[*body as usize].0[3];
                }
            }
        }
    }

    /// One pass over all constraints, group by group. Whether anything has torn.
    pub(super) fn project(&mut self, team: &mut Team, pass: Pass) -> bool {
        let mut is_marked = false;
        let (features, give) = (self.features, self.give);
        for group in 0..self.groups.len() {
            let (batch, fields) = self.batch(group);
            let eights = batch.group.eights.clone();
            is_marked |= if features.are_plain(give.softness) {
                batch.project(fields.rigid(&eights, give.share), team)
            } else {
                batch.project(fields.general(&eights, give, pass), team)
            };
        }
        is_marked
    }

    /// Brings what is longer than its longest length back to it.
    pub(super) fn limit_stretch(&mut self, team: &mut Team) {
        if !self.features.max_lengths {
            return;
        }
        for group in 0..self.groups.len() {
            let (batch, fields) = self.batch(group);
            if let Some(limit) = fields.limit(&batch.group.eights) {
                batch.project(limit, team);
            }
        }
    }

    fn batch(&mut self, group: usize) -> (Batch<'_>, Fields<'_>) {
        let length = 8 * self.ends.len();
        let Self { bodies, ends, weights, terms, groups, features, .. } = self;
        let group = &groups[group];
        let (ends, weights) = (&ends[group.eights.clone()], &weights[group.eights.clone()]);
        (Batch { group, bodies, ends, weights }, Fields::new(terms, length, *features))
    }
}

/// Parts that so many bodies or constraints are divided into among so many members.
fn part_count(count: usize, members: usize) -> usize {
    if count < SHARED_MIN { 1 } else { members.min(count / (SHARED_MIN / 2)) }
}
