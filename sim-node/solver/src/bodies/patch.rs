//! A structured patch: a cloth or a rope, row by row, with no index between the numbers.
//!
//! A row is a run of fields, each as long as the others: x, y, z of the positions, the inverse
//! masses, x, y, z of the displacements, then what only some scenes have, then the constraints that
//! begin in the row, family by family. Constraints between two rows are eight columns of the one
//! beside eight of the other; those within a row are taken apart in the registers.

mod row;
mod wave;

use std::ops::Range;

use super::motion::Motion;
use super::team::{Scratch, Team};
use super::terms::{Features, Fields, Give, Pass, Term};
use crate::families::{Family, Sheet};
use crate::kernels::axes;
use crate::pages::refill;
use crate::particles::Particle;
use wave::{Band, Span, Stage, Sweep, SweepWork, stages, total_reach};

/// Numbers of a cache line.
const LINE: usize = 16;

/// Memory in whole cache lines.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Line([f32; LINE]);

/// The fields that every row begins with.
const STATE_FIELDS: usize = 7;

/// What only some scenes have.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Extras {
    /// Colliders: they ask for the predicted displacement.
    pub(crate) colliders: bool,
    /// Wind: the velocity that it gives in a substep.
    pub(crate) wind: bool,
    /// Tethers: the root's place, and the longest length with its square.
    pub(crate) tethers: bool,
}

/// One sheet of particles with its constraints.
#[derive(Debug, Clone)]
pub(crate) struct Patch {
    pub(crate) sheet: Sheet,
    shape: Shape,
    lines: Vec<Line>,
    /// By pass of a substep.
    stages: Vec<Vec<Stage>>,
}

/// Particles of a patch from which on several threads are faster than one.
const SHARED_MIN: usize = 4000;

/// Where everything is in a row.
#[derive(Debug, Clone)]
struct Shape {
    columns: usize,
    rows: usize,
    /// Length of a field.
    stride: usize,
    extras: Extras,
    features: Features,
    /// The families that the sheet has, in the order of projection.
    families: Vec<Strand>,
    /// The first field of the constraints.
    links_at: usize,
    /// Numbers that the constraints of a family have in a row.
    strand_length: usize,
    /// Numbers of a row.
    row_length: usize,
}

/// The constraints of a family.
#[derive(Debug, Clone, Copy)]
struct Strand {
    family: Family,
    /// All of a family are alike: generators make them so.
    give: Give,
    /// They need no more than [`crate::project::Rigid`].
    is_plain: bool,
}

impl Shape {
    /// How many bands it is cut into: none so low that its seams would be most of it.
    fn band_count(&self, members: usize, reach: usize) -> usize {
        if self.rows * self.columns < SHARED_MIN {
            return 1;
        }
        members.min(self.rows / (4 * reach + 1)).max(1)
    }

    /// Where everything is with these features; asked for by every row, so worked out once.
    fn lay_out(&mut self, features: Features, extras: Extras) {
        (self.features, self.extras) = (features, extras);
        for strand in &mut self.families {
            strand.is_plain = features.are_plain(strand.give.softness);
        }
        let Extras { wind, tethers, .. } = extras;
        self.links_at = self.wind_at() + 3 * usize::from(wind) + 5 * usize::from(tethers);
        self.strand_length = features.field_count() * self.stride;
        self.row_length = self.links_at * self.stride + self.families.len() * self.strand_length;
    }

    fn wind_at(&self) -> usize {
        STATE_FIELDS + 3 * usize::from(self.extras.colliders)
    }

    fn root_at(&self) -> usize {
        self.wind_at() + 3 * usize::from(self.extras.wind)
    }

    /// The place in its field of a constraint within a row: its half begins at 0 or in the middle;
    /// there, in the order in which [`Wide::unzip`] takes sixteen columns apart.
    fn place_across(&self, family: Family, column: usize) -> usize {
        let half = family.half(0, column);
        let (start, order): (_, [usize; 8]) = match family {
            Family::HorizontalBend => (2 * half, [0, 1, 8, 9, 4, 5, 12, 13]),
            _ => (half, [0, 2, 8, 10, 4, 6, 12, 14]),
        };
        let (block, within) = ((column - start) / 16, (column - start) % 16);
        let lane = order.iter().position(|column| *column == within).unwrap_or_default();
        half * self.stride / 2 + 8 * block + lane
    }
}

