//! Generated tethers: every free particle is kept within the length of the shortest rigid path to
//! a fixed one (Long Range Attachments: Kim, Chentanez, Mueller 2012).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use sim_types::ParticleFlags;

use crate::bodies::{Bodies, Place};
use crate::parameters::Parameters;
use crate::particles::Particles;
use crate::scene::{Model, Softness};
use crate::tear::Torn;
use sim_types::ConstraintKind;

/// The tethers of a scene. Empty where it has none.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tethers {
    /// What they were worked out from.
    pub(crate) basis: Basis,
    /// Parents before children.
    all: Vec<Tether>,
    /// Those whose root moves, with where both ends are: theirs follow it.
    leads: Vec<Lead>,
}

/// A tether whose root moves.
#[derive(Debug, Clone, Copy)]
struct Lead {
    particle: Place,
    root: Place,
}

/// What tethers follow from, beside the scene and its parameters: part of a keyframe.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Basis {
    /// Particles that were fixed when they were worked out, ascending.
    pub(crate) roots: Vec<u32>,
    /// Constraints that were torn by then, ascending. What tore later only drops tethers.
    pub(crate) torn: Vec<u32>,
}

/// One tether.
#[derive(Debug, Clone, Copy)]
struct Tether {
    particle: u32,
    root: u32,
    length: f32,
    /// The tether of the particle before it on the path; none if that is the root itself.
    parent: Option<u32>,
    /// The last constraint of the path.
    constraint: u32,
    /// A constraint of the path is torn.
    is_dropped: bool,
}

/// A way to a particle that may be the shortest. Ordered by length, then by root, then by particle,
/// so that equal lengths have one winner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Way {
    /// The bits of a length >= 0 in f64, which are ordered as it is.
    length_bits: u64,
    root: u32,
    particle: u32,
    parent: Option<u32>,
    constraint: u32,
}

/// A particle that the shortest way is known to.
#[derive(Debug, Clone, Copy)]
struct Reached {
    particle: u32,
    root: u32,
    length: f64,
    /// Its own tether; none for a root.
    tether: Option<u32>,
}

impl Tethers {
    /// Works out the tethers of the state as it is: roots are what is pinned or anchored, and not
    /// in somebody's hand.
    pub(crate) fn of_state(
        model: &Model,
        parameters: &Parameters,
        particles: &Particles,
        torn: &[u32],
    ) -> Self {
        let is_root = |flags: u32| {
            flags & (ParticleFlags::PINNED | ParticleFlags::ANCHORED) != 0
                && flags & ParticleFlags::GRABBED == 0
        };
        let states = (0_u32..).zip(&particles.states);
        let roots = states.filter(|(_, one)| is_root(one.flags)).map(|(index, _)| index).collect();
        let mut torn = torn.to_vec();
        torn.sort_unstable();
        Self::new(model, parameters, Basis { roots, torn })
    }

