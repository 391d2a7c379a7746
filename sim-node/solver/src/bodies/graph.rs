//! Particles and constraints of any graph: batches of eight constraints that share no particle.

use std::ops::Range;

use glam::Vec3;

use super::motion::{Motion, pull_back};
use super::patch::Extras;
use super::team::{Scratch, Team};
use super::terms::{Features, Fields, Give, Pass, Term};
use crate::contact::{Cells, Contacts};
use crate::crew::Shared;
use crate::kernels::{Body, Eight, Kernels, Wide, Work, axes};
use crate::order::Order;
use crate::particles::Particle;
use crate::project::{BLOCK, Block, Gap, Law, Rest, Spot, correction};
use crate::scene::Model;
use crate::solid::{Way, Zone};

/// Groups with fewer constraints are projected one after the other: an eight costs as much as a
/// few of them.
const BATCHED_MIN: usize = 4;

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
        let mut graph = Self {
            bodies: vec![Body::default(); particles.len() + 1],
            particles,
            ..Self::default()
        };
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
        graph.weights = vec![[[0.0; 8]; 2]; graph.ends.len()];
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
        self.terms = vec![0.0; features.field_count() * length];
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

/// Constraints of one group, and what they move.
struct Batch<'a> {
    group: &'a Group,
    bodies: &'a mut [Body],
    ends: &'a [[[u32; 8]; 2]],
    weights: &'a [[Eight; 2]],
}

impl Batch<'_> {
    /// Whether anything has torn.
    #[allow(unsafe_code, reason = "only this place knows that the constraints are independent")]
    fn project<T: Law + Send>(self, law: T, team: &mut Team) -> bool {
        let is_big = self.group.is_independent && self.group.count >= BATCHED_MIN;
        if !is_big || team.kernels == Kernels::Reference {
            return self.project_singly(law);
        }
        // SAFETY: no two constraints of an independent group share a body; and the body of the
        // padding is in the last eight alone.
        let bodies = unsafe { Shared::new(self.bodies) };
        let whole = BatchPart { ends: self.ends, weights: self.weights, bodies };
        if part_count(self.group.count, team.members()) == 1 {
            return whole.project(law, (team.kernels, team.alone()));
        }
        whole.project_together(law, team)
    }

    fn project_singly(self, mut law: impl Law) -> bool {
        for place in 0..self.group.count {
            let at = Spot { eight: place / 8, lane: place % 8 };
            let ([a, b], [w_a, w_b]) = (&self.ends[at.eight], &self.weights[at.eight]);
            let (a, b) = (a[at.lane] as usize, b[at.lane] as usize);
            let (w_a, w_b) = (w_a[at.lane], w_b[at.lane]);
            let difference = |axis: usize| self.bodies[b].0[axis] - self.bodies[a].0[axis];
            let gap = Gap::new(axes(difference), axes(|axis| difference(4 + axis)));
            let scale = law.scale(at, &gap.size, w_a + w_b);
            let correction = correction(gap.separation, scale);
            let (way_a, way_b) = (correction.way(w_a), correction.way(w_b));
            for axis in 0..3 {
                self.bodies[a].0[4 + axis] += way_a[axis];
                self.bodies[b].0[4 + axis] -= way_b[axis];
            }
        }
        law.is_marked()
    }
}

/// Eights of a group that one member works on.
struct BatchPart<'a> {
    ends: &'a [[[u32; 8]; 2]],
    weights: &'a [[Eight; 2]],
    bodies: Shared<'a, Body>,
}

impl BatchPart<'_> {
    /// Whether anything has torn.
    fn project(&self, mut law: impl Law, (kernels, scratch): (Kernels, &mut Scratch)) -> bool {
        kernels.run(BatchWork { part: self, law: &mut law, block: &mut scratch.block });
        law.is_marked()
    }

    /// As [`Self::project`], by all members of the team.
    fn project_together<T: Law + Send>(&self, law: T, team: &mut Team) -> bool {
        let kernels = team.kernels;
        let length = self.ends.len().div_ceil(part_count(8 * self.ends.len(), team.members()));
        let mut rest = Some(law);
        let parts = self.ends.chunks(length).zip(self.weights.chunks(length));
        let parts = parts.map(|(ends, weights)| {
            let law = rest.take().map(|law| {
                if ends.len() < length {
                    return law;
                }
                let (law, others) = law.split(ends.len());
                rest = Some(others);
                law
            });
            (BatchPart { ends, weights, bodies: self.bodies }, law, false)
        });
        let mut is_any_marked = false;
        let work = |(part, law, is_marked): &mut (BatchPart<'_>, Option<T>, bool),
                    scratch: &mut _| {
            if let Some(law) = law.take() {
                *is_marked = part.project(law, (kernels, scratch));
            }
        };
        team.each(parts, work, |(.., is_marked)| is_any_marked |= is_marked);
        is_any_marked
    }
}

struct BatchWork<'a, 'b, T> {
    part: &'a BatchPart<'b>,
    law: &'a mut T,
    block: &'a mut Block,
}

