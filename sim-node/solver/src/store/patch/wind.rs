//! The wind on a sheet.
//!
//! Each cell has two triangles: upper left, lower left, lower right; and upper left, lower right, upper
//! right. The wind on eight cells is computed at once. Then eight particles sum it, each over its six
//! triangles in their order in the scene. Missing triangles at the border add 0, and so do triangles with a torn side.

use sim_scene::constraints::sides::TornSides;

use crate::kernels::huge_pages::refill;
use crate::kernels::lanes::{LaneWork, Lanes8, Wide, axes, lane_groups, lane_groups_mut};
use crate::kernels::vectors::sum;
use crate::step::wind::{Corner, TriangleWind, WindStep};
use crate::store::rows::RowLayout;

/// Groups of eight columns in a strip, whose wind stays in a near cache.
const STRIP_GROUPS: usize = 16;

/// Computes the velocities that the wind adds to the particles of a sheet.
pub(crate) struct SheetWindWork<'a> {
    pub(crate) numbers: &'a mut [f32],
    pub(crate) layout: &'a RowLayout,
    pub(crate) wind: &'a WindStep,
    pub(crate) torn: &'a TornCells,
}

/// The torn triangles of a sheet.
#[derive(Debug, Clone, Default)]
pub(crate) struct TornCells {
    /// By cell: 1 if its lower left triangle has a torn side, else 0. A row begins with [`MARGIN`] zeros. Row r has the cells
    /// between the rows r - 1 and r of particles, so the first and the last row have no cells of the sheet.
    lower: Vec<f32>,
    /// By cell: the same for its upper right triangle.
    upper: Vec<f32>,
    row_length: usize,
    are_any: bool,
}

/// Zeros at the start of each row of [`TornCells`], for the missing cells left of the first column.
const MARGIN: usize = 8;

impl TornCells {
    /// Makes room for the cells of a sheet, none of which is torn.
    pub(crate) fn new(layout: &RowLayout) -> Self {
        let row_length = MARGIN + layout.columns.next_multiple_of(8);
        let mut torn = Self { row_length, ..Self::default() };
        for triangles in [&mut torn.lower, &mut torn.upper] {
            refill(triangles, row_length * (layout.rows + 1), 0.0);
        }
        torn
    }

    /// Marks the triangles with torn sides. `first` is the first triangle of the sheet.
    pub(crate) fn follow(&mut self, layout: &RowLayout, triangles: &TornSides, first: u32) {
        let Self { lower, upper, row_length, are_any } = self;
        *are_any = false;
        let mut triangle = first;
        for row in 1..layout.rows {
            for column in 1..layout.columns {
                let place = row * *row_length + MARGIN + column - 1;
                for torn in [&mut lower[place], &mut upper[place]] {
                    let is_torn = !triangles.is_whole(triangle);
                    *torn = f32::from(u8::from(is_torn));
                    *are_any |= is_torn;
                    triangle += 1;
                }
            }
        }
    }

    /// Number of torn triangles around each of eight particles.
    #[inline(always)]
    fn count<W: Wide>(&self, row: usize, column: usize) -> W {
        let load = |torn: &[f32], at| W::load(&lane_groups(torn, at, 1)[0], 0);
        let (left, right) = (MARGIN + column - 1, MARGIN + column);
        let [lower_above, upper_above] = self.above(row);
        let [lower_below, upper_below] = self.above(row + 1);
        load(lower_above, left)
            + load(upper_above, left)
            + load(lower_above, right)
            + load(upper_below, left)
            + load(lower_below, right)
            + load(upper_below, right)
    }

    /// The lower left and the upper right triangles of the cells above a row of particles.
    #[inline(always)]
    fn above(&self, row: usize) -> [&[f32]; 2] {
        let numbers = row * self.row_length..(row + 1) * self.row_length;
        [&self.lower[numbers.clone()], &self.upper[numbers]]
    }
}

