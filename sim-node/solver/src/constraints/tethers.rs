//! Generated tethers: each keeps a free particle within the length of the shortest rigid path to one of its
//! nearest fixed ones (Long Range Attachments: Kim, Chentanez, Mueller 2012).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use sim_scene::model::Model;
use sim_scene::scene::Softness;
use sim_types::{ConstraintKind, ParticleFlags};

use crate::parameters::Parameters;
use crate::state::particles::Particles;
use crate::state::tear::Torn;
use crate::store::{Location, ParticleStore, TetherEnds, TetherPlace};

/// The tethers of a scene; empty if it has none.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tethers {
    pub(crate) basis: TetherBasis,
    /// Parameters from which they were derived; None in a scene without tethers.
    parameters: Option<Parameters>,
    /// Parents before children.
    all: Vec<Tether>,
    /// Tethers whose root moves within a step.
    moving_roots: Vec<MovingRoot>,
}

/// A tether whose root moves.
#[derive(Debug, Clone, Copy)]
struct MovingRoot {
    tether: TetherPlace,
    root: Location,
}

/// The state from which tethers were derived, beside the scene and its parameters. Part of a
/// keyframe.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) struct TetherBasis {
    /// Particles that were fixed at that time, ascending.
    pub(crate) roots: Vec<u32>,
    /// Constraints that were torn at that time, ascending. Later tears only drop tethers.
    pub(crate) torn: Vec<u32>,
}

impl TetherBasis {
    /// Basis of a state.
    pub(crate) fn new(particles: &Particles, torn: &[u32]) -> Self {
        let states = (0_u32..).zip(&particles.states);
        let roots = states.filter(|(_, one)| is_root(one.flags)).map(|(index, _)| index).collect();
        let mut torn = torn.to_vec();
        torn.sort_unstable();
        Self { roots, torn }
    }

    /// Returns the memory of the lists, in bytes.
    pub(crate) fn size_bytes(&self) -> usize {
        size_of_val(self.roots.as_slice()) + size_of_val(self.torn.as_slice())
    }
}

/// One tether.
#[derive(Debug, Clone, Copy)]
struct Tether {
    particle: u32,
    root: u32,
    /// Number of roots of the particle that are nearer.
    slot: usize,
    length: f32,
    /// Tether of the previous particle on the path. None if that particle is the root.
    parent: Option<u32>,
    /// Last constraint of the path.
    constraint: u32,
    /// True if a constraint of the path is torn.
    is_dropped: bool,
}

/// A path to a particle that may be the shortest. Ordered by length, then by root, then by particle,
/// so that ties are decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct CandidatePath {
    /// Bits of a length >= 0 in f64, which have the order of the lengths.
    length_bits: u64,
    root: u32,
    particle: u32,
    parent: Option<u32>,
    constraint: u32,
}

/// A particle whose shortest path is known.
#[derive(Debug, Clone, Copy)]
struct Reached {
    particle: u32,
    root: u32,
    length: f64,
    /// Its own tether. None for a root.
    tether: Option<u32>,
}

/// Returns `true` for the flags of a particle that can be a root: pinned or anchored, and not grabbed.
pub(crate) fn is_root(flags: u32) -> bool {
    flags & (ParticleFlags::PINNED | ParticleFlags::ANCHORED) != 0
        && flags & ParticleFlags::GRABBED == 0
}

