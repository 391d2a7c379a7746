//! The particles and constraints of a scene as a substep works on them: sheets in rows, everything
//! else as a graph. They are unpacked from the published state at the start of a step, and packed
//! into it at the end.

mod graph;
mod motion;
mod patch;
mod team;
mod terms;

use sim_types::ParticleFlags;

use crate::constraints::Recipe;
use crate::families::{Family, Sheet};
use crate::kernels::Kernels;
use crate::order::Order;
use crate::particles::Particle;
use crate::scene::Model;
use graph::{Graph, RUN};
pub(crate) use motion::{Fall, Motion};
pub(crate) use patch::Extras;
use patch::Patch;
use team::Team;
use terms::Pass;
pub(crate) use terms::{Features, Give, Term};

/// Everything that a substep moves.
#[derive(Debug, Clone)]
pub(crate) struct Bodies {
    team: Team,
    graph: Graph,
    patches: Vec<Patch>,
    /// That of each patch, ascending.
    sheets: Vec<Sheet>,
    /// By constraint: where its term is.
    term_places: Vec<Place>,
    /// Particles side by side that can touch something.
    contact_count: usize,
}

/// A place in one of the stores: in the graph (store 0), or in patch `store` - 1.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Place {
    store: u32,
    at: u32,
}

impl Place {
    #[allow(clippy::cast_possible_truncation, reason = "a store has less than 2^32 numbers")]
    fn new(store: usize, at: usize) -> Self {
        Self { store: store as u32, at: at as u32 }
    }

    fn at(self) -> usize {
        self.at as usize
    }

    /// The patch, if it is in one.
    fn patch(self) -> Option<usize> {
        (self.store as usize).checked_sub(1)
    }
}

impl Bodies {
    pub(crate) fn new(model: &Model, order: &Order, kernels: Kernels) -> Self {
        let is_structured = kernels != Kernels::Reference && order.independent_count > 0;
        let sheets = if is_structured { pure_sheets(model) } else { Vec::new() };
        let loose = loose_particles(model, &sheets);
        let body_of = |particle: u32| {
            let body = loose.binary_search(&particle).ok()?;
            u32::try_from(body).ok()
        };
        let (graph, places) = Graph::new(model, order, loose.clone(), body_of);
        let families = families_of(model, &sheets);
        let patches: Vec<_> =
            sheets.iter().zip(&families).map(|(sheet, found)| Patch::new(*sheet, found)).collect();
        let mut term_places = vec![Place::default(); model.constraints.len()];
        for (index, at) in places {
            term_places[index as usize] = Place::new(0, at);
        }
        for (index, group) in (0_u32..).zip(&model.families) {
            let found = find_sheet(&sheets, model.pair(index)[0]);
            if let (Some((patch, [row, column])), Some(group)) = (found, group) {
                let family = Family::of_group(*group);
                let place = [row, column - family.shifts()[0]];
                let at = patches[patch].place(family, place);
                term_places[index as usize] = Place::new(patch + 1, at);
            }
        }
        let team = Team::new(kernels, 1);
        Self { team, graph, patches, sheets, term_places, contact_count: 0 }
    }

    /// Makes room for what the scene has, and takes over what its constraints are like. `is_torn`
    /// says which of them do nothing any more.
    pub(crate) fn configure(&mut self, recipe: &Recipe<'_>, extras: Extras, is_torn: &[bool]) {
        let (mut found, mut patch_gives) = (Found::default(), vec![Vec::new(); self.patches.len()]);
        for (index, place) in (0_u32..).zip(&self.term_places) {
            let term = recipe.term(index);
            found.see(&term, place.patch().is_none());
            if let Some(patch) = place.patch() {
                let strand = self.patches[patch].strand(place.at());
                let gives: &mut Vec<Option<Give>> = &mut patch_gives[patch];
                gives.resize(gives.len().max(strand + 1), None);
                gives[strand] = Some(term.give);
            }
        }
        let features = found.features(recipe.pass_count());
        self.graph.lay_out(features, extras, found.give());
        let features = Features { gives: false, floors: false, ..features };
        for (patch, gives) in self.patches.iter_mut().zip(&patch_gives) {
            patch.lay_out(features, extras, (gives, recipe.pass_count()));
        }
        for index in
            (0_u32..).zip(is_torn).filter(|(_, is_torn)| !**is_torn).map(|(index, _)| index)
        {
            self.set_term(index, &recipe.term(index));
        }
        let widest = self.patches.iter().map(|patch| patch.sheet.columns as usize).max();
        let most = RUN.min(self.graph.count()).max(widest.unwrap_or_default());
        self.contact_count = if extras.colliders { most } else { 0 };
        self.team.make_room(self.contact_count);
    }

