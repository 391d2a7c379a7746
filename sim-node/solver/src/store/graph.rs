//! Particles and constraints outside of sheets and crowds: batches of eight constraints that share no particle.

mod batch;
mod bends;
pub(crate) mod block;
pub(crate) mod forces;
mod group;
mod indices;
mod measure;
mod wind;

use sim_scene::constraints::sides::TornSides;
use sim_scene::model::Model;

use batch::Batch;
use bends::GraphBends;
use block::{BLOCK_GROUPS, BlockWork, GraphBlock, PackedTether};
use forces::{GraphForces, MovedParticles};
use group::ConstraintGroup;
pub(crate) use group::part_count;
pub(crate) use indices::find_particle;
use wind::{GraphSurface, GraphWindWork};

use super::layout::{Layout, Location, SceneFields};
use super::publish::{PublishedMotion, publish};
use super::workers::{WorkerScratch, Workers};
use crate::constraints::bends::projection::BendPass;
use crate::constraints::column_writer::{ColumnOrder, ColumnWriter};
use crate::constraints::columns::{ConstraintColumns, FullPass};
use crate::constraints::fields::Pass;
use crate::constraints::order::ProjectionOrder;
use crate::constraints::parameters::{ConstraintParameters, PassSoftness};
use crate::kernels::Kernels;
use crate::kernels::huge_pages::refill;
use crate::kernels::lanes::{Lanes8, PackedParticle};
use crate::kernels::vectors::lane_of;
use crate::state::particles::Particle;
use crate::step::schedule::{Schedule, ScheduledStage};
use crate::step::stage::Stage;
use crate::step::substep::SubstepInputs;
use crate::step::wind::WindStep;

/// Every particle and constraint outside of sheets and crowds.
#[derive(Debug, Clone, Default)]
pub(crate) struct Graph {
    /// The particles in groups of eight, with at least one more for the padding of lane groups. Nothing moves
    /// the padding.
    particles: Vec<PackedParticle>,
    /// By particle: its index in the scene, ascending.
    indices: Vec<u32>,
    /// By group of eight particles, padding included: the predicted displacements; empty in scenes without
    /// bounces.
    predicted: Vec<[Lanes8; 3]>,
    /// By group of eight particles, padding included: the velocities that the wind adds in a substep; empty
    /// in scenes without wind.
    gains: Vec<[Lanes8; 3]>,
    /// Empty in scenes without wind.
    surface: GraphSurface,
    /// By particle: its tethers; empty in scenes without tethers.
    tethers: Vec<PackedTether>,
    groups: Vec<ConstraintGroup>,
    /// By lane group: the two particles of each constraint.
    ends: Vec<[[u32; 8]; 2]>,
    /// By lane group: their inverse masses.
    inverse_masses: Vec<[Lanes8; 2]>,
    /// Columns of the constraints, each as long as 8 `ends`.
    columns: Vec<f32>,
    column_order: ColumnOrder,
    bends: GraphBends,
    layout: Layout,
    /// Softness of all constraints, unless they differ.
    softness: PassSoftness,
    schedule: Schedule,
    forces: GraphForces,
}

/// A constraint between particles of the graph.
struct GraphLink {
    /// Index of the constraint in the scene.
    constraint: u32,
    /// Indices in the graph.
    ends: [u32; 2],
}

impl Graph {
    /// Makes the graph of the particles with these scene indices, which must ascend. Enters the
    /// location of each of its constraints into `locations`, which is indexed by constraint.
    pub(crate) fn new(
        model: &Model,
        order: &ProjectionOrder,
        indices: Vec<u32>,
        locations: &mut [Location],
    ) -> Self {
        let mut graph = Self { indices, ..Self::default() };
        let length = (graph.indices.len() + 1).next_multiple_of(8);
        refill(&mut graph.particles, length, PackedParticle::default());
        for (group, range) in order.groups.iter().enumerate() {
            let links: Vec<_> = order.indices[range.clone()]
                .iter()
                .filter_map(|constraint| {
                    let [a, b] = model.pair(*constraint);
                    let ends = [graph.find(a)?, graph.find(b)?];
                    Some(GraphLink { constraint: *constraint, ends })
                })
                .collect();
            if !links.is_empty() {
                let is_independent = group < order.independent_count;
                graph.push(&links, is_independent, locations);
            }
        }
        refill(&mut graph.inverse_masses, graph.ends.len(), [[0.0; 8]; 2]);
        graph
    }

