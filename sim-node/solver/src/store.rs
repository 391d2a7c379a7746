//! The particles and constraints of a scene in the form that a substep uses: sheets and crowds
//! in rows, the rest as a graph. The state is unpacked from the published particles at the start of a step, and
//! packed again at the end.

mod bends;
mod configure;
mod crowd;
mod forces;
mod graph;
mod layout;
mod patch;
mod paths;
mod publish;
mod pulls;
mod rows;
pub(crate) mod strays;
mod survey;
pub(crate) mod workers;

use sim_scene::constraints::families::Sheet;
use sim_scene::constraints::sides::TornSides;
use sim_scene::model::Model;

use bends::StoredBends;
use crowd::{Crowd, find_figures};
use graph::Graph;
use layout::Layout;
pub(crate) use layout::{Configured, Location, SceneFields, TetherPlace};
use patch::Patch;
use patch::sheets::{Found, families_of, find_sheet, loose_particles, pure_sheets};
pub(crate) use paths::{Paths, Progress};
pub(crate) use pulls::TetherEnds;
use rows::Rows;
use survey::Survey;
use workers::Workers;

use crate::constraints::column_writer::ColumnWriter;
use crate::constraints::fields::Pass;
use crate::constraints::order::ProjectionOrders;
use crate::constraints::parameters::ConstraintParameters;
use crate::constraints::projection::TearMark;
use crate::contacts::contact::ContactRoom;
use crate::kernels::Kernels;
use crate::kernels::lanes::PackedParticle;
use crate::parameters::Parameters;
use crate::state::particles::Particle;
use crate::step::substep::SubstepInputs;
use crate::step::wind::WindStep;

/// Everything that a substep moves.
#[derive(Debug, Clone)]
pub(crate) struct ParticleStore {
    workers: Workers,
    graph: Graph,
    patches: Vec<Patch>,
    /// Sheets of the patches, ascending.
    sheets: Vec<Sheet>,
    crowds: Vec<Crowd>,
    layout: Layout,
    is_allocated: bool,
    /// Properties of the constraints with the current parameters.
    survey: Survey,
    /// Parameters from which the constraints are derived; None before the first derivation.
    derived_from: Option<Parameters>,
    /// By constraint: true if it is torn, and so inactive.
    is_torn: Vec<bool>,
    /// By constraint: where its parameters are.
    locations: Vec<Location>,
    bends: StoredBends,
    /// The sides of the triangles; empty in scenes without wind.
    triangles: TornSides,
    /// True if triangles have torn, or are whole again, since the wind last blew.
    are_triangles_changed: bool,
    contact_room: ContactRoom,
}

/// The particles of a store.
#[derive(Clone, Copy)]
pub(crate) struct StoredParticles<'a> {
    graph: &'a Graph,
    patches: &'a [Patch],
    crowds: &'a [Crowd],
}

impl<'a> StoredParticles<'a> {
    /// The rows of a location; none in the graph.
    #[inline(always)]
    fn rows(self, location: Location) -> Option<&'a Rows> {
        let rows = location.rows()?;
        Some(match self.patches.get(rows) {
            Some(patch) => &patch.rows,
            None => &self.crowds[rows - self.patches.len()].rows,
        })
    }

    /// Position, inverse mass and displacement of a particle.
    #[inline(always)]
    pub(crate) fn packed(self, location: Location) -> PackedParticle {
        let index = location.index();
        match self.rows(location) {
            None => self.graph.packed_particle(index),
            Some(rows) => {
                let ([x, y, z], [dx, dy, dz]) = (rows.position(index), rows.displacement(index));
                PackedParticle([x, y, z, rows.inverse_mass(index), dx, dy, dz, 0.0])
            }
        }
    }
}

impl ParticleStore {
    pub(crate) fn new(model: &Model, orders: &ProjectionOrders, kernels: Kernels) -> Self {
        let is_structured = kernels != Kernels::Reference && orders.has_groups();
        let sheets = if is_structured { pure_sheets(model) } else { Vec::new() };
        let mut locations = vec![Location::default(); model.constraints.len()];
        let mut bends = StoredBends::new(model);
        let mut loose = loose_particles(model, &sheets);
        let mut crowds = Vec::new();
        if is_structured {
            let figures = find_figures(model, &orders.constraints, &loose);
            loose.retain(|particle| figures.iter().all(|one| one.find(*particle).is_none()));
            crowds.extend(figures.into_iter().map(Crowd::new));
        }
        let mut graph = Graph::new(model, &orders.constraints, loose, &mut locations);
        graph.set_bends(model, &orders.bends, &mut bends.locations);
        let families = families_of(model, &sheets);
        let patches =
            sheets.iter().zip(&families).map(|(sheet, families)| Patch::new(*sheet, families));
        let mut store = Self {
            workers: Workers::new(kernels, 1),
            graph,
            patches: patches.collect(),
            sheets,
            crowds,
            layout: Layout::default(),
            is_allocated: false,
            survey: Survey::default(),
            derived_from: None,
            is_torn: vec![false; model.constraints.len()],
            locations,
            bends,
            triangles: TornSides::default(),
            are_triangles_changed: false,
            contact_room: ContactRoom::default(),
        };
        store.locate_constraints(model);
        store
    }

