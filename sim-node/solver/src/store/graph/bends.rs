//! The bends of the graph, in lane groups of eight that share no particle.

use sim_scene::constraints::bends::BendShape;
use sim_scene::model::Model;

use super::forces::MovedParticles;
use super::group::{ConstraintGroup, part_count};
use super::indices::find_particle;
use crate::constraints::bends::projection::{
    Arm, BendPass, BendProjection, HingeRest, bend_value, bend_weight, subtract_rest,
};
use crate::constraints::order::ProjectionOrder;
use crate::constraints::projection::LaneIndex;
use crate::kernels::Kernels;
use crate::kernels::huge_pages::refill;
use crate::kernels::lanes::{LaneWork, Lanes8, PackedParticle, Wide, axes, map_axes};
use crate::kernels::worker_pool::SharedSlice;
use crate::store::layout::Location;
use crate::store::workers::{WorkerScratch, Workers};

/// Groups with fewer bends are projected one by one.
const BATCHED_MIN: usize = 4;

/// The bends between particles of the graph. Arrays are by lane group.
#[derive(Debug, Clone, Default)]
pub(crate) struct GraphBends {
    pub(crate) groups: Vec<ConstraintGroup>,
    /// Indices of the particles in the graph.
    particles: Vec<[[u32; 8]; 4]>,
    coefficients: Vec<[Lanes8; 4]>,
    inverse_masses: Vec<[Lanes8; 4]>,
    /// Infinite for a bend without effect, and for padding.
    scaled_compliances: Vec<Lanes8>,
    /// Rest value and ratio of areas of hinges. Empty if C is 0 for all bends at rest.
    rests: Vec<[Lanes8; 2]>,
    /// Empty if every substep has a single pass.
    multipliers: [Vec<Lanes8>; 3],
}

impl GraphBends {
    /// Collects the bends of the particles with these scene indices, which must ascend. Enters the
    /// location of each into `locations`, which is indexed by bend.
    pub(crate) fn new(
        model: &Model,
        order: &ProjectionOrder,
        indices: &[u32],
        locations: &mut [Location],
    ) -> Self {
        let mut bends = Self::default();
        for (group, range) in order.groups.iter().enumerate() {
            let first = bends.particles.len();
            let is_inside = |bend: &&u32| {
                find_particle(indices, model.bends[**bend as usize].particles[0]).is_some()
            };
            let members = order.indices[range.clone()].iter().filter(is_inside);
            let members: Vec<u32> = members.copied().collect();
            for lanes in members.chunks(8) {
                bends.push(model, lanes, indices, locations);
            }
            if !members.is_empty() {
                bends.groups.push(ConstraintGroup {
                    lane_groups: first..bends.particles.len(),
                    count: members.len(),
                    is_independent: group < order.independent_count,
                });
            }
        }
        let count = bends.particles.len();
        refill(&mut bends.inverse_masses, count, [[0.0; 8]; 4]);
        refill(&mut bends.scaled_compliances, count, [f32::INFINITY; 8]);
        if bends.rests.iter().all(|[values, _]| *values == [0.0; 8]) {
            bends.rests = Vec::new();
        }
        bends
    }

    fn push(&mut self, model: &Model, bends: &[u32], indices: &[u32], locations: &mut [Location]) {
        #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 particles")]
        let padding = indices.len() as u32;
        let (mut particles, mut coefficients) = ([[padding; 8]; 4], [[0.0; 8]; 4]);
        let mut rests = [[0.0; 8]; 2];
        for (lane, bend) in bends.iter().enumerate() {
            locations[*bend as usize] = Location::in_graph(8 * self.particles.len() + lane);
            let bend = &model.bends[*bend as usize];
            for place in 0..4 {
                let found = find_particle(indices, bend.particles[place]);
                let Some(particle) = found else {
                    unreachable!("a bend has particles inside and outside of the graph")
                };
                particles[place][lane] = particle;
                coefficients[place][lane] = bend.coefficients[place];
            }
            if let BendShape::Hinge { rest, area_ratio } = bend.shape {
                (rests[0][lane], rests[1][lane]) = (rest, area_ratio);
            }
        }
        self.particles.push(particles);
        self.rests.push(rests);
        self.coefficients.push(coefficients);
    }