    /// Index of a particle of the scene in the graph, unless it lies in a sheet or a crowd.
    pub(crate) fn find(&self, particle: u32) -> Option<u32> {
        find_particle(&self.indices, particle)
    }

    /// Collects the bends of the graph. Enters their locations into `locations`, which is indexed by bend.
    pub(crate) fn set_bends(
        &mut self,
        model: &Model,
        order: &ProjectionOrder,
        locations: &mut [Location],
    ) {
        self.bends = GraphBends::new(model, order, &self.indices, locations);
    }

    /// Sets the scaled compliance of a bend; infinite for one without effect.
    pub(crate) fn set_bend(&mut self, index: usize, scaled_compliance: f32) {
        self.bends.set(index, scaled_compliance);
    }

    fn push(&mut self, links: &[GraphLink], is_independent: bool, locations: &mut [Location]) {
        let first = self.ends.len();
        #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 particles")]
        let padding = self.indices.len() as u32;
        for lane_group in links.chunks(8) {
            let mut ends = [[padding; 8]; 2];
            for (lane, GraphLink { constraint, ends: [a, b] }) in lane_group.iter().enumerate() {
                assert!(*a.max(b) < padding, "a constraint names a particle outside of the graph");
                let index = 8 * self.ends.len() + lane;
                locations[*constraint as usize] = Location::in_graph(index);
                (ends[0][lane], ends[1][lane]) = (*a, *b);
            }
            self.ends.push(ends);
        }
        let lane_groups = first..self.ends.len();
        self.groups.push(ConstraintGroup { lane_groups, count: links.len(), is_independent });
    }

    pub(crate) fn particle_count(&self) -> usize {
        self.indices.len()
    }

    /// Number of groups of eight that contain particles.
    fn group_count(&self) -> usize {
        self.particle_count().div_ceil(8)
    }

    /// Sets the fields in use, and the softness of constraints that have none of their own.
    pub(crate) fn use_fields(&mut self, layout: Layout, softness: PassSoftness) {
        (self.layout, self.softness) = (layout, softness);
        let (constraints, bends) = (self.groups.iter(), self.bends.groups.iter());
        let optional = layout.optional_stages();
        self.schedule.rebuild(optional, &constraints.map(|_| 0), &bends.map(|_| 0));
    }

    /// Allocates the fields of the layout. Every constraint and bend is inactive afterwards.
    pub(crate) fn allocate(&mut self, model: &Model) {
        let Layout { constraints, scene, .. } = self.layout;
        let SceneFields { bounces, wind, tethers, bend_multipliers, .. } = scene;
        let group_count = self.particles.len() / 8;
        self.predicted = vec![[[0.0; 8]; 3]; if bounces { group_count } else { 0 }];
        self.gains = vec![[[0.0; 8]; 3]; if wind { group_count } else { 0 }];
        self.surface =
            if wind { GraphSurface::new(model, &self.indices) } else { GraphSurface::default() };
        let none = PackedTether { root: [0.0; 3], length: f32::INFINITY };
        self.tethers = vec![none; tethers * self.indices.len()];
        self.bends.allocate(bend_multipliers);
        let length = 8 * self.ends.len();
        refill(&mut self.columns, constraints.column_count() * length, 0.0);
        self.column_order = ColumnOrder::new(constraints);
        for index in 0..length {
            self.writer().set(index, &ConstraintParameters::INACTIVE);
        }
    }

