//! The measurement of what particles do to colliders and fixed particles.

use glam::DVec3;

use super::graph::Graph;
use super::graph::forces::Projections;
use super::pulls::{Pull, Receivers, TetherEnds};
use super::rows::RowForces;
use super::{Location, ParticleStore};
use crate::contacts::contact::reaction::{BlockReaction, Reaction, ReactionSum};
use crate::scene::model::Model;
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

impl ParticleStore {
    /// Measures forces in each further step. Call it again when other particles are fixed, or when particles,
    /// constraints or tethers have moved.
    pub(crate) fn measure_forces(
        &mut self,
        model: &Model,
        states: &[Particle],
        receivers: &Receivers<'_>,
        tethers: impl Iterator<Item = TetherEnds>,
    ) {
        let projections = self.graph.projections();
        let mut in_graph = Vec::new();
        let mut in_rows = vec![Vec::new(); self.patches.len() + self.crowds.len()];
        for link in self.links(model, &projections) {
            let pulls = match link.place.rows {
                None => &mut in_graph,
                Some(rows) => &mut in_rows[rows],
            };
            self.push_pulls(&link, states, receivers, pulls);
        }
        self.graph.measure_forces(in_graph, projections, receivers.collider_count);
        let mut in_rows = in_rows.into_iter();
        for (patch, pulls) in self.patches.iter_mut().zip(&mut in_rows) {
            patch.measure_forces(pulls, receivers.collider_count);
        }
        for (crowd, pulls) in self.crowds.iter_mut().zip(in_rows) {
            crowd.measure_forces(pulls, receivers.collider_count);
        }
        for TetherEnds { particle, slot, root } in tethers {
            let Some(receiver) = receivers.of_particles[root as usize] else { continue };
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
        self.graph.forget_forces();
        for patch in &mut self.patches {
            patch.forget_forces();
        }
        for crowd in &mut self.crowds {
            crowd.rows.forces = RowForces::default();
        }
    }

    /// Moves the numbers of contacts in a substep, by collider, to their totals.
    pub(crate) fn take_contacts(&mut self, totals: &mut [u32]) {
        for block in self.reaction_blocks(totals.len()) {
            for (total, reaction) in totals.iter_mut().zip(block) {
                *total += std::mem::take(&mut reaction.single.contacts);
            }
        }
    }

    /// Moves the reactions of a step to those of the colliders, in the order of the particles' blocks.
    pub(crate) fn take_reactions(&mut self, totals: &mut [Reaction]) {
        let collider_count = totals.len();
        for (collider, total) in totals.iter_mut().enumerate() {
            let mut sum = ReactionSum::default();
            for block in self.reaction_blocks(collider_count) {
                sum.take(&mut block[collider]);
            }
            sum.add_to(total);
        }
    }

    /// The reactions of each block, by collider.
    fn reaction_blocks(
        &mut self,
        collider_count: usize,
    ) -> impl Iterator<Item = &mut [BlockReaction]> {
        let sheets = self.patches.iter_mut().map(|patch| &mut patch.rows);
        let rows = sheets.chain(self.crowds.iter_mut().map(|crowd| &mut crowd.rows));
        let in_rows = rows.map(|rows| &mut rows.forces.reactions);
        let parts = std::iter::once(&mut self.graph.forces_mut().reactions).chain(in_rows);
        parts.flat_map(move |part| part.chunks_exact_mut(collider_count.max(1)))
    }

    /// Moves the impulses of a step, times the length of a substep, to those of the fixed particles.
    pub(crate) fn take_pulls(&mut self, impulses: &mut [DVec3]) {
        self.graph.take_pulls(impulses);
        for rows in self.all_rows_mut() {
            rows.take_pulls(impulses);
        }
    }

    /// The constraints and bends of a scene.
    fn links<'a>(
        &'a self,
        model: &'a Model,
        projections: &'a Projections,
    ) -> impl Iterator<Item = Link> + 'a {
        let constraints = (0_u32..).zip(&model.families).map(|(constraint, family)| {
            let [a, b] = model.pair(constraint);
            let location = self.locations[constraint as usize];
            Link {
                particles: [a, b, a, a],
                coefficients: [1.0, -1.0, 0.0, 0.0],
                place: self.place_of(location, |row| match location.rows() {
                    None => self.graph.projection_of_constraint(projections, location.index()),
                    Some(rows) => match self.patches.get(rows) {
                        Some(patch) => patch.projection_of_constraint(*family, row),
                        None => self.crowds[rows - self.patches.len()]
                            .projection_of_constraint(location.index()),
                    },
                }),
            }
        });
        let bends = (0..).zip(&model.bends).zip(&model.bend_families);
        let bends = bends.map(|((index, bend), family): ((usize, _), _)| {
            let location = self.bends.locations[index];
            Link {
                particles: bend.particles,
                coefficients: bend.coefficients,
                place: self.place_of(location, |row| match location.rows() {
                    None => self.graph.projection_of_bend(projections, location.index()),
                    Some(sheet) => self.patches[sheet].projection_of_bend(*family, row),
                }),
            }
        });
        constraints.chain(bends)
    }

    /// Place of a constraint or bend, where `projection` tells its number for the row in which it begins.
    fn place_of(&self, location: Location, projection: impl Fn(usize) -> usize) -> LinkPlace {
        let row = self.rows(location).map_or(0, |rows| location.index() / rows.layout.length);
        LinkPlace { rows: location.rows(), projection: projection(row) }
    }

    /// Pushes a pull for each fixed particle of a constraint or bend.
    fn push_pulls(
        &self,
        link: &Link,
        states: &[Particle],
        receivers: &Receivers<'_>,
        pulls: &mut Vec<Pull>,
    ) {
        let ends = || {
            let all = link.particles.iter().zip(link.coefficients);
            all.filter(|(_, coefficient)| *coefficient != 0.0)
        };
        let inverse_mass = |particle: u32| states[particle as usize].inverse_mass;
        let Some((free, share)) = ends().find(|(one, _)| inverse_mass(**one) > 0.0) else { return };
        let fixed = ends().filter_map(|(particle, coefficient)| {
            Some((receivers.of_particles[*particle as usize]?, coefficient))
        });
        for (receiver, coefficient) in fixed {
            pulls.push(Pull {
                projection: link.place.projection,
                at: self.displacement_place(*free),
                receiver: receiver as usize,
                factor: coefficient / share / inverse_mass(*free),
            });
        }
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