impl<T: Law> Work for BatchWork<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    #[allow(unsafe_code, reason = "the check of each index would be a third of the work")]
    fn run<W: Wide>(self) {
        let Self { part: BatchPart { ends, weights, bodies }, law, block } = self;
        let bodies = bodies.cells();
        for first in (0..ends.len()).step_by(BLOCK) {
            let length = BLOCK.min(ends.len() - first);
            let ends = &ends[first..first + length];
            for (eight, [a, b]) in ends.iter().enumerate() {
                // SAFETY: `Graph::push` made the ends, of bodies that the graph has.
                let [start, moved] = unsafe { W::differences(bodies, a, b) };
                block.set_gap::<W>(eight, &Gap::new(start, moved));
            }
            for (eight, [w_a, w_b]) in weights[first..first + length].iter().enumerate() {
                let at = Spot { eight: first + eight, lane: 0 };
                block.solve(eight, (&mut *law, at), W::load(w_a, 0) + W::load(w_b, 0));
            }
            let weights = &weights[first..first + length];
            for (eight, ([a, b], [w_a, w_b])) in ends.iter().zip(weights).enumerate() {
                let correction = block.correction::<W>(eight);
                // SAFETY: as above.
                unsafe { W::take(bodies, a, correction.way(-W::load(w_a, 0))) };
                // SAFETY: as above.
                unsafe { W::take(bodies, b, correction.way(W::load(w_b, 0))) };
            }
        }
    }
}

/// Lets bodies fall.
struct PredictWork<'a> {
    bodies: &'a mut [Body],
    /// Empty where there is no wind.
    gains: &'a [[f32; 3]],
    motion: &'a Motion<'a>,
}

impl Work for PredictWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Self { bodies, gains, motion: Motion { fall, .. } } = self;
        let (eights, rest) = bodies.as_chunks_mut::<8>();
        let eights_end = 8 * eights.len();
        for (eight, bodies) in eights.iter_mut().enumerate() {
            let [[_, _, _, w], [x, y, z, _]] = W::columns(bodies);
            let wind = match gains.get(8 * eight..8 * eight + 8) {
                None => [W::splat(0.0); 3],
                Some(gains) => {
                    axes(|axis| W::load(&std::array::from_fn(|lane| gains[lane][axis]), 0))
                }
            };
            W::set_displacements(bodies, fall.predict([x, y, z], wind, w));
        }
        for (index, body) in rest.iter_mut().enumerate() {
            let Body([_, _, _, w, x, y, z, _]) = *body;
            let wind = gains.get(eights_end + index).copied().unwrap_or_default();
            body.0[4..7].copy_from_slice(&fall.predict([x, y, z], wind, w));
        }
    }
}

#[inline(always)]
fn body_pull_back(body: &mut Body, tether: &Tether) {
    let Body([x, y, z, w, dx, dy, dz, _]) = *body;
    let [root_x, root_y, root_z] = tether.root;
    let rest = Rest::new(tether.length);
    let take = pull_back([x - root_x, y - root_y, z - root_z], [dx, dy, dz], rest, w);
    for (number, take) in body.0[4..7].iter_mut().zip(take) {
        *number -= take;
    }
}

struct EndWork<'a, 'b> {
    cells: BodyCells<'a>,
    contacts: &'b mut Contacts,
    motion: &'b Motion<'b>,
}

impl Work for EndWork<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(mut self) {
        self.contacts.end_substep::<W>(&mut self.cells, self.motion.obstacles);
    }
}

/// Bodies, for contacts.
struct BodyCells<'a> {
    bodies: &'a mut [Body],
    predicted: &'a [[f32; 3]],
}

impl Cells for BodyCells<'_> {
    fn count(&self) -> usize {
        self.bodies.len()
    }

    fn inverse_mass(&self, index: usize) -> f32 {
        self.bodies[index].0[3]
    }

    fn way(&self, index: usize) -> Way {
        let Body([x, y, z, _, dx, dy, dz, _]) = self.bodies[index];
        Way { start: Vec3::new(x, y, z), displacement: Vec3::new(dx, dy, dz) }
    }

    fn predicted(&self, index: usize) -> Vec3 {
        self.predicted.get(index).copied().map_or(Vec3::ZERO, Vec3::from_array)
    }

    fn set_displacement(&mut self, index: usize, displacement: Vec3) {
        self.bodies[index].0[4..7].copy_from_slice(&displacement.to_array());
    }

    fn set_position(&mut self, index: usize, position: Vec3) {
        self.bodies[index].0[..3].copy_from_slice(&position.to_array());
    }

    #[inline(always)]
    fn may_touch<W: Wide>(&self, eight: usize, zone: &Zone) -> bool {
        if let Some(bodies) = self.bodies[8 * eight..].first_chunk::<8>() {
            let [[x, y, z, _], [dx, dy, dz, _]] = W::columns(bodies);
            return W::any(zone.may_be_met([x, y, z], [dx, dy, dz]));
        }
        self.bodies[8 * eight..]
            .iter()
            .any(|Body([x, y, z, _, dx, dy, dz, _])| zone.may_be_met([*x, *y, *z], [*dx, *dy, *dz]))
    }

    #[inline(always)]
    fn advance<W: Wide>(&mut self) {
        for Body(numbers) in self.bodies.iter_mut() {
            let (x, d) = numbers.split_at_mut(4);
            // With the inverse mass, to which 0 is added: all four at once.
            for (x, d) in x.iter_mut().zip(d) {
                *x += *d;
            }
        }
    }
}