    fn set_term(&mut self, constraint: u32, term: &Term) {
        let place = self.term_places[constraint as usize];
        match place.patch() {
            None => self.graph.set_term(place.at(), term),
            Some(patch) => self.patches[patch].set_term(place.at(), term),
        }
    }

    /// Takes a constraint out of every pass.
    pub(crate) fn tear(&mut self, constraint: u32) {
        self.set_term(constraint, &Term::NONE);
    }

    /// Gives each constraint that the projections have marked, ascending, with its mark; then none
    /// is marked any more.
    pub(crate) fn take_marks(&mut self, mut take: impl FnMut(u32, f32)) {
        for (index, place) in (0_u32..).zip(&self.term_places) {
            let mark = match place.patch() {
                None => self.graph.take_mark(place.at()),
                Some(patch) => self.patches[patch].take_mark(place.at()),
            };
            if mark != 0.0 {
                take(index, mark);
            }
        }
    }

    /// Takes over the state at the start of a step: velocities in the place of displacements.
    pub(crate) fn unpack(&mut self, states: &[Particle]) {
        self.graph.unpack(states);
        for patch in &mut self.patches {
            patch.unpack(states);
        }
    }

    /// Gives the state at the end of a step back. How many particles are frozen from now on.
    pub(crate) fn pack(&mut self, states: &mut [Particle], h: f32) -> u64 {
        let patches: u64 = self.patches.iter_mut().map(|patch| patch.pack(states, h)).sum();
        patches + self.graph.pack(states, h)
    }

    /// One substep, but for what is driven and what the wind gives, which is in place already.
    /// Whether any constraint was marked as torn.
    pub(crate) fn substep(&mut self, motion: &Motion<'_>, pass_count: u32) -> bool {
        let Self { team, graph, patches, .. } = self;
        let mut is_marked = false;
        graph.predict(team, motion);
        for index in 0..pass_count {
            let pass = Pass { index, count: pass_count };
            is_marked |= graph.project(team, pass);
            for patch in &mut *patches {
                is_marked |= patch.sweep(team, pass, motion);
            }
        }
        graph.limit_stretch(team);
        graph.end_substep(team, motion);
        is_marked
    }

    /// Works with so many threads from now on.
    pub(crate) fn set_threads(&mut self, threads: usize) {
        self.team = Team::new(self.team.kernels, threads);
        self.team.make_room(self.contact_count);
    }

    pub(crate) fn threads(&self) -> usize {
        self.team.members()
    }

    /// Where a particle is, as long as nothing is configured anew.
    pub(crate) fn place(&self, particle: u32) -> Place {
        if let Some((patch, place)) = find_sheet(&self.sheets, particle) {
            return Place::new(patch + 1, self.patches[patch].number_of(place));
        }
        Place::new(0, self.graph.particles.binary_search(&particle).unwrap_or_default())
    }

    #[inline(always)]
    pub(crate) fn position(&self, place: Place) -> [f32; 3] {
        match place.patch() {
            None => three(&self.graph.bodies[place.at()].0, 0),
            Some(patch) => self.patches[patch].position(place.at()),
        }
    }

    #[inline(always)]
    pub(crate) fn inverse_mass(&self, place: Place) -> f32 {
        match place.patch() {
            None => self.graph.bodies[place.at()].0[3],
            Some(patch) => self.patches[patch].inverse_mass(place.at()),
        }
    }

    #[inline(always)]
    pub(crate) fn displacement(&self, place: Place) -> [f32; 3] {
        match place.patch() {
            None => three(&self.graph.bodies[place.at()].0, 4),
            Some(patch) => self.patches[patch].displacement(place.at()),
        }
    }

    pub(crate) fn set_displacement(&mut self, place: Place, displacement: [f32; 3]) {
        match place.patch() {
            None => self.graph.bodies[place.at()].0[4..7].copy_from_slice(&displacement),
            Some(patch) => self.patches[patch].set_displacement(place.at(), displacement),
        }
    }

    /// The velocity that the wind gives a particle in the running substep.
    pub(crate) fn set_wind(&mut self, place: Place, gain: [f32; 3]) {
        match place.patch() {
            None => self.graph.gains[place.at()] = gain,
            Some(patch) => self.patches[patch].set_wind(place.at(), gain),
        }
    }

    /// Where the root of a particle's tether is at the end of the substep.
    pub(crate) fn set_root(&mut self, place: Place, root: [f32; 3]) {
        match place.patch() {
            None => self.graph.tethers[place.at()].root = root,
            Some(patch) => self.patches[patch].set_root(place.at(), root),
        }
    }

