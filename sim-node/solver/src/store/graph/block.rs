//! Blocks of packed particles, and the stages of single particles on them.

use glam::Vec3;

use crate::constraints::separation::RestLength;
use crate::constraints::tether_pull::{Tethered, tether_excess};
use crate::contacts::contact::Contacts;
use crate::contacts::path::{LanePath, SubstepPath};
use crate::kernels::lanes::{LaneWork, Lanes8, PackedParticle, Wide};
use crate::kernels::vectors::{lane_of, load, store};
use crate::step::particle_block::ParticleBlock;
use crate::step::particle_stages::run_stage;
use crate::step::prediction::Prediction;
use crate::step::schedule::ScheduledStage;
use crate::step::substep::SubstepInputs;

/// Groups of eight particles of a block: few enough to stay in the cache from stage to stage.
pub(crate) const BLOCK_GROUPS: usize = 32;

/// The tether of a packed particle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PackedTether {
    /// Position of the root at the end of the substep.
    pub(crate) root: [f32; 3],
    /// Infinite for no tether.
    pub(crate) length: f32,
}

/// Consecutive particles of the graph in groups of eight, with the arrays that only some scenes have;
/// those are empty in other scenes. The last group may have padding.
#[derive(Debug)]
pub(crate) struct GraphBlock<'a> {
    /// Index of the first particle in the graph.
    pub(crate) first: usize,
    pub(crate) particles: &'a mut [[PackedParticle; 8]],
    pub(crate) predicted: &'a mut [[Lanes8; 3]],
    pub(crate) gains: &'a [[Lanes8; 3]],
    /// By particle, without padding.
    pub(crate) tethers: &'a [PackedTether],
    /// Tethers of each particle.
    pub(crate) tether_count: usize,
    /// By particle and tether, or empty if nobody asks for forces: mass times the displacement that the tether has
    /// taken in this step.
    pub(crate) tether_pulls: &'a mut [[f32; 3]],
}

impl<'a> GraphBlock<'a> {
    /// Divides the particles into blocks of `count` groups, the last one shorter.
    pub(crate) fn chunks(self, count: usize) -> impl Iterator<Item = GraphBlock<'a>> {
        let mut rest = Some(self);
        std::iter::from_fn(move || {
            let (first, others) = rest.take()?.split_at(count);
            rest = (!others.particles.is_empty()).then_some(others);
            Some(first)
        })
        .filter(|block| !block.particles.is_empty())
    }

    /// Splits after `count` groups, or at the end if there are fewer.
    fn split_at(self, count: usize) -> (GraphBlock<'a>, GraphBlock<'a>) {
        let Self { tether_count, .. } = self;
        let end = |length: usize, wanted: usize| wanted.min(length);
        let (particles, other_particles) =
            self.particles.split_at_mut(end(self.particles.len(), count));
        let (predicted, other_predicted) =
            self.predicted.split_at_mut(end(self.predicted.len(), count));
        let (gains, other_gains) = self.gains.split_at(end(self.gains.len(), count));
        let (tethers, other_tethers) =
            self.tethers.split_at(end(self.tethers.len(), 8 * tether_count * count));
        let (tether_pulls, other_tether_pulls) =
            self.tether_pulls.split_at_mut(end(self.tether_pulls.len(), 8 * tether_count * count));
        let other = GraphBlock {
            first: self.first + 8 * particles.len(),
            particles: other_particles,
            predicted: other_predicted,
            gains: other_gains,
            tethers: other_tethers,
            tether_count,
            tether_pulls: other_tether_pulls,
        };
        let first = GraphBlock {
            first: self.first,
            particles,
            predicted,
            gains,
            tethers,
            tether_count,
            tether_pulls,
        };
        (first, other)
    }
}

/// Runs consecutive stages of single particles on a block.
pub(crate) struct BlockWork<'a, 'b> {
    pub(crate) block: GraphBlock<'a>,
    pub(crate) stages: &'b [ScheduledStage],
    pub(crate) inputs: &'b SubstepInputs<'b>,
    pub(crate) contacts: &'b mut Contacts,
}

impl LaneWork for BlockWork<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(mut self) {
        for ScheduledStage { stage, .. } in self.stages {
            run_stage::<W>(*stage, &mut self.block, self.inputs, self.contacts);
        }
    }
}

