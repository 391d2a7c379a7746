//! A crowd: equal figures side by side, such as a thousand ragdolls.
//!
//! Eight figures, one in each lane, need no indices: a constraint between two particles of a figure combines
//! eight columns with eight others. A row has a block of figures, and in it the first particles of all of them,
//! then the second ones, and so on. Each figure finds its constraints in the order of projection, so the bits
//! are those of the graph.

mod block;
mod figures;

use block::{BlockSweep, BlockWork, Blocks};
use figures::Figures;
pub(crate) use figures::find_figures;

use super::graph::part_count;
use super::layout::{Layout, SceneFields};
use super::publish::{PublishedMotion, publish};
use super::pulls::{Pull, Pulls};
use super::rows::{LINE_LENGTH, RowLayout, RowState, Rows};
use super::workers::{WorkerScratch, Workers};
use crate::constraints::column_writer::{ColumnOrder, ColumnWriter};
use crate::constraints::parameters::{ConstraintParameters, PassSoftness};
use crate::kernels::lanes::axes;
use crate::state::particles::Particle;
use crate::step::schedule::Schedule;
use crate::step::substep::SubstepInputs;

/// Groups of eight particles of a block: few enough to stay in the nearest cache, unless the figures are large.
const BLOCK_GROUPS: usize = 96;

/// Equal figures with their constraints.
#[derive(Debug, Clone)]
pub(crate) struct Crowd {
    figures: Figures,
    /// Number of figures of a block, a multiple of eight. The last block may have fewer; nothing moves its padding.
    width: usize,
    pub(crate) rows: Rows,
    column_order: ColumnOrder,
    /// Softness of all constraints, unless they differ.
    softness: PassSoftness,
    schedule: Schedule,
}

impl Crowd {
    pub(crate) fn new(figures: Figures) -> Self {
        let groups = (BLOCK_GROUPS / figures.size).clamp(1, figures.count().div_ceil(8));
        let (width, columns) = (8 * groups, 8 * groups * figures.size);
        let first = figures.particles[0] as usize;
        let layout = RowLayout::new(first, [figures.count().div_ceil(width), columns], columns);
        Self {
            figures,
            width,
            rows: Rows::new(layout),
            column_order: ColumnOrder::default(),
            softness: PassSoftness::RIGID,
            schedule: Schedule::default(),
        }
    }

    /// Sets the fields in use, and the softness of constraints that have none of their own.
    pub(crate) fn use_fields(&mut self, layout: Layout, softness: PassSoftness) {
        self.softness = softness;
        // Wind blows on triangles only, and a figure has none.
        let scene = SceneFields { wind: false, bend_multipliers: false, ..layout.scene };
        self.rows.layout.set_fields(Layout { scene, is_wind_used: false, ..layout });
        let constraints_length = layout.constraints.column_count() * self.column_length();
        let length = self.rows.layout.length + constraints_length;
        self.rows.layout.length = length.next_multiple_of(LINE_LENGTH);
        self.schedule.rebuild(layout.optional_stages(), &std::iter::once(0), &std::iter::empty());
    }

    /// Allocates the fields of the layout. Every constraint is inactive afterwards, and no particle has a tether.
    pub(crate) fn allocate(&mut self) {
        self.rows.allocate();
        self.column_order = ColumnOrder::new(self.rows.layout.fields.constraints);
        let column_length = self.column_length();
        for block in 0..self.rows.layout.rows {
            let first = self.first_constraint(block);
            for index in first..first + column_length {
                self.writer().set(index, &ConstraintParameters::INACTIVE);
            }
        }
    }

    /// Length of a column of the constraints of a block.
    fn column_length(&self) -> usize {
        self.figures.pairs.len() * self.width
    }

    /// Index, among all numbers, of the first rest length of a block.
    fn first_constraint(&self, block: usize) -> usize {
        let RowLayout { length, constraints_at, stride, .. } = self.rows.layout;
        block * length + constraints_at * stride
    }

    /// The constraints in the scene, with their indices for [`Self::writer`].
    pub(crate) fn constraint_indices(&self) -> impl Iterator<Item = (u32, usize)> {
        let count = self.figures.pairs.len();
        self.figures.constraints.iter().enumerate().map(move |(place, constraint)| {
            let (figure, number) = (place / count, place % count);
            let first = self.first_constraint(figure / self.width);
            (*constraint, first + number * self.width + figure % self.width)
        })
    }