/// A row, field by field, for what is not done in every substep.
struct Row<'a> {
    x: [&'a mut [f32]; 3],
    w: &'a mut [f32],
    d: [&'a mut [f32]; 3],
    /// The fields of all families.
    links: &'a mut [f32],
}

impl<'a> Row<'a> {
    fn new(row: &'a mut [f32], shape: &Shape) -> Self {
        let (mut rest, links) = row.split_at_mut(shape.links_at * shape.stride);
        let mut next = || {
            let (field, others) = std::mem::take(&mut rest).split_at_mut(shape.stride);
            rest = others;
            field
        };
        let x = [next(), next(), next()];
        Self { x, w: next(), d: [next(), next(), next()], links }
    }
}

impl Patch {
    pub(crate) fn new(sheet: Sheet, families: &[Family]) -> Self {
        let (columns, rows) = (sheet.columns as usize, sheet.rows as usize);
        let give = Give::default();
        let strand = |family: &Family| Strand { family: *family, give, is_plain: false };
        let shape = Shape {
            columns,
            rows,
            // Room for the last eight, or the last two of a constraint within the row, and for the
            // columns that the other end is further on.
            stride: columns.next_multiple_of(LINE) + LINE,
            extras: Extras::default(),
            features: Features::default(),
            families: families.iter().map(strand).collect(),
            links_at: 0,
            strand_length: 0,
            row_length: 0,
        };
        Self { sheet, shape, lines: Vec::new(), stages: Vec::new() }
    }

    /// Room for what the constraints of a scene have; all of them do nothing yet.
    pub(crate) fn lay_out(
        &mut self,
        features: Features,
        extras: Extras,
        (gives, pass_count): (&[Option<Give>], u32),
    ) {
        for (strand, give) in self.shape.families.iter_mut().zip(gives) {
            strand.give = give.unwrap_or(strand.give);
        }
        self.shape.lay_out(features, extras);
        let passes = (0..pass_count).map(|index| Pass { index, count: pass_count });
        let stages = |pass| stages(&self.shape.families, pass, features.max_lengths);
        self.stages = passes.map(stages).collect();
        let length = self.shape.rows * self.shape.row_length;
        refill(&mut self.lines, length / LINE, Line([0.0; LINE]));
        for place in 0..self.shape.rows * self.shape.families.len() * self.shape.stride {
            self.set_term(place, &Term::NONE);
        }
        if extras.tethers {
            for row in 0..self.shape.rows {
                for column in 0..self.shape.stride {
                    self.set_tether(self.number_of([row, column]), f32::INFINITY);
                }
            }
        }
    }

    fn row(&mut self, row: usize) -> Row<'_> {
        let length = self.shape.row_length;
        let numbers: &mut [f32] = bytemuck::cast_slice_mut(&mut self.lines);
        Row::new(&mut numbers[row * length..][..length], &self.shape)
    }

    /// Where the term of a constraint is that begins there.
    pub(crate) fn place(&self, family: Family, [row, column]: [usize; 2]) -> usize {
        let strands = &self.shape.families;
        let strand = strands.iter().position(|one| one.family == family).unwrap_or_default();
        let at = if family.reach() > 0 { column } else { self.shape.place_across(family, column) };
        (row * strands.len() + strand) * self.shape.stride + at
    }

    /// Which of the families of the sheet a place belongs to.
    pub(crate) fn strand(&self, place: usize) -> usize {
        place / self.shape.stride % self.shape.families.len()
    }

    fn fields(&mut self, place: usize) -> (Fields<'_>, usize) {
        let (stride, strands) = (self.shape.stride, self.shape.families.len());
        let (block, at) = (place / stride, place % stride);
        let (features, length) = (self.shape.features, self.shape.strand_length);
        let links = self.row(block / strands).links;
        let block = &mut links[block % strands * length..][..length];
        (Fields::new(block, stride, features), at)
    }

    pub(crate) fn set_term(&mut self, place: usize, term: &Term) {
        let (mut fields, at) = self.fields(place);
        fields.set(at, term);
    }

    pub(crate) fn take_mark(&mut self, place: usize) -> f32 {
        let (mut fields, at) = self.fields(place);
        fields.take_mark(at)
    }

    /// Takes over the state at the start of a step: velocities in the place of displacements.
    pub(crate) fn unpack(&mut self, states: &[Particle]) {
        let first = self.sheet.first as usize;
        let columns = self.shape.columns;
        for row in 0..self.shape.rows {
            let states = &states[first + row * columns..][..columns];
            let Row { x, w, d, .. } = self.row(row);
            for axis in 0..3 {
                for (number, state) in x[axis].iter_mut().zip(states) {
                    *number = state.position[axis];
                }
                for (number, state) in d[axis].iter_mut().zip(states) {
                    *number = state.velocity[axis];
                }
            }
            for (number, state) in w.iter_mut().zip(states) {
                *number = state.inverse_mass;
            }
        }
    }

    /// Takes all rows through a pass. Whether anything has torn.
    ///
    /// Each member of the team has a band of rows. What cannot be finished at their edges, as it
    /// needs both, is the second round.
    pub(crate) fn sweep(&mut self, team: &mut Team, pass: Pass, motion: &Motion<'_>) -> bool {
        let (shape, stages) = (&self.shape, &self.stages[pass.index as usize]);
        let numbers: &mut [f32] = bytemuck::cast_slice_mut(&mut self.lines);
        let (kernels, reach) = (team.kernels, total_reach(stages));
        let count = shape.band_count(team.members(), reach);
        let cuts = (0..=count).map(|band| band * shape.rows / count);
        let spans = cuts
            .clone()
            .zip(cuts.clone().skip(1))
            .map(|(first, last)| (first..last, Span::new(first..last, shape.rows)));
        let seams = cuts.skip(1).take(count - 1);
        let seams = seams.map(|row| (row - reach..row + reach, Span::seam(row)));
        let mut is_marked = false;
        let mut round = |parts: &mut dyn Iterator<Item = (Range<usize>, Span)>| {
            let work = |part: &mut Part<'_>, scratch: &mut Scratch| {
                let band = Band { numbers: part.numbers, first: part.first, shape };
                let sweep = Sweep { stages, pass, motion, scratch };
                part.is_marked = kernels.run(SweepWork { band, span: part.span.clone(), sweep });
            };
            let parts = Part::cut(numbers, shape.row_length, parts);
            team.each(parts, work, |part| is_marked |= part.is_marked);
        };
        round(&mut spans.into_iter());
        if count > 1 {
            round(&mut seams.into_iter());
        }
        is_marked
    }

    /// Takes the displacement of a substep as velocity, and the state back to where it is published.
    pub(crate) fn pack(&mut self, states: &mut [Particle], h: f32) -> u64 {
        let mut frozen_count = 0;
        let first = self.sheet.first as usize;
        let columns = self.shape.columns;
        for row in 0..self.shape.rows {
            let states = &mut states[first + row * columns..][..columns];
            let Row { x, d, .. } = self.row(row);
            for (column, state) in states.iter_mut().enumerate() {
                let of = |fields: &[&mut [f32]; 3]| axes(|axis| fields[axis][column]);
                frozen_count += u64::from(super::pack(state, of(&x), of(&d), h));
            }
        }
        frozen_count
    }

    /// Where x of a particle is among the numbers.
    pub(crate) fn number_of(&self, [row, column]: [usize; 2]) -> usize {
        row * self.shape.row_length + column
    }

    /// A vector of a particle: fields `field`, `field` + 1, `field` + 2.
    #[inline(always)]
    fn vector(&self, number: usize, field: usize) -> [f32; 3] {
        let numbers: &[f32] = bytemuck::cast_slice(&self.lines);
        axes(|axis| numbers[number + (field + axis) * self.shape.stride])
    }

    fn set_vector(&mut self, number: usize, field: usize, vector: [f32; 3]) {
        let stride = self.shape.stride;
        let numbers: &mut [f32] = bytemuck::cast_slice_mut(&mut self.lines);
        for (axis, value) in vector.into_iter().enumerate() {
            numbers[number + (field + axis) * stride] = value;
        }
    }

    #[inline(always)]
    pub(crate) fn position(&self, number: usize) -> [f32; 3] {
        self.vector(number, 0)
    }

    #[inline(always)]
    pub(crate) fn inverse_mass(&self, number: usize) -> f32 {
        let numbers: &[f32] = bytemuck::cast_slice(&self.lines);
        numbers[number + 3 * self.shape.stride]
    }

    #[inline(always)]
    pub(crate) fn displacement(&self, number: usize) -> [f32; 3] {
        self.vector(number, 4)
    }

    pub(crate) fn set_displacement(&mut self, number: usize, displacement: [f32; 3]) {
        self.set_vector(number, 4, displacement);
    }

    pub(crate) fn set_wind(&mut self, number: usize, gain: [f32; 3]) {
        self.set_vector(number, self.shape.wind_at(), gain);
    }

    pub(crate) fn set_root(&mut self, number: usize, place: [f32; 3]) {
        self.set_vector(number, self.shape.root_at(), place);
    }

    /// Infinite where there is none.
    pub(crate) fn set_tether(&mut self, number: usize, length: f32) {
        let at = number + (self.shape.root_at() + 3) * self.shape.stride;
        let stride = self.shape.stride;
        let numbers: &mut [f32] = bytemuck::cast_slice_mut(&mut self.lines);
        (numbers[at], numbers[at + stride]) = (length, length * length);
    }
}

/// Rows that one member of a team works on.
struct Part<'a> {
    numbers: &'a mut [f32],
    /// The first row.
    first: usize,
    span: Span,
    is_marked: bool,
}

impl<'a> Part<'a> {
    /// Cuts ascending ranges of rows out of all numbers.
    fn cut(
        numbers: &'a mut [f32],
        row_length: usize,
        spans: impl Iterator<Item = (Range<usize>, Span)>,
    ) -> impl Iterator<Item = Self> {
        let (mut rest, mut next) = (numbers, 0);
        spans.map(move |(rows, span)| {
            let (_, from) =
                std::mem::take(&mut rest).split_at_mut((rows.start - next) * row_length);
            let (numbers, behind) = from.split_at_mut(rows.len() * row_length);
            (rest, next) = (behind, rows.end);
            Self { numbers, first: rows.start, span, is_marked: false }
        })
    }
}
