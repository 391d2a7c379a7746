//! Blocks of packed particles, and the stages of single particles on them.

use glam::Vec3;

use crate::constraints::separation::RestLength;
use crate::constraints::tether_pull::{Tethered, tether_excess};
use crate::contacts::contact::Contacts;
use crate::contacts::path::SubstepPath;
use crate::contacts::zone::Zone;
use crate::kernels::lanes::{LaneWork, PackedParticle, Wide, axes};
use crate::step::particle_block::ParticleBlock;
use crate::step::particle_stages::run_stage;
use crate::step::prediction::Prediction;
use crate::step::schedule::ScheduledStage;
use crate::step::substep::SubstepInputs;

/// Particles of a block: few enough to stay in the cache from stage to stage, and a multiple of
/// eight.
pub(crate) const BLOCK_PARTICLES: usize = 256;

/// The tether of a packed particle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PackedTether {
    /// Position of the root at the end of the substep.
    pub(crate) root: [f32; 3],
    /// Infinite for no tether.
    pub(crate) length: f32,
}

/// Consecutive particles of the graph, with the arrays that only some scenes have; those are empty
/// in other scenes.
#[derive(Debug)]
pub(crate) struct GraphBlock<'a> {
    /// Index of the first particle in the graph.
    pub(crate) first: usize,
    pub(crate) particles: &'a mut [PackedParticle],
    pub(crate) predicted: &'a mut [[f32; 3]],
    pub(crate) gains: &'a [[f32; 3]],
    pub(crate) tethers: &'a [PackedTether],
    /// Tethers of each particle.
    pub(crate) tether_count: usize,
}

impl<'a> GraphBlock<'a> {
    /// Divides the particles into blocks of `count`, the last one shorter.
    pub(crate) fn chunks(self, count: usize) -> impl Iterator<Item = GraphBlock<'a>> {
        let mut rest = Some(self);
        std::iter::from_fn(move || {
            let (first, others) = rest.take()?.split_at(count);
            rest = (!others.particles.is_empty()).then_some(others);
            Some(first)
        })
        .filter(|block| !block.particles.is_empty())
    }

    /// Splits after `count` particles, or at the end if there are fewer.
    fn split_at(self, count: usize) -> (GraphBlock<'a>, GraphBlock<'a>) {
        let Self { first, particles, predicted, gains, tethers, tether_count } = self;
        let end = |length: usize| count.min(length);
        let (first_particles, particles) = particles.split_at_mut(end(particles.len()));
        let (first_predicted, predicted) = predicted.split_at_mut(end(predicted.len()));
        let (first_gains, gains) = gains.split_at(end(gains.len()));
        let tethers_end = tethers.len().min(tether_count * count);
        let (first_tethers, tethers) = tethers.split_at(tethers_end);
        let second = first + first_particles.len();
        let first = GraphBlock {
            first,
            particles: first_particles,
            predicted: first_predicted,
            gains: first_gains,
            tethers: first_tethers,
            tether_count,
        };
        (first, GraphBlock { first: second, particles, predicted, gains, tethers, tether_count })
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
    fn count(&self) -> usize {
        self.particles.len()
    }

    fn first(&self) -> usize {
        self.first
    }

    fn inverse_mass(&self, index: usize) -> f32 {
        self.particles[index].0[3]
    }

    fn path(&self, index: usize) -> SubstepPath {
        let PackedParticle([x, y, z, _, dx, dy, dz, _]) = self.particles[index];
        SubstepPath { start: Vec3::new(x, y, z), displacement: Vec3::new(dx, dy, dz) }
    }

    fn predicted(&self, index: usize) -> Vec3 {
        Vec3::from_array(self.predicted[index])
    }

    fn set_displacement(&mut self, index: usize, displacement: Vec3) {
        self.particles[index].0[4..7].copy_from_slice(&displacement.to_array());
    }

    fn set_position(&mut self, index: usize, position: Vec3) {
        self.particles[index].0[..3].copy_from_slice(&position.to_array());
    }

    #[inline(always)]
    fn may_touch<W: Wide>(&self, group: usize, zone: &Zone) -> bool {
        if let Some(particles) = self.particles[8 * group..].first_chunk::<8>() {
            let [[x, y, z, _], [dx, dy, dz, _]] = W::columns(particles);
            return W::any(zone.may_meet([x, y, z], [dx, dy, dz]));
        }
        self.particles[8 * group..].iter().any(|PackedParticle([x, y, z, _, dx, dy, dz, _])| {
            zone.may_meet([*x, *y, *z], [*dx, *dy, *dz])
        })
    }

    #[inline(always)]
    fn predict<W: Wide>(&mut self, prediction: &Prediction) {
        let gains = self.gains;
        let (groups, rest) = self.particles.as_chunks_mut::<8>();
        let grouped_count = 8 * groups.len();
        for (group, particles) in groups.iter_mut().enumerate() {
            let [[_, _, _, w], [x, y, z, _]] = W::columns(particles);
            let wind = match gains.get(8 * group..8 * group + 8) {
                None => [W::splat(0.0); 3],
                Some(gains) => {
                    axes(|axis| W::load(&std::array::from_fn(|lane| gains[lane][axis]), 0))
                }
            };
            W::set_displacements(particles, prediction.predict([x, y, z], wind, w));
        }
        for (index, particle) in rest.iter_mut().enumerate() {
            let PackedParticle([_, _, _, w, x, y, z, _]) = *particle;
            let wind = gains.get(grouped_count + index).copied().unwrap_or([0.0; 3]);
            particle.0[4..7].copy_from_slice(&prediction.predict([x, y, z], wind, w));
        }
        for (predicted, particle) in self.predicted.iter_mut().zip(self.particles.iter()) {
            let PackedParticle([_, _, _, _, x, y, z, _]) = *particle;
            *predicted = [x, y, z];
        }
    }

    #[inline(always)]
    fn pull_to_roots<W: Wide>(&mut self) {
        let of_particles = self.tethers.chunks_exact(self.tether_count);
        for (particle, tethers) in self.particles.iter_mut().zip(of_particles) {
            for tether in tethers.iter().filter(|tether| tether.length < f32::INFINITY) {
                pull_to_root(particle, tether);
            }
        }
    }

    #[inline(always)]
    fn advance<W: Wide>(&mut self) {
        for PackedParticle(numbers) in self.particles.iter_mut() {
            let (x, d) = numbers.split_at_mut(4);
            // All four at once: 0 is added to the inverse mass.
            for (x, d) in x.iter_mut().zip(d) {
                *x += *d;
            }
        }
    }
}

#[inline(always)]
fn pull_to_root(particle: &mut PackedParticle, tether: &PackedTether) {
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
}