impl ParticleBlock for GraphBlock<'_> {
    fn group_count(&self) -> usize {
        self.particles.len()
    }

    fn first(&self) -> usize {
        self.first
    }

    fn inverse_mass(&self, index: usize) -> f32 {
        self.particles[index / 8][index % 8].0[3]
    }

    fn path(&self, index: usize) -> SubstepPath {
        let PackedParticle([x, y, z, _, dx, dy, dz, _]) = self.particles[index / 8][index % 8];
        SubstepPath { start: Vec3::new(x, y, z), displacement: Vec3::new(dx, dy, dz) }
    }

    fn predicted(&self, index: usize) -> Vec3 {
        let group = self.predicted.get(index / 8);
        group.map_or(Vec3::ZERO, |group| Vec3::from_array(lane_of(group, index % 8)))
    }

    fn set_displacement(&mut self, index: usize, displacement: Vec3) {
        let particle = &mut self.particles[index / 8][index % 8];
        particle.0[4..7].copy_from_slice(&displacement.to_array());
    }

    #[inline(always)]
    fn paths<W: Wide>(&self, group: usize) -> LanePath<W> {
        let [[x, y, z, _], [dx, dy, dz, _]] = W::columns(&self.particles[group]);
        LanePath { start: [x, y, z], displacement: [dx, dy, dz] }
    }

    #[inline(always)]
    fn inverse_masses<W: Wide>(&self, group: usize) -> W {
        let [[_, _, _, w], _] = W::columns(&self.particles[group]);
        w
    }

    #[inline(always)]
    fn predicted_lanes<W: Wide>(&self, group: usize) -> [W; 3] {
        self.predicted.get(group).map_or([W::splat(0.0); 3], load)
    }

    #[inline(always)]
    fn set_displacements<W: Wide>(&mut self, group: usize, displacements: [W; 3]) {
        W::set_displacements(&mut self.particles[group], displacements);
    }

    #[inline(always)]
    fn set_paths<W: Wide>(&mut self, group: usize, paths: &LanePath<W>) {
        let particles = &mut self.particles[group];
        W::set_displacements(particles, paths.displacement);
        W::set_positions(particles, paths.start);
    }

    #[inline(always)]
    fn predict<W: Wide>(&mut self, prediction: &Prediction) {
        for (group, particles) in self.particles.iter_mut().enumerate() {
            let [[_, _, _, w], [x, y, z, _]] = W::columns(particles);
            let wind = match self.gains.get(group) {
                None => [W::splat(0.0); 3],
                Some(gains) => load(gains),
            };
            let after = prediction.predict([x, y, z], wind, w);
            W::set_displacements(particles, after);
            if let Some(predicted) = self.predicted.get_mut(group) {
                store(after, predicted);
            }
        }
    }

    #[inline(always)]
    fn pull_to_roots<W: Wide>(&mut self) {
        let particles = self.particles.as_flattened_mut().iter_mut();
        let (tethers, count) = (self.tethers.chunks_exact(self.tether_count), self.tether_count);
        if self.tether_pulls.is_empty() {
            for (particle, tethers) in particles.zip(tethers) {
                pull_to_roots(particle, tethers, |_, _| {});
            }
            return;
        }
        let pulls = self.tether_pulls.chunks_exact_mut(count);
        for (particle, (tethers, pulls)) in particles.zip(tethers.zip(pulls)) {
            let mass = 1.0 / particle.0[3];
            pull_to_roots(particle, tethers, |slot, excess| {
                for (sum, excess) in pulls[slot].iter_mut().zip(excess) {
                    *sum += mass * excess;
                }
            });
        }
    }

    #[inline(always)]
    fn advance<W: Wide>(&mut self) {
        for PackedParticle(numbers) in self.particles.as_flattened_mut() {
            let (x, d) = numbers.split_at_mut(4);
            // All four at once: 0 is added to the inverse mass.
            for (x, d) in x.iter_mut().zip(d) {
                *x += *d;
            }
        }
    }
}

/// Shortens d to each tether. Passes the displacement that a tether has taken to `note`.
#[inline(always)]
fn pull_to_roots(
    particle: &mut PackedParticle,
    tethers: &[PackedTether],
    mut note: impl FnMut(usize, [f32; 3]),
) {
    let is_attached = |(_, tether): &(_, &PackedTether)| tether.length < f32::INFINITY;
    for (slot, tether) in tethers.iter().enumerate().filter(is_attached) {
        let PackedParticle([x, y, z, w, dx, dy, dz, _]) = *particle;
        let [root_x, root_y, root_z] = tether.root;
        let excess = tether_excess(Tethered {
            start: [x - root_x, y - root_y, z - root_z],
            displacement: [dx, dy, dz],
            limit: RestLength::new(tether.length),
            inverse_mass: w,
        });
        for (number, excess) in particle.0[4..7].iter_mut().zip(excess.unwrap_or([0.0; 3])) {
            *number -= excess;
        }
        if let Some(excess) = excess {
            note(slot, excess);
        }
    }
}