    /// How far a particle may be from its root; infinite for no tether.
    pub(crate) fn set_tether(&mut self, place: Place, length: f32) {
        match place.patch() {
            None => self.graph.tethers[place.at()].length = length,
            Some(patch) => self.patches[patch].set_tether(place.at(), length),
        }
    }
}

/// What there is among the constraints of a scene.
#[derive(Debug, Clone, Copy, Default)]
struct Found {
    features: Features,
    /// That of the first constraint of the graph.
    give: Option<Give>,
    is_soft: bool,
}

impl Found {
    fn see(&mut self, term: &Term, is_graph: bool) {
        let Features { gives, floors, max_lengths, tear_lengths, tear_multipliers, .. } =
            &mut self.features;
        if is_graph {
            *gives |= *self.give.get_or_insert(term.give) != term.give;
        }
        *floors |= term.floor >= 0.0;
        *max_lengths |= term.max_length.is_finite();
        *tear_lengths |= term.tear_length.is_finite();
        *tear_multipliers |= term.tear_multiplier.is_finite();
        self.is_soft |= term.give.softness != 0.0;
    }

    fn features(&self, pass_count: u32) -> Features {
        let is_asked = self.features.tear_multipliers || (self.is_soft && pass_count > 1);
        Features { multipliers: is_asked, ..self.features }
    }

    fn give(&self) -> Give {
        self.give.unwrap_or_default()
    }
}

/// The sheet that has a particle, with its row and column there; sheets are ascending.
fn find_sheet(sheets: &[Sheet], particle: u32) -> Option<(usize, [usize; 2])> {
    let sheet = sheets.partition_point(|sheet| sheet.first <= particle).checked_sub(1)?;
    Some((sheet, sheets[sheet].find(particle)?))
}

/// The sheets whose particles have no constraint but those of their families.
fn pure_sheets(model: &Model) -> Vec<Sheet> {
    let mut is_pure = vec![true; model.sheets.len()];
    for (index, family) in (0_u32..).zip(&model.families) {
        if family.is_none() {
            for particle in model.pair(index) {
                if let Some((sheet, _)) = find_sheet(&model.sheets, particle) {
                    is_pure[sheet] = false;
                }
            }
        }
    }
    let sheets = model.sheets.iter().zip(is_pure);
    sheets.filter(|(_, is_pure)| *is_pure).map(|(sheet, _)| *sheet).collect()
}

/// Particles in none of the sheets, ascending.
fn loose_particles(model: &Model, sheets: &[Sheet]) -> Vec<u32> {
    let all = 0..model.particle_count();
    all.filter(|particle| find_sheet(sheets, *particle).is_none()).collect()
}

/// The families of each sheet, in the order of projection.
fn families_of(model: &Model, sheets: &[Sheet]) -> Vec<Vec<Family>> {
    let mut has_family = vec![[false; Family::ALL.len()]; sheets.len()];
    for (index, group) in (0_u32..).zip(&model.families) {
        let found = find_sheet(sheets, model.pair(index)[0]);
        if let (Some((sheet, _)), Some(group)) = (found, group) {
            has_family[sheet][Family::of_group(*group) as usize] = true;
        }
    }
    let chosen = |has: [bool; Family::ALL.len()]| {
        let all = Family::ALL.into_iter().zip(has);
        all.filter(|(_, has)| *has).map(|(family, _)| family).collect()
    };
    has_family.into_iter().map(chosen).collect()
}

#[inline(always)]
fn three(body: &[f32; 8], first: usize) -> [f32; 3] {
    [body[first], body[first + 1], body[first + 2]]
}

/// Writes the state of a particle, with every zero as +0: the same numbers have the same bits, and
/// thus the same hash. A particle whose state is no longer finite stands where it was at the start
/// of the step, for good. Whether that is so.
#[inline(always)]
fn pack(state: &mut Particle, position: [f32; 3], displacement: [f32; 3], h: f32) -> bool {
    let velocity = displacement.map(|axis| axis / h);
    let is_finite = position.iter().chain(&velocity).all(|number| number.is_finite());
    if is_finite {
        state.position = position.map(|axis| axis + 0.0);
        state.velocity = velocity.map(|axis| axis + 0.0);
    } else {
        state.velocity = [0.0; 3];
        state.inverse_mass = 0.0;
        state.flags = (state.flags | ParticleFlags::FROZEN) & !ParticleFlags::GRABBED;
    }
    !is_finite
}
