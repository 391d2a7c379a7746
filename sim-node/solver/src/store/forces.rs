//! The measurement of what particles do to colliders and fixed particles.

use glam::DVec3;
use sim_scene::constraints::Constraint;
use sim_scene::model::Model;

use super::graph::Graph;
use super::graph::forces::Projections;
use super::pulls::{Pull, TetherEnds};
use super::rows::RowForces;
use super::{Location, ParticleStore};
use crate::contacts::contact::reaction::{Reaction, ReactionRoom, take_impulses};
use crate::state::particles::Particle;

/// The particles of a constraint or bend, with the coefficients of its gradient.
struct Link {
    particles: [u32; 4],
    coefficients: [f32; 4],
    place: LinkPlace,
}

/// The part of the store that projects a constraint or bend, and the number of the projection there.
#[derive(Clone, Copy)]
struct LinkPlace {
    /// None for the graph.
    rows: Option<usize>,
    projection: usize,
}

/// A fixed particle, and its index among those that are fixed.
#[derive(Clone, Copy)]
struct FixedParticle {
    particle: u32,
    receiver: usize,
}

impl ParticleStore {
    /// Measures forces on the fixed particles in each further step. Call it again when other particles are fixed, or
    /// when particles, constraints or tethers have moved.
    pub(crate) fn measure_forces(
        &mut self,
        model: &Model,
        states: &[Particle],
        fixed: &[u32],
        tethers: impl Iterator<Item = TetherEnds>,
    ) {
        let projections = self.graph.projections();
        let mut in_graph = Vec::new();
        let mut in_rows = vec![Vec::new(); self.patches.len() + self.crowds.len()];
        let incidence = model.incidence();
        for (receiver, particle) in fixed.iter().enumerate() {
            for number in incidence.of(*particle) {
                let link = self.link(model, &projections, *number);
                let fixed = FixedParticle { particle: *particle, receiver };
                let pulls = match link.place.rows {
                    None => &mut in_graph,
                    Some(rows) => &mut in_rows[rows],
                };
                pulls.extend(self.pull(&link, states, fixed));
            }
        }
        self.graph.measure_forces(in_graph, projections);
        let mut in_rows = in_rows.into_iter();
        for (patch, pulls) in self.patches.iter_mut().zip(&mut in_rows) {
            patch.measure_forces(pulls);
        }
        for (crowd, pulls) in self.crowds.iter_mut().zip(in_rows) {
            crowd.measure_forces(pulls);
        }
        let mut tethers = tethers.peekable();
        let mut receivers = vec![None; tethers.peek().map_or(0, |_| states.len())];
        if !receivers.is_empty() {
            (0..).zip(fixed).for_each(|(index, one)| receivers[*one as usize] = Some(index));
        }
        for TetherEnds { particle, slot, root } in tethers {
            let Some(receiver) = receivers[root as usize] else { continue };
            let location = self.location(particle);
            let index = location.index();
            match self.rows_mut(location) {
                None => self.graph.set_tether_receiver(index, slot, receiver),
                Some(rows) => rows.set_tether_receiver(index, slot, receiver),
            }
        }
    }

    /// Measures no forces any longer.
    pub(crate) fn forget_forces(&mut self) {
        self.measure_reactions(ReactionRoom::default());
        self.graph.forget_forces();
        for patch in &mut self.patches {
            patch.forget_forces();
        }
        for crowd in &mut self.crowds {
            crowd.rows.forces = RowForces::default();
        }
    }

    /// Measures the reactions of colliders in each further step.
    pub(crate) fn measure_reactions(&mut self, room: ReactionRoom) {
        self.contact_room.reactions = room;
        self.workers.reserve_reactions(room);
    }

    /// Moves the numbers of contacts in a substep, by collider, to their totals.
    pub(crate) fn take_contacts(&mut self, totals: &mut [u32]) {
        for worker in self.workers.reactions() {
            for (collider, total) in totals.iter_mut().enumerate() {
                *total += worker.take_contacts(collider);
            }
        }
    }

    /// Moves the reactions of a step to those of the colliders.
    pub(crate) fn take_reactions(&mut self, totals: &mut [Reaction]) {
        for (collider, total) in totals.iter_mut().enumerate() {
            take_impulses(self.workers.reactions(), collider, total);
        }
    }

    /// Moves the impulses of a step, times the length of a substep, to those of the fixed particles.
    pub(crate) fn take_pulls(&mut self, impulses: &mut [DVec3]) {
        self.graph.take_pulls(impulses);
        for rows in self.all_rows_mut() {
            rows.take_pulls(impulses);
        }
    }

    /// A constraint or bend with this number in [`Incidence`](sim_scene::constraints::incidence::Incidence).
    fn link(&self, model: &Model, projections: &Projections, number: u32) -> Link {
        let number = number as usize;
        match number.checked_sub(model.constraints.len()) {
            None => self.constraint_link(model, projections, number),
            Some(bend) => self.bend_link(model, projections, bend),
        }
    }

    fn constraint_link(&self, model: &Model, projections: &Projections, constraint: usize) -> Link {
        let Constraint { a, b, .. } = model.constraints[constraint];
        let location = self.locations[constraint];
        Link {
            particles: [a, b, a, a],
            coefficients: [1.0, -1.0, 0.0, 0.0],
            place: self.place_of(location, |row| match location.rows() {
                None => self.graph.projection_of_constraint(projections, location.index()),
                Some(rows) => match self.patches.get(rows) {
                    Some(patch) => patch.projection_of_constraint(model.families[constraint], row),
                    None => self.crowds[rows - self.patches.len()]
                        .projection_of_constraint(location.index()),
                },
            }),
        }
    }

    fn bend_link(&self, model: &Model, projections: &Projections, index: usize) -> Link {
        let (bend, family) = (&model.bends[index], model.bend_families[index]);
        let location = self.bends.locations[index];
        Link {
            particles: bend.particles,
            coefficients: bend.coefficients,
            place: self.place_of(location, |row| match location.rows() {
                None => self.graph.projection_of_bend(projections, location.index()),
                Some(sheet) => self.patches[sheet].projection_of_bend(family, row),
            }),
        }
    }

    /// Place of a constraint or bend, where `projection` tells its number for the row in which it begins.
    fn place_of(&self, location: Location, projection: impl Fn(usize) -> usize) -> LinkPlace {
        let row = self.rows(location).map_or(0, |rows| location.index() / rows.layout.length);
        LinkPlace { rows: location.rows(), projection: projection(row) }
    }

    /// The pull of a constraint or bend on one of its particles, which is fixed. None if all are fixed.
    fn pull(&self, link: &Link, states: &[Particle], fixed: FixedParticle) -> Option<Pull> {
        let ends = || {
            let all = link.particles.iter().zip(link.coefficients);
            all.filter(|(_, coefficient)| *coefficient != 0.0)
        };
        let inverse_mass = |particle: u32| states[particle as usize].inverse_mass;
        let (free, share) = ends().find(|(one, _)| inverse_mass(**one) > 0.0)?;
        let (_, coefficient) = ends().find(|(one, _)| **one == fixed.particle)?;
        Some(Pull {
            projection: link.place.projection,
            at: self.displacement_place(*free),
            receiver: fixed.receiver,
            factor: coefficient / share / inverse_mass(*free),
        })
    }

    /// Where the x displacement of a particle is among the numbers of the graph or its sheet.
    fn displacement_place(&self, particle: u32) -> usize {
        let location = self.location(particle);
        match self.rows(location) {
            None => Graph::displacement_place(location.index()),
            Some(rows) => rows.displacement_place(location.index()),
        }
    }
}