    /// Works out the tethers from their basis: Dijkstra over rigid constraints that were whole and
    /// are no bends.
    pub(crate) fn new(model: &Model, parameters: &Parameters, basis: Basis) -> Self {
        let links = Links::new(model, parameters, &basis.torn);
        let mut is_reached = vec![false; model.particles.len()];
        let mut ways = BinaryHeap::new();
        for root in &basis.roots {
            is_reached[*root as usize] = true;
        }
        for root in &basis.roots {
            let reached = Reached { particle: *root, root: *root, length: 0.0, tether: None };
            links.push_ways(&mut ways, reached);
        }
        let mut all: Vec<Tether> = Vec::new();
        while let Some(Reverse(way)) = ways.pop() {
            if std::mem::replace(&mut is_reached[way.particle as usize], true) {
                continue;
            }
            let length = f64::from_bits(way.length_bits);
            #[allow(
                clippy::cast_possible_truncation,
                reason = "one rounding; at most 2^24 tethers"
            )]
            let (rounded, tether) = (length as f32, Some(all.len() as u32));
            all.push(Tether {
                particle: way.particle,
                root: way.root,
                length: rounded,
                parent: way.parent,
                constraint: way.constraint,
                is_dropped: false,
            });
            let Way { particle, root, .. } = way;
            links.push_ways(&mut ways, Reached { particle, root, length, tether });
        }
        Self { basis, all, leads: Vec::new() }
    }

    /// Drops every tether whose path has a torn constraint.
    pub(crate) fn drop_torn(&mut self, torn: &Torn, bodies: &mut Bodies) {
        for place in 0..self.all.len() {
            let Tether { particle, parent, constraint, is_dropped, .. } = self.all[place];
            let is_cut_off = parent.is_some_and(|parent| self.all[parent as usize].is_dropped);
            if !is_dropped && (is_cut_off || torn.is_torn(constraint)) {
                self.all[place].is_dropped = true;
                bodies.set_tether(bodies.place(particle), f32::INFINITY);
            }
        }
    }

    /// Ties the bodies: from here to the next time, substeps pull them back.
    pub(crate) fn tie(&mut self, bodies: &mut Bodies, particles: &Particles) {
        if self.basis.roots.is_empty() {
            return;
        }
        self.leads.clear();
        for tether in self.all.iter().filter(|tether| !tether.is_dropped) {
            let [particle, root] = [tether.particle, tether.root].map(|one| bodies.place(one));
            bodies.set_tether(particle, tether.length);
            let state = &particles.states[tether.root as usize];
            bodies.set_root(particle, state.position);
            if state.flags & ParticleFlags::ANCHORED != 0 {
                self.leads.push(Lead { particle, root });
            }
        }
    }

    /// Frees the bodies of these tethers.
    pub(crate) fn untie(&self, bodies: &mut Bodies) {
        for tether in &self.all {
            bodies.set_tether(bodies.place(tether.particle), f32::INFINITY);
        }
    }

    /// Tells the bodies where roots that move are at the end of the substep.
    pub(crate) fn follow_roots(&self, bodies: &mut Bodies) {
        for Lead { particle, root } in &self.leads {
            let (position, displacement) = (bodies.position(*root), bodies.displacement(*root));
            bodies.set_root(*particle, [0, 1, 2].map(|axis| position[axis] + displacement[axis]));
        }
    }
}

/// The rigid constraints at each particle, in index order.
struct Links<'a> {
    model: &'a Model,
    /// Where the links of a particle begin in `constraints`; one more at the end.
    starts: Vec<u32>,
    constraints: Vec<u32>,
}

impl<'a> Links<'a> {
    fn new(model: &'a Model, parameters: &Parameters, torn: &[u32]) -> Self {
        let rigid = Softness::rigid(model.method).value();
        let mut is_link: Vec<bool> = model
            .constraints
            .iter()
            .map(|one| {
                let softness = parameters.softness(one.kind, one.compliance);
                one.kind != ConstraintKind::Bend && softness == rigid
            })
            .collect();
        for index in torn {
            is_link[*index as usize] = false;
        }
        let links = || (0_u32..).zip(&is_link).filter(|(_, is_link)| **is_link);
        let mut starts = vec![0_u32; model.particles.len() + 1];
        for particle in links().flat_map(|(index, _)| model.pair(index)) {
            starts[particle as usize + 1] += 1;
        }
        for particle in 1..starts.len() {
            starts[particle] += starts[particle - 1];
        }
        let mut next = starts.clone();
        let mut constraints = vec![0; starts[model.particles.len()] as usize];
        for (index, _) in links() {
            for particle in model.pair(index) {
                let place = &mut next[particle as usize];
                constraints[*place as usize] = index;
                *place += 1;
            }
        }
        Self { model, starts, constraints }
    }

    /// The ways on from a place.
    fn push_ways(&self, ways: &mut BinaryHeap<Reverse<Way>>, from: Reached) {
        let at = |particle: u32| self.starts[particle as usize] as usize;
        for constraint in &self.constraints[at(from.particle)..at(from.particle + 1)] {
            let [a, b] = self.model.pair(*constraint);
            let rest = f64::from(self.model.constraints[*constraint as usize].rest_length);
            let way = Way {
                length_bits: (from.length + rest).to_bits(),
                root: from.root,
                particle: if a == from.particle { b } else { a },
                parent: from.tether,
                constraint: *constraint,
            };
            ways.push(Reverse(way));
        }
    }
}