    /// The workers, and the particles for them to read.
    pub(crate) fn with_workers(&mut self) -> (&mut Workers, StoredParticles<'_>) {
        let Self { workers, graph, patches, crowds, .. } = self;
        (workers, StoredParticles { graph, patches, crowds })
    }

    /// The particles, to be read.
    pub(crate) fn particles(&self) -> StoredParticles<'_> {
        let Self { graph, patches, crowds, .. } = self;
        StoredParticles { graph, patches, crowds }
    }

    fn writer(&mut self, location: Location) -> ColumnWriter<'_> {
        let sheet_count = self.patches.len();
        match location.rows() {
            None => self.graph.writer(),
            Some(rows) if rows < sheet_count => self.patches[rows].writer(),
            Some(rows) => self.crowds[rows - sheet_count].writer(),
        }
    }

    /// The rows of a location; none in the graph.
    #[inline(always)]
    fn rows(&self, location: Location) -> Option<&Rows> {
        self.particles().rows(location)
    }

    fn rows_mut(&mut self, location: Location) -> Option<&mut Rows> {
        let (rows, sheet_count) = (location.rows()?, self.patches.len());
        Some(match self.patches.get_mut(rows) {
            Some(patch) => &mut patch.rows,
            None => &mut self.crowds[rows - sheet_count].rows,
        })
    }

    /// The rows of all sheets, then of all crowds.
    fn all_rows(&self) -> impl Iterator<Item = &Rows> {
        let sheets = self.patches.iter().map(|patch| &patch.rows);
        sheets.chain(self.crowds.iter().map(|crowd| &crowd.rows))
    }

    fn all_rows_mut(&mut self) -> impl Iterator<Item = &mut Rows> {
        let sheets = self.patches.iter_mut().map(|patch| &mut patch.rows);
        sheets.chain(self.crowds.iter_mut().map(|crowd| &mut crowd.rows))
    }

    fn set_parameters(&mut self, constraint: u32, parameters: &ConstraintParameters) {
        let location = self.locations[constraint as usize];
        self.writer(location).set(location.index(), parameters);
    }

    fn set_bend(&mut self, bend: u32, scaled_compliance: f32) {
        let location = self.bends.locations[bend as usize];
        match location.rows() {
            None => self.graph.set_bend(location.index(), scaled_compliance),
            // Crowds have no bends.
            Some(sheet) => self.patches[sheet].set_bend(location.index(), scaled_compliance),
        }
    }

    /// Takes a constraint out of every pass, and with its side the bends and triangles.
    pub(crate) fn tear(&mut self, constraint: u32) {
        let was_torn = std::mem::replace(&mut self.is_torn[constraint as usize], true);
        self.set_parameters(constraint, &ConstraintParameters::INACTIVE);
        if !was_torn {
            self.follow_side(constraint, |_| f32::INFINITY);
        }
    }

    /// Follows a constraint that has torn, or is no longer torn: the triangles at its side, and the bends with
    /// the side in their path, which get a new scaled compliance.
    fn follow_side(&mut self, constraint: u32, compliance: impl Fn(u32) -> f32) {
        let is_torn = self.is_torn[constraint as usize];
        self.are_triangles_changed |= self.triangles.follow(constraint, is_torn);
        if self.bends.sides.follow(constraint, is_torn) {
            for place in 0..self.bends.sides.owners(constraint).len() {
                let bend = self.bends.sides.owners(constraint)[place];
                let is_whole = self.bends.sides.is_whole(bend);
                self.set_bend(bend, if is_whole { compliance(bend) } else { f32::INFINITY });
            }
        }
    }

    /// Passes each constraint that the projections have marked to `accept`, in ascending order, and
    /// clears its mark.
    pub(crate) fn remove_marks(&mut self, mut accept: impl FnMut(u32, TearMark)) {
        for constraint in 0..self.locations.len() {
            let location = self.locations[constraint];
            if let Some(mark) = self.writer(location).remove_mark(location.index()) {
                #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 constraints")]
                accept(constraint as u32, mark);
            }
        }
    }

    /// Copies the state at the start of a step, with velocities in the place of displacements.
    pub(crate) fn unpack(&mut self, states: &[Particle]) {
        let Self { workers, graph, patches, crowds, .. } = self;
        graph.unpack(states);
        for patch in patches {
            patch.unpack(states, workers);
        }
        for crowd in crowds {
            crowd.unpack(states);
        }
    }

    /// Writes the state back at the end of a step. Returns the number of particles that froze.
    pub(crate) fn pack(&mut self, states: &mut [Particle], h: f32) -> u64 {
        let Self { workers, graph, patches, crowds, .. } = self;
        let patches: u64 = patches.iter_mut().map(|patch| patch.pack(states, h, workers)).sum();
        let crowds: u64 = crowds.iter_mut().map(|crowd| crowd.pack(states, h)).sum();
        patches + crowds + graph.pack(states, h)
    }

    /// Runs the swept stages of a substep, from `Predict` to `Advance`. Returns
    /// true if any constraint was marked as torn.
    ///
    /// The graph, every sheet and every crowd run them one after the other, each on particles of its own.
    pub(crate) fn run_swept_stages(&mut self, inputs: &SubstepInputs<'_>, pass_count: u32) -> bool {
        let Self { workers, graph, patches, crowds, .. } = self;
        let mut is_marked = false;
        let passes = || Pass::all(pass_count).take_while(|_| !inputs.is_given_up());
        for pass in passes() {
            is_marked |= graph.run_pass(workers, pass, inputs);
        }
        for patch in patches {
            for pass in passes() {
                is_marked |= patch.run_pass(workers, pass, inputs);
            }
        }
        for crowd in crowds {
            is_marked |= crowd.run_passes(workers, pass_count, inputs);
        }
        is_marked
    }

    /// Runs the stages behind the division of the sweep.
    pub(crate) fn run_ending(&mut self, inputs: &SubstepInputs<'_>) {
        let Self { workers, graph, patches, crowds, .. } = self;
        graph.run_ending(workers, inputs);
        for patch in patches {
            patch.run_ending(workers, inputs);
        }
        for crowd in crowds {
            crowd.run_ending(workers, inputs);
        }
    }

    /// Exchanges everything but the threads with a store of the same scene.
    pub(crate) fn exchange(&mut self, other: &mut Self) {
        std::mem::swap(self, other);
        std::mem::swap(&mut self.workers, &mut other.workers);
        std::mem::swap(&mut self.contact_room, &mut other.contact_room);
    }

    pub(crate) fn kernels(&self) -> Kernels {
        self.workers.kernels
    }

    /// Replaces the threads by `count`, or as many as the system grants.
    pub(crate) fn set_threads(&mut self, count: usize) {
        self.workers = Workers::new(self.workers.kernels, count);
        self.workers.reserve_contacts(self.contact_room);
    }

    /// Makes room for contacts of this number of particles with meshes.
    pub(crate) fn reserve_mesh_contacts(&mut self, particle_count: usize) {
        self.contact_room.near_mesh_count = particle_count;
        self.workers.reserve_contacts(self.contact_room);
    }

    pub(crate) fn thread_count(&self) -> usize {
        self.workers.count()
    }

    /// Location of a particle, until the next [`Configured::Moved`].
    pub(crate) fn location(&self, particle: u32) -> Location {
        if let Some(Found { sheet, place }) = find_sheet(&self.sheets, particle) {
            return Location::in_rows(sheet, self.patches[sheet].rows.particle_index(place));
        }
        for (number, crowd) in (self.patches.len()..).zip(&self.crowds) {
            if let Some(index) = crowd.find(particle) {
                return Location::in_rows(number, index);
            }
        }
        let Some(index) = self.graph.find(particle) else {
            unreachable!("particle {particle} is neither in a sheet, a crowd nor the graph")
        };
        Location::in_graph(index as usize)
    }

    #[inline(always)]
    pub(crate) fn position(&self, location: Location) -> [f32; 3] {
        match self.rows(location) {
            None => self.graph.position(location.index()),
            Some(rows) => rows.position(location.index()),
        }
    }

    #[inline(always)]
    pub(crate) fn displacement(&self, location: Location) -> [f32; 3] {
        match self.rows(location) {
            None => self.graph.displacement(location.index()),
            Some(rows) => rows.displacement(location.index()),
        }
    }

    pub(crate) fn set_displacement(&mut self, location: Location, displacement: [f32; 3]) {
        let index = location.index();
        match self.rows_mut(location) {
            None => self.graph.set_displacement(index, displacement),
            Some(rows) => rows.set_displacement(index, displacement),
        }
    }

    /// Displacement of a particle before any constraint or contact of the substep, 0 in a
    /// scene without bounces.
    pub(crate) fn predicted(&self, location: Location) -> [f32; 3] {
        match self.rows(location) {
            None => self.graph.predicted(location.index()),
            Some(rows) => rows.predicted(location.index()),
        }
    }

    /// Sets the position and the displacement of a particle.
    pub(crate) fn set_path(
        &mut self,
        location: Location,
        position: [f32; 3],
        displacement: [f32; 3],
    ) {
        let index = location.index();
        match self.rows_mut(location) {
            None => self.graph.set_position(index, position),
            Some(rows) => rows.set_position(index, position),
        }
        self.set_displacement(location, displacement);
    }

    /// Computes the velocities that the wind adds in the running substep.
    pub(crate) fn blow(&mut self, wind: &WindStep) {
        let kernels = self.kernels();
        let are_changed = std::mem::take(&mut self.are_triangles_changed);
        let Self { graph, patches, triangles, .. } = self;
        if are_changed {
            graph.follow_triangles(triangles);
            for patch in &mut *patches {
                patch.follow_triangles(triangles);
            }
        }
        graph.blow(kernels, wind);
        for patch in patches {
            patch.blow(kernels, wind);
        }
    }

    /// Removes the tethers of all particles, of which there are `particle_count`.
    pub(crate) fn detach_tethers(&mut self, particle_count: u32) {
        for slot in 0..self.layout.scene.tethers {
            for particle in 0..particle_count {
                let place = TetherPlace { particle: self.location(particle), slot };
                self.set_tether_length(place, f32::INFINITY);
            }
        }
    }

    /// Sets where the root of a tether is at the end of the substep.
    pub(crate) fn set_root(&mut self, TetherPlace { particle, slot }: TetherPlace, root: [f32; 3]) {
        let index = particle.index();
        match self.rows_mut(particle) {
            None => self.graph.tether_mut(index, slot).root = root,
            Some(rows) => rows.set_root(index, slot, root),
        }
    }

    /// Sets the largest distance of a particle from its root; infinite for no tether.
    pub(crate) fn set_tether_length(
        &mut self,
        TetherPlace { particle, slot }: TetherPlace,
        length: f32,
    ) {
        let index = particle.index();
        match self.rows_mut(particle) {
            None => self.graph.tether_mut(index, slot).length = length,
            Some(rows) => rows.set_tether_length(index, slot, length),
        }
    }
}