    /// Writer for the constraints.
    pub(crate) fn writer(&mut self) -> ColumnWriter<'_> {
        let column_length = self.column_length();
        ColumnWriter::new(self.rows.numbers_mut(), column_length, self.column_order)
    }

    /// Index, among all numbers, of the x position of a particle of the scene, if it is in the crowd.
    pub(crate) fn find(&self, particle: u32) -> Option<usize> {
        let [figure, number] = self.figures.find(particle)?;
        let column = number * self.width + figure % self.width;
        Some(self.rows.particle_index([figure / self.width, column]))
    }

    /// Copies the state at the start of a step, with velocities in the place of displacements.
    pub(crate) fn unpack(&mut self, states: &[Particle]) {
        let Self { figures, width, rows, .. } = self;
        for (block, particles) in figures.particles.chunks(figures.size * *width).enumerate() {
            let RowState { x, w, d } = rows.state_mut(block);
            for (column, particle) in columns(particles, figures.size, *width) {
                let state = &states[particle as usize];
                for axis in 0..3 {
                    x[axis][column] = state.position[axis];
                    d[axis][column] = state.velocity[axis];
                }
                w[column] = state.inverse_mass;
            }
        }
    }

    /// Writes the state back. Returns the number of particles that froze.
    pub(crate) fn pack(&mut self, states: &mut [Particle], h: f32) -> u64 {
        let mut frozen_count = 0;
        let Self { figures, width, rows, .. } = self;
        for (block, particles) in figures.particles.chunks(figures.size * *width).enumerate() {
            let RowState { x, d, .. } = rows.state_mut(block);
            for (column, particle) in columns(particles, figures.size, *width) {
                let vector = |fields: &[&mut [f32]; 3]| axes(|axis| fields[axis][column]);
                let motion = PublishedMotion { position: vector(&x), displacement: vector(&d), h };
                frozen_count += u64::from(publish(&mut states[particle as usize], motion));
            }
        }
        frozen_count
    }

    /// Runs the passes of a substep. Returns true if any constraint was marked as torn.
    pub(crate) fn run_passes(
        &mut self,
        workers: &mut Workers,
        pass_count: u32,
        inputs: &SubstepInputs<'_>,
    ) -> bool {
        self.sweep(workers, Some(pass_count), inputs)
    }

    /// Runs the stages behind the division of the sweep.
    pub(crate) fn run_ending(&mut self, workers: &mut Workers, inputs: &SubstepInputs<'_>) {
        self.sweep(workers, None, inputs);
    }

    fn sweep(
        &mut self,
        workers: &mut Workers,
        pass_count: Option<u32>,
        inputs: &SubstepInputs<'_>,
    ) -> bool {
        let Self { figures, rows, softness, schedule, .. } = self;
        let sweep = BlockSweep { schedule, pass_count, softness: *softness, inputs };
        let (layout, numbers, forces) = rows.split_mut();
        let is_measured = forces.is_measured;
        let kernels = workers.kernels;
        let part_count = part_count(figures.particles.len(), workers.count());
        let block_count = layout.rows.div_ceil(part_count);
        let parts = Blocks::new(figures, (layout, numbers, forces)).parts(block_count);
        let mut is_marked = false;
        let work = |(blocks, is_marked): &mut (Blocks<'_>, bool), scratch: &mut WorkerScratch| {
            *is_marked = if is_measured {
                kernels.run(BlockWork::<true> { blocks, sweep, scratch })
            } else {
                kernels.run(BlockWork::<false> { blocks, sweep, scratch })
            };
        };
        workers.for_each(parts.map(|part| (part, false)), work, |(_, one)| is_marked |= one);
        is_marked
    }

    /// Measures these pulls in each further step.
    pub(crate) fn measure_forces(&mut self, pulls: Vec<Pull>) {
        let projection_count = self.rows.layout.rows * self.figures.pairs.len();
        self.rows.measure_forces(Pulls::new(pulls, projection_count));
    }

    /// Number of the projection of the constraint with an index of its location.
    pub(crate) fn projection_of_constraint(&self, index: usize) -> usize {
        let block = index / self.rows.layout.length;
        let number = (index - self.first_constraint(block)) / self.width;
        block * self.figures.pairs.len() + number
    }
}

/// The particles of a block, figure by figure, with their columns in its row.
fn columns(
    particles: &[u32],
    figure_size: usize,
    width: usize,
) -> impl Iterator<Item = (usize, u32)> {
    let figures = particles.chunks_exact(figure_size).enumerate();
    figures.flat_map(move |(figure, particles)| {
        (figure..).step_by(width).zip(particles.iter().copied())
    })
}