    /// Writer for the constraints, by the indices of their locations.
    pub(crate) fn writer(&mut self) -> ColumnWriter<'_> {
        ColumnWriter::new(&mut self.columns, 8 * self.ends.len(), self.column_order)
    }

    /// Copies the state at the start of a step, with velocities in the place of displacements.
    pub(crate) fn unpack(&mut self, states: &[Particle]) {
        let mut is_mass_changed = false;
        for (particle, index) in self.particles.iter_mut().zip(&self.indices) {
            let state = &states[*index as usize];
            let ([x, y, z], [vx, vy, vz]) = (state.position, state.velocity);
            is_mass_changed |= particle.0[3] != state.inverse_mass;
            *particle = PackedParticle([x, y, z, state.inverse_mass, vx, vy, vz, 0.0]);
        }
        if is_mass_changed {
            self.update_inverse_masses();
        }
    }

    /// Copies the inverse masses of the particles to the constraints.
    fn update_inverse_masses(&mut self) {
        for (ends, inverse_masses) in self.ends.iter().zip(&mut self.inverse_masses) {
            for (ends, inverse_masses) in ends.iter().zip(inverse_masses) {
                for (particle, inverse_mass) in ends.iter().zip(inverse_masses) {
                    *inverse_mass = self.particles[*particle as usize].0[3];
                }
            }
        }
        self.bends.update_inverse_masses(&self.particles);
    }

    /// Writes the state back. Returns the number of particles that froze.
    pub(crate) fn pack(&self, states: &mut [Particle], h: f32) -> u64 {
        let mut frozen_count = 0;
        for (particle, index) in self.particles.iter().zip(&self.indices) {
            let PackedParticle([x, y, z, _, dx, dy, dz, _]) = *particle;
            let motion = PublishedMotion { position: [x, y, z], displacement: [dx, dy, dz], h };
            frozen_count += u64::from(publish(&mut states[*index as usize], motion));
        }
        frozen_count
    }

    /// Runs the stages of a pass on all particles. Returns true if any constraint was marked as
    /// torn.
    pub(crate) fn run_pass(
        &mut self,
        workers: &mut Workers,
        pass: Pass,
        inputs: &SubstepInputs<'_>,
    ) -> bool {
        if self.indices.is_empty() {
            return false;
        }
        let schedule = std::mem::take(&mut self.schedule);
        let stages = schedule.of_pass(pass);
        let mut is_marked = false;
        // Stages of single particles run together, block by block.
        for run in stages.chunk_by(|a, b| !a.stage.is_grouped() && !b.stage.is_grouped()) {
            if inputs.is_given_up() {
                break;
            }
            let ScheduledStage { stage, group, .. } = run[0];
            match stage {
                Stage::Project => is_marked |= self.project(workers, group, pass),
                Stage::Bend => {
                    self.bend(workers, group, BendPass::new(pass, inputs.relaxation));
                }
                Stage::LimitStretch => self.limit_stretch(workers, group),
                _ => self.run_particle_stages(workers, run, inputs),
            }
        }
        self.schedule = schedule;
        is_marked
    }

    /// Runs the stages behind the division of the sweep.
    pub(crate) fn run_ending(&mut self, workers: &mut Workers, inputs: &SubstepInputs<'_>) {
        let schedule = std::mem::take(&mut self.schedule);
        self.run_particle_stages(workers, schedule.ending(), inputs);
        self.schedule = schedule;
    }

    fn run_particle_stages(
        &mut self,
        workers: &mut Workers,
        stages: &[ScheduledStage],
        inputs: &SubstepInputs<'_>,
    ) {
        let (count, kernels) = (self.group_count(), workers.kernels);
        let part_count = part_count(self.particle_count(), workers.count());
        let length = count.div_ceil(part_count).next_multiple_of(BLOCK_GROUPS);
        let (groups, _) = self.particles.as_chunks_mut();
        let all = GraphBlock {
            first: 0,
            particles: &mut groups[..count],
            predicted: &mut self.predicted,
            gains: if self.layout.is_wind_used { &self.gains } else { &[] },
            tethers: &self.tethers,
            tether_count: self.layout.scene.tethers,
            tether_pulls: &mut self.forces.tether_pulls,
        };
        let parts = all.chunks(length).map(Some);
        let work = |part: &mut Option<GraphBlock<'_>>, scratch: &mut WorkerScratch| {
            for block in part.take().into_iter().flat_map(|part| part.chunks(BLOCK_GROUPS)) {
                if inputs.is_given_up() {
                    return;
                }
                let contacts = &mut scratch.contacts;
                kernels.run(BlockWork { block, stages, inputs, contacts });
            }
        };
        workers.for_each(parts, work, |_| {});
    }

    fn project(&mut self, workers: &mut Workers, group: usize, pass: Pass) -> bool {
        let (used, softness) = (self.layout.used, self.softness);
        let (batch, columns) = self.batch(group);
        let lane_groups = batch.group.lane_groups.clone();
        if used.are_rigid(softness.scaled_compliance) {
            batch.project(columns.rigid(&lane_groups, softness.share), workers)
        } else {
            let full_pass = FullPass { used, softness, pass };
            batch.project(columns.full(&lane_groups, &full_pass), workers)
        }
    }

    fn bend(&mut self, workers: &mut Workers, group: usize, pass: BendPass) {
        let Self { particles, bends, forces, .. } = self;
        let first = forces.projections.of_bends(group);
        let moved = MovedParticles { particles, pulls: &mut forces.pulls, first };
        bends.project(group, moved, workers, pass);
    }

    fn limit_stretch(&mut self, workers: &mut Workers, group: usize) {
        let (batch, columns) = self.batch(group);
        let limit = columns.stretch_limit(&batch.group.lane_groups);
        batch.project(limit, workers);
    }

    fn batch(&mut self, group: usize) -> (Batch<'_>, ConstraintColumns<'_>) {
        let length = 8 * self.ends.len();
        let Self { particles, ends, inverse_masses, columns, groups, layout, forces, .. } = self;
        let first = forces.projections.of_constraints(group);
        let moved = MovedParticles { particles, pulls: &mut forces.pulls, first };
        let group = &groups[group];
        let lane_groups = group.lane_groups.clone();
        let (ends, inverse_masses) = (&ends[lane_groups.clone()], &inverse_masses[lane_groups]);
        let columns = ConstraintColumns::new(columns, length, layout.constraints);
        (Batch { group, moved, ends, inverse_masses }, columns)
    }

    pub(crate) fn position(&self, index: usize) -> [f32; 3] {
        let [x, y, z, ..] = self.particles[index].0;
        [x, y, z]
    }

    pub(crate) fn displacement(&self, index: usize) -> [f32; 3] {
        let [_, _, _, _, x, y, z, _] = self.particles[index].0;
        [x, y, z]
    }

    /// Displacement before any constraint or contact; 0 in a scene without bounces.
    pub(crate) fn predicted(&self, index: usize) -> [f32; 3] {
        self.predicted.get(index / 8).map_or([0.0; 3], |group| lane_of(group, index % 8))
    }

    /// Returns the particles, and the padding behind them.
    pub(crate) fn packed_particles(&self) -> &[PackedParticle] {
        &self.particles
    }

    pub(crate) fn packed_particle(&self, index: usize) -> PackedParticle {
        self.particles[index]
    }

    pub(crate) fn set_position(&mut self, index: usize, position: [f32; 3]) {
        self.particles[index].0[..3].copy_from_slice(&position);
    }

    pub(crate) fn set_displacement(&mut self, index: usize, displacement: [f32; 3]) {
        self.particles[index].0[4..7].copy_from_slice(&displacement);
    }

    /// Takes the triangles with torn sides out of the wind.
    pub(crate) fn follow_triangles(&mut self, triangles: &TornSides) {
        self.surface.share_masses(|triangle| triangles.is_whole(triangle));
    }

    /// Computes the velocities that the wind adds in the running substep.
    pub(crate) fn blow(&mut self, kernels: Kernels, wind: &WindStep) {
        let Self { particles, surface, gains, .. } = self;
        kernels.run(GraphWindWork { particles, triangles: &surface.groups, gains, wind });
    }

    pub(crate) fn tether_mut(&mut self, index: usize, slot: usize) -> &mut PackedTether {
        &mut self.tethers[index * self.layout.scene.tethers + slot]
    }
}