impl Tethers {
    /// Derives the tethers from their basis, by Dijkstra's algorithm over rigid constraints that are
    /// neither torn nor bends. Each particle keeps the paths to its `root_count` nearest roots.
    pub(crate) fn new(
        model: &Model,
        parameters: &Parameters,
        basis: TetherBasis,
        root_count: usize,
    ) -> Self {
        let links = Links::new(model, parameters, &basis.torn);
        let mut roots = RootsOfParticles::new(model.particles.len(), root_count);
        let mut paths = BinaryHeap::new();
        for root in &basis.roots {
            roots.complete(*root);
        }
        for root in &basis.roots {
            let reached = Reached { particle: *root, root: *root, length: 0.0, tether: None };
            links.push_paths(&mut paths, reached);
        }
        let mut all: Vec<Tether> = Vec::new();
        while let Some(Reverse(path)) = paths.pop() {
            let Some(slot) = roots.add(path.particle, path.root) else { continue };
            let length = f64::from_bits(path.length_bits);
            #[allow(
                clippy::cast_possible_truncation,
                reason = "one rounding; at most 2^24 tethers"
            )]
            let (rounded, tether) = (length as f32, Some(all.len() as u32));
            all.push(Tether {
                particle: path.particle,
                root: path.root,
                slot,
                length: rounded,
                parent: path.parent,
                constraint: path.constraint,
                is_dropped: false,
            });
            let CandidatePath { particle, root, .. } = path;
            links.push_paths(&mut paths, Reached { particle, root, length, tether });
        }
        Self { basis, parameters: Some(parameters.clone()), all, moving_roots: Vec::new() }
    }

    /// Returns true if [`Self::new`] derives the same tethers from these values.
    pub(crate) fn are_derived_from(&self, parameters: &Parameters, basis: &TetherBasis) -> bool {
        self.basis == *basis
            && self.parameters.as_ref().is_some_and(|own| own.has_softness_of(parameters))
    }

    /// Restores the tethers that were dropped since they were derived.
    pub(crate) fn restore_dropped(&mut self) {
        for tether in &mut self.all {
            tether.is_dropped = false;
        }
    }

    /// Drops every tether whose path contains a torn constraint.
    pub(crate) fn drop_torn(&mut self, torn: &Torn, store: &mut ParticleStore) {
        for place in 0..self.all.len() {
            let Tether { parent, constraint, is_dropped, .. } = self.all[place];
            let is_cut_off = parent.is_some_and(|parent| self.all[parent as usize].is_dropped);
            if !is_dropped && (is_cut_off || torn.is_torn(constraint)) {
                self.all[place].is_dropped = true;
                store.set_tether_length(self.all[place].place(store), f32::INFINITY);
            }
        }
    }

    /// Attaches the tethers to the particles of a store, whose substeps then apply them.
    pub(crate) fn attach(&mut self, store: &mut ParticleStore, particles: &Particles) {
        if self.basis.roots.is_empty() {
            return;
        }
        self.moving_roots.clear();
        for tether in self.all.iter().filter(|tether| !tether.is_dropped) {
            let place = tether.place(store);
            store.set_tether_length(place, tether.length);
            let state = &particles.states[tether.root as usize];
            store.set_root(place, state.position);
            if state.flags & ParticleFlags::ANCHORED != 0 {
                let root = store.location(tether.root);
                self.moving_roots.push(MovingRoot { tether: place, root });
            }
        }
    }

    /// Detaches the tethers from the particles of a store.
    pub(crate) fn detach(&self, store: &mut ParticleStore) {
        for tether in &self.all {
            store.set_tether_length(tether.place(store), f32::INFINITY);
        }
    }

    /// Returns the ends of every tether.
    pub(crate) fn ends(&self) -> impl Iterator<Item = TetherEnds> + '_ {
        let ends =
            |one: &Tether| TetherEnds { particle: one.particle, slot: one.slot, root: one.root };
        self.all.iter().map(ends)
    }

    /// Updates the positions of moving roots to the end of the substep.
    pub(crate) fn update_roots(&self, store: &mut ParticleStore) {
        for MovingRoot { tether, root } in &self.moving_roots {
            let (position, displacement) = (store.position(*root), store.displacement(*root));
            store.set_root(*tether, [0, 1, 2].map(|axis| position[axis] + displacement[axis]));
        }
    }
}

impl Tether {
    fn place(&self, store: &ParticleStore) -> TetherPlace {
        TetherPlace { particle: store.location(self.particle), slot: self.slot }
    }
}

/// The roots that each particle has found, the nearest first.
struct RootsOfParticles {
    /// By particle: room for `count_max` roots.
    roots: Vec<u32>,
    /// By particle: how many it has.
    counts: Vec<usize>,
    count_max: usize,
}

impl RootsOfParticles {
    fn new(particle_count: usize, count_max: usize) -> Self {
        let roots = vec![0; particle_count * count_max];
        Self { roots, counts: vec![0; particle_count], count_max }
    }

    /// Lets a particle find no more roots.
    fn complete(&mut self, particle: u32) {
        self.counts[particle as usize] = self.count_max;
    }

    /// Adds a root of a particle. Returns the number of those before, or None if the particle has this one or
    /// needs no more.
    fn add(&mut self, particle: u32, root: u32) -> Option<usize> {
        let count = &mut self.counts[particle as usize];
        let roots = &mut self.roots[particle as usize * self.count_max..][..self.count_max];
        if *count == self.count_max || roots[..*count].contains(&root) {
            return None;
        }
        roots[*count] = root;
        *count += 1;
        Some(*count - 1)
    }
}

/// The rigid constraints at each particle, in index order.
struct Links<'a> {
    model: &'a Model,
    /// By particle: index of its first link in `constraints`. One more entry at the end.
    starts: Vec<u32>,
    constraints: Vec<u32>,
}

impl<'a> Links<'a> {
    fn new(model: &'a Model, parameters: &Parameters, torn: &[u32]) -> Self {
        let rigid = Softness::rigid(model.method).value();
        let softness = parameters.values.softness();
        let mut is_link: Vec<bool> = model
            .constraints
            .iter()
            .map(|one| {
                let softness = softness[one.kind as usize].unwrap_or(one.compliance);
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

    /// Pushes the paths that continue from a particle.
    fn push_paths(&self, paths: &mut BinaryHeap<Reverse<CandidatePath>>, from: Reached) {
        let at = |particle: u32| self.starts[particle as usize] as usize;
        for constraint in &self.constraints[at(from.particle)..at(from.particle + 1)] {
            let [a, b] = self.model.pair(*constraint);
            let rest = f64::from(self.model.constraints[*constraint as usize].rest_length);
            let path = CandidatePath {
                length_bits: (from.length + rest).to_bits(),
                root: from.root,
                particle: if a == from.particle { b } else { a },
                parent: from.tether,
                constraint: *constraint,
            };
            paths.push(Reverse(path));
        }
    }
}