    /// Allocates the multipliers, if they are needed. Every bend is without effect afterwards.
    pub(crate) fn allocate(&mut self, has_multipliers: bool) {
        let count = self.particles.len();
        self.scaled_compliances.fill([f32::INFINITY; 8]);
        for multipliers in &mut self.multipliers {
            refill(multipliers, if has_multipliers { count } else { 0 }, [0.0; 8]);
        }
    }

    /// Sets the scaled compliance of the bend at an index of its location.
    pub(crate) fn set(&mut self, index: usize, scaled_compliance: f32) {
        self.scaled_compliances[index / 8][index % 8] = scaled_compliance;
    }

    /// Copies the inverse masses of the particles.
    pub(crate) fn update_inverse_masses(&mut self, particles: &[PackedParticle]) {
        for (indices, inverse_masses) in self.particles.iter().zip(&mut self.inverse_masses) {
            for (indices, inverse_masses) in indices.iter().zip(inverse_masses) {
                for (index, inverse_mass) in indices.iter().zip(inverse_masses) {
                    *inverse_mass = particles[*index as usize].0[3];
                }
            }
        }
    }

    /// Projects the bends of a group once.
    pub(crate) fn project(
        &mut self,
        group: usize,
        mut moved: MovedParticles<'_>,
        workers: &mut Workers,
        pass: BendPass,
    ) {
        let ConstraintGroup { lane_groups, count, is_independent } = &self.groups[group];
        let (range, count, is_independent) = (lane_groups.clone(), *count, *is_independent);
        let multipliers = self.multipliers.each_mut().map(|column| column.get_mut(range.clone()));
        let multipliers = match multipliers {
            [Some(x), Some(y), Some(z)] if pass.has_multipliers => Some([x, y, z]),
            _ => None,
        };
        let mut run = BendRun {
            particles: &self.particles[range.clone()],
            coefficients: &self.coefficients[range.clone()],
            inverse_masses: &self.inverse_masses[range.clone()],
            rests: self.rests.get(range.clone()),
            projection: BendProjection {
                scaled_compliances: &self.scaled_compliances[range],
                multipliers,
                is_first: pass.is_first,
                share: pass.share,
            },
        };
        if !is_independent {
            run.project_serially(count, &mut moved);
            return;
        }
        moved.note(0);
        if count < BATCHED_MIN || workers.kernels == Kernels::Reference {
            (0..count).for_each(|place| run.project_one(place, moved.particles));
        } else {
            run.project_together(count, moved.particles, workers);
        }
        moved.add_changes(0);
    }
}

/// Consecutive lane groups of bends.
struct BendRun<'a> {
    particles: &'a [[[u32; 8]; 4]],
    coefficients: &'a [[Lanes8; 4]],
    inverse_masses: &'a [[Lanes8; 4]],
    rests: Option<&'a [[Lanes8; 2]]>,
    projection: BendProjection<'a>,
}