/// Consecutive columns of a sheet.
#[derive(Clone, Copy)]
struct Strip {
    first: usize,
    /// Number of groups of eight columns.
    groups: usize,
}

/// The wind on a row of cells of a strip, behind a group of cells left of it.
#[derive(Debug, Clone, Copy)]
struct CellRow {
    lower: TriangleRow,
    upper: TriangleRow,
}

/// u along x, y and z, and the pressure.
type TriangleRow = [[Lanes8; 1 + STRIP_GROUPS]; 4];

impl CellRow {
    const CALM: Self = {
        let calm = [[[0.0; 8]; 1 + STRIP_GROUPS]; 4];
        Self { lower: calm, upper: calm }
    };
}

impl LaneWork for SheetWindWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(mut self) {
        if self.torn.are_any { self.blow::<W, true>() } else { self.blow::<W, false>() }
    }
}

impl SheetWindWork<'_> {
    /// Compiled twice, so that sheets without torn triangles do not pay for them.
    #[inline(always)]
    fn blow<W: Wide, const ARE_TORN: bool>(&mut self) {
        let RowLayout { columns, rows, .. } = *self.layout;
        for first in (0..columns).step_by(8 * STRIP_GROUPS) {
            let groups = (columns - first).div_ceil(8).min(STRIP_GROUPS);
            let strip = Strip { first, groups };
            let [mut even, mut odd] = [CellRow::CALM; 2];
            for row in 0..rows {
                let (above, below) =
                    if row % 2 == 0 { (&odd, &mut even) } else { (&even, &mut odd) };
                if row + 1 < rows {
                    self.blow_at_cells::<W, ARE_TORN>(row, strip, below);
                } else {
                    *below = CellRow::CALM;
                }
                self.add_up::<W, ARE_TORN>(row, strip, [above, below]);
            }
        }
    }

    /// Computes the wind on the cells between a row and the next one.
    #[inline(always)]
    fn blow_at_cells<W: Wide, const ARE_TORN: bool>(
        &self,
        row: usize,
        strip: Strip,
        cells: &mut CellRow,
    ) {
        // The first strip has no cells left of it.
        let skipped = usize::from(strip.first == 0);
        let from = strip.first + 8 * skipped - 8;
        let count = 1 + strip.groups - skipped;
        let [above_left, above_right] = self.corners(row, from, count);
        let [below_left, below_right] = self.corners(row + 1, from, count);
        for group in 0..count {
            let [a, b] = [above_left.load::<W>(group), below_left.load(group)];
            let [c, d] = [below_right.load(group), above_right.load(group)];
            let is_cell = column::<W>(from + 8 * group).is_below(self.last_column());
            let [lower, upper] = if ARE_TORN {
                self.torn.above(row + 1).map(|torn| {
                    let torn = W::load(&lane_groups(torn, MARGIN + from + 8 * group, 1)[0], 0);
                    W::both(is_cell, torn.is_below(W::splat(1.0)))
                })
            } else {
                [is_cell; 2]
            };
            store(self.wind.on_triangle([a, b, c]), lower, (&mut cells.lower, skipped + group));
            store(self.wind.on_triangle([a, c, d]), upper, (&mut cells.upper, skipped + group));
        }
    }

    /// Adds up the velocities that the particles of a row gain from the cells above and below.
    #[inline(always)]
    fn add_up<W: Wide, const ARE_TORN: bool>(
        &mut self,
        row: usize,
        strip: Strip,
        [above, below]: [&CellRow; 2],
    ) {
        let RowLayout { rows, length, stride, .. } = *self.layout;
        let last_column = self.last_column::<W>();
        let one_if = |is_there| W::splat(if is_there { 1.0 } else { 0.0 });
        let (is_above, is_below) = (one_if(row > 0), one_if(row + 1 < rows));
        let numbers = &mut self.numbers[row * length..][..length];
        let (state, others) = numbers.split_at_mut(self.layout.wind_at() * stride);
        let inverse_masses = lane_groups(state, 3 * stride + strip.first, strip.groups);
        let (x, others) = others.split_at_mut(stride);
        let (y, z) = others.split_at_mut(stride);
        let x = lane_groups_mut(x, strip.first, strip.groups);
        let y = lane_groups_mut(y, strip.first, strip.groups);
        let z = lane_groups_mut(z, strip.first, strip.groups);
        let (zero, one, two) = (W::splat(0.0), W::splat(1.0), W::splat(2.0));
        for group in 0..strip.groups {
            let inverse_mass = W::load(&inverse_masses[group], 0);
            let column = column::<W>(strip.first + 8 * group);
            let left = one.masked(zero.is_below(column));
            let right = one.masked(column.is_below(last_column));
            let mut count = is_above * (two * left + right) + is_below * (left + two * right);
            if ARE_TORN {
                count = count - self.torn.count::<W>(row, strip.first + 8 * group);
            }
            let share_max = one / count;
            // The cell left of a particle, and the one that begins at it.
            let (left, right) = (8 * group + 7, 8 * group + 8);
            let mut sums = [zero; 3];
            for (cells, at) in [
                (&above.lower, left),
                (&above.upper, left),
                (&above.lower, right),
                (&below.upper, left),
                (&below.lower, right),
                (&below.upper, right),
            ] {
                sums = sum(sums, load::<W>(cells, at).gain(inverse_mass, share_max));
            }
            sums[0].store(&mut x[group], 0);
            sums[1].store(&mut y[group], 0);
            sums[2].store(&mut z[group], 0);
        }
    }

    /// The particles of a row from a column on, and their right neighbours, as corners.
    #[inline(always)]
    fn corners(&self, row: usize, from: usize, count: usize) -> [CornerGroups<'_>; 2] {
        let RowLayout { length, stride, .. } = *self.layout;
        let numbers = &self.numbers[row * length..][..length];
        let field = |index: usize, column| lane_groups(numbers, index * stride + column, count);
        let fields = |column| CornerGroups {
            position: axes(|axis| field(axis, column)),
            displacement: axes(|axis| field(4 + axis, column)),
        };
        [fields(from), fields(from + 1)]
    }

    #[inline(always)]
    fn last_column<W: Wide>(&self) -> W {
        W::splat((self.layout.columns - 1) as f32)
    }
}