#[cfg(test)]
mod tests {
    //! The choice between rows and the graph, and passes that are given up. That the choice changes no
    //! bit is tested with the kernels.
    use std::sync::atomic::AtomicBool;

    use sim_scene::scene::Scene;

    use super::*;
    use crate::solver::Solver;
    use crate::step::prediction::Prediction;

    fn count_in_rows(columns: u32, rows: u32) -> usize {
        let text = format!(
            "version = 1\n[[generate]]\nshape = \"cloth\"\ncolumns = {columns}\nrows = {rows}\n\
             spacing = 0.01\n"
        );
        pure_sheets(&Scene::from_toml(&text, "test").unwrap().model()).len()
    }

    #[test]
    fn a_long_sheet_whose_rows_would_be_mostly_padding_is_part_of_the_graph() {
        assert_eq!([count_in_rows(1, 65_537), count_in_rows(23, 65_537)], [0, 0]);
        assert_eq!([count_in_rows(24, 65_537), count_in_rows(1, 65_536)], [1, 1]);
        assert_eq!(count_in_rows(65_537, 1), 1);
    }

    /// Each pass checks the flag itself, not only the loop over the passes.
    #[test]
    fn a_pass_that_is_given_up_moves_no_particle() {
        let text = "version = 1\n[[generate]]\nshape = \"cloth\"\ncolumns = 20\nrows = 20\n\
            spacing = 0.01\n[[generate]]\nshape = \"rope\"\ncount = 20\nfrom = [0, 0, 1]\n\
            to = [1, 0, 1]\n";
        let scene = Scene::from_toml(text, "test").unwrap();
        for is_given_up in [true, false] {
            let Solver { mut store, mut particles, .. } = Solver::new(&scene);
            let before = particles.states.clone();
            let free_count = before.iter().filter(|one| one.inverse_mass > 0.0).count();
            let (gain, h) = ([0.0, -0.01, 0.0], 0.001);
            let prediction = Prediction { h, kept: 1.0, gain, reach: 1.0, is_first: true };
            let relaxation = 1.0;
            let stop = AtomicBool::new(is_given_up);
            let inputs = SubstepInputs { prediction, relaxation, obstacles: &[], stop: &stop };
            store.unpack(&particles.states);
            let ParticleStore { workers, graph, patches, .. } = &mut store;
            for pass in Pass::all(2) {
                graph.run_pass(workers, pass, &inputs);
                for patch in &mut *patches {
                    patch.run_pass(workers, pass, &inputs);
                }
            }
            store.pack(&mut particles.states, h);
            let moved = before.iter().zip(&particles.states).filter(|(a, b)| a != b).count();
            assert_eq!(moved, if is_given_up { 0 } else { free_count });
        }
    }
}