impl BendRun<'_> {
    /// Projects bends that share particles.
    fn project_serially(&mut self, count: usize, moved: &mut MovedParticles<'_>) {
        for place in 0..count {
            moved.note(place);
            self.project_one(place, moved.particles);
            moved.add_changes(place);
        }
    }

    #[inline(always)]
    fn project_one(&mut self, place: usize, particles: &mut [PackedParticle]) {
        let index = LaneIndex { group: place / 8, lane: place % 8 };
        let lane = |numbers: &[Lanes8; 4]| numbers.map(|lanes| lanes[index.lane]);
        let indices = self.particles[index.group].map(|lanes| lanes[index.lane] as usize);
        let coefficients = lane(&self.coefficients[index.group]);
        let inverse_masses = lane(&self.inverse_masses[index.group]);
        let arm = |end: usize| {
            let (from, to) = (particles[indices[1]].0, particles[indices[end]].0);
            Arm {
                coefficient: coefficients[end],
                start: axes(|axis| to[axis] - from[axis]),
                change: axes(|axis| to[4 + axis] - from[4 + axis]),
            }
        };
        let arms = [arm(0), arm(2), arm(3)];
        let mut value = bend_value(&arms);
        if let Some(rests) = self.rests {
            let [rest, area_ratio] = rests[index.group].map(|lanes| lanes[index.lane]);
            value = subtract_rest(value, &arms, HingeRest { rest, area_ratio });
        }
        let weight = bend_weight(&coefficients, &inverse_masses);
        let change = self.projection.change(index, value, weight);
        for end in 0..4 {
            let share = coefficients[end] * inverse_masses[end];
            for (axis, along) in change.into_iter().enumerate() {
                particles[indices[end]].0[4 + axis] += share * along;
            }
        }
    }

    /// Projects the bends of an independent group in eights.
    #[allow(unsafe_code, reason = "only this function knows that the bends are independent")]
    fn project_together(
        self,
        count: usize,
        particles: &mut [PackedParticle],
        workers: &mut Workers,
    ) {
        // SAFETY: no two bends of an independent group share a particle, and only the last lane group
        // contains the particle of the padding.
        let particles = unsafe { SharedSlice::new(particles) };
        self.project_by_all(count, &particles, workers);
    }

    /// Divides the run among the workers that its `count` bends are worth.
    fn project_by_all(
        self,
        count: usize,
        particles: &SharedSlice<'_, PackedParticle>,
        workers: &mut Workers,
    ) {
        let length = self.particles.len().div_ceil(part_count(count, workers.count()));
        let kernels = workers.kernels;
        let mut rest = Some(self);
        let parts = std::iter::from_fn(|| {
            let run = rest.take()?;
            if run.particles.len() <= length {
                return Some(Some(run));
            }
            let (first, others) = run.split(length);
            rest = Some(others);
            Some(Some(first))
        });
        let work = |part: &mut Option<Self>, _: &mut WorkerScratch| {
            if let Some(run) = part.take() {
                kernels.run(BendWork { run, particles });
            }
        };
        workers.for_each(parts, work, |_| {});
    }

    /// Splits the run after `count` lane groups.
    fn split(self, count: usize) -> (Self, Self) {
        let (particles, other_particles) = self.particles.split_at(count);
        let (coefficients, other_coefficients) = self.coefficients.split_at(count);
        let (inverse_masses, other_inverse_masses) = self.inverse_masses.split_at(count);
        let (rests, other_rests) = self.rests.map(|rests| rests.split_at(count)).unzip();
        let (projection, other_projection) = self.projection.split(count);
        let other = Self {
            particles: other_particles,
            coefficients: other_coefficients,
            inverse_masses: other_inverse_masses,
            rests: other_rests,
            projection: other_projection,
        };
        (Self { particles, coefficients, inverse_masses, rests, projection }, other)
    }
}

struct BendWork<'a, 'b> {
    run: BendRun<'a>,
    particles: &'a SharedSlice<'b, PackedParticle>,
}

impl LaneWork for BendWork<'_, '_> {
    type Output = ();

    #[inline(always)]
    #[allow(unsafe_code, reason = "bounds checks would cost a third of the time")]
    fn run<W: Wide>(self) {
        let Self { run, particles } = self;
        let BendRun { particles: indices, coefficients, inverse_masses, rests, mut projection } =
            run;
        let particles = particles.cells();
        for (group, indices) in indices.iter().enumerate() {
            let load = |numbers: &[Lanes8; 4]| {
                [0, 1, 2, 3].map(|place: usize| W::load(&numbers[place], 0))
            };
            let coefficients = load(&coefficients[group]);
            let inverse_masses = load(&inverse_masses[group]);
            let arm = |end: usize| {
                // SAFETY: `GraphBends::push` found each particle in the graph.
                let [start, change] =
                    unsafe { W::differences(particles, &indices[1], &indices[end]) };
                Arm { coefficient: coefficients[end], start, change }
            };
            let arms = [arm(0), arm(2), arm(3)];
            let mut value = bend_value(&arms);
            if let Some(rests) = rests {
                let [rest, area_ratio] = &rests[group];
                let rest = HingeRest { rest: W::load(rest, 0), area_ratio: W::load(area_ratio, 0) };
                value = subtract_rest(value, &arms, rest);
            }
            let weight = bend_weight(&coefficients, &inverse_masses);
            let index = LaneIndex { group, lane: 0 };
            let change = projection.change(index, value, weight);
            for end in 0..4 {
                let share = -(coefficients[end] * inverse_masses[end]);
                let amounts = map_axes(change, |axis| share * axis);
                // SAFETY: as above. Two lanes with the particle of the padding have the amount 0.
                unsafe { W::subtract_displacements(particles, &indices[end], amounts) };
            }
        }
    }
}