/// Consecutive particles of a row.
struct CornerGroups<'a> {
    position: [&'a [Lanes8]; 3],
    displacement: [&'a [Lanes8]; 3],
}

impl CornerGroups<'_> {
    #[inline(always)]
    fn load<W: Wide>(&self, group: usize) -> Corner<W> {
        Corner {
            position: axes(|axis| W::load(&self.position[axis][group], 0)),
            displacement: axes(|axis| W::load(&self.displacement[axis][group], 0)),
        }
    }
}

/// The columns from `first` on.
#[inline(always)]
fn column<W: Wide>(first: usize) -> W {
    W::splat(first as f32) + W::load(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], 0)
}

/// Stores the wind on the triangles of a group, without pressure where there is no cell.
#[inline(always)]
fn store<W: Wide>(
    TriangleWind { relative: [x, y, z], pressure }: TriangleWind<W>,
    is_cell: W::Mask,
    (row, group): (&mut TriangleRow, usize),
) {
    x.store(&mut row[0][group], 0);
    y.store(&mut row[1][group], 0);
    z.store(&mut row[2][group], 0);
    pressure.masked(is_cell).store(&mut row[3][group], 0);
}

/// The wind on eight triangles from an index on.
#[inline(always)]
fn load<W: Wide>(row: &TriangleRow, at: usize) -> TriangleWind<W> {
    let relative = axes(|axis| load_numbers(&row[axis], at));
    TriangleWind { relative, pressure: load_numbers(&row[3], at) }
}

#[inline(always)]
fn load_numbers<W: Wide>(numbers: &[Lanes8], at: usize) -> W {
    W::load(&lane_groups(numbers.as_flattened(), at, 1)[0], 0)
}
