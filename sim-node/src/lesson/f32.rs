//! What rounding to 32 bits does to a long sum, to a clock and to a velocity.

use std::ops::{AddAssign, Mul};

use super::experiment::{self, Rates};
use super::table::{Column, Origin, Table};

/// Ends of the long sum, s.
const ENDS_S: [u32; 2] = [10, 1000];

/// Steps a second of the long sum: dt = 0.01 s.
const SUM_HZ: u32 = 100;

/// Where the falls of the second table begin, m: u16, as these are exact in f32.
const HEIGHTS: [u16; 4] = [1, 10, 100, 1000];

/// Rates of the second table, Hz.
const FALL_HZ: [u16; 3] = [60, 240, 1200];

/// The tables of the lesson.
pub(super) fn tables() -> anyhow::Result<Vec<Table>> {
    Ok(vec![sum()?, trap()?])
}

/// A fall in the arithmetic of `T`: a = 10 m/s^2, dt = 0.01 s, velocity first.
#[derive(Debug, Default)]
struct Fall<T> {
    position: T,
    velocity: T,
    steps: u32,
}

impl<T: Copy + AddAssign + Mul<Output = T> + PartialOrd + Default> Fall<T> {
    /// Makes one step.
    fn step(&mut self, acceleration: T, dt: T) {
        self.velocity += acceleration * dt;
        self.position += self.velocity * dt;
        self.steps += 1;
    }

    /// Counts its steps, which needs no rounding.
    fn counted([acceleration, dt]: [T; 2], steps: u32) -> Self {
        let mut fall = Self::default();
        (0..steps).for_each(|_| fall.step(acceleration, dt));
        fall
    }

    /// Adds up its time: `while (time <= end)`.
    fn clocked([acceleration, dt]: [T; 2], end: T) -> Self {
        let (mut fall, mut time) = (Self::default(), T::default());
        while time <= end {
            fall.step(acceleration, dt);
            time += dt;
        }
        fall
    }
}

/// One row of the long sum.
struct Sum {
    end_s: u32,
    arithmetic: &'static str,
    steps: u32,
    position: f64,
    velocity: f64,
    /// Position and velocity as the tutorial prints them.
    document: Option<[f64; 2]>,
}

impl<T: Into<f64>> Fall<T> {
    /// The row of a fall to this end.
    fn row(self, end_s: u32, arithmetic: &'static str) -> Sum {
        let (position, velocity) = (self.position.into(), self.velocity.into());
        Sum { end_s, arithmetic, steps: self.steps, position, velocity, document: None }
    }
}

/// What the tutorial prints at its two ends.
fn document(end_s: u32) -> Option<[f64; 2]> {
    match end_s {
        10 => Some([500.498, 99.999]),
        1000 => Some([4_995_430.5, 9991.982]),
        _ => None,
    }
}

/// The long sum to both ends, in each arithmetic.
fn sums() -> anyhow::Result<Vec<Sum>> {
    let (wide, narrow) = ([10.0_f64, 0.01], [10.0_f32, 0.01]);
    let [short, long] = ENDS_S;
    let mut rows = Vec::new();
    for (end_s, end) in [(short, 10.0_f32), (long, 1000.0)] {
        let steps = end_s * SUM_HZ;
        rows.push(Fall::counted(wide, steps).row(end_s, "f64"));
        rows.push(Fall::clocked(wide, f64::from(end)).row(end_s, "f64 clock"));
        rows.push(Fall::counted(narrow, steps).row(end_s, "f32"));
        let clocked = Fall::clocked(narrow, end).row(end_s, "f32 clock");
        rows.push(Sum { document: document(end_s), ..clocked });
        rows.push(solved(end_s)?);
    }
    Ok(rows)
}

/// The long sum in the solver. Its limit of speed is raised above the 10 km/s of the end.
fn solved(end_s: u32) -> anyhow::Result<Sum> {
    let rates = Rates::plain(SUM_HZ);
    let text = format!(
        "gravity = [10, 0, 0]\n{rates}max_speed = 1e5\n[[particle]]\nposition = [0, 0, 0]\n"
    );
    let steps = end_s * SUM_HZ;
    let solver = experiment::stepped(&text, steps)?;
    let velocity = f64::from(solver.particle(0).velocity[0]);
    let position = experiment::coordinate(&solver, 0, 0);
    Ok(Sum { end_s, arithmetic: "solver", steps, position, velocity, document: None })
}

/// The long sum beside its closed form and the document.
fn sum() -> anyhow::Result<Table> {
    let rows = sums()?;
    let law = |row: &Sum| {
        let (m, h) = (f64::from(row.steps), 1.0 / f64::from(SUM_HZ));
        10.0 * h * h * m * (m + 1.0) / 2.0
    };
    let column = |origin, name, text| Column::new(origin, name, text).decimals(3);
    let printed = |index: usize| rows.iter().map(move |row| row.document.map(|pair| pair[index]));
    Ok(Table::new("sum", "a = 10 m/s^2 from rest, dt = 0.01 s, velocity first, to 10 and 1,000 s")
        .column(
            Column::new(Origin::Given, "t", "end, s; exact would be 500 m and 5,000,000 m")
                .cells(rows.iter().map(|row| row.end_s)),
        )
        .column(
            Column::new(Origin::Given, "arithmetic", "of the sum; clock: while (time <= end)")
                .cells(rows.iter().map(|row| row.arithmetic)),
        )
        .column(
            Column::new(Origin::Loop, "steps", "made until the end; of the solver, given")
                .cells(rows.iter().map(|row| row.steps)),
        )
        .column(
            column(Origin::Loop, "position", "m; in the last row of each end, the solver's")
                .cells(rows.iter().map(|row| row.position)),
        )
        .column(
            column(Origin::Loop, "velocity", "m/s; likewise")
                .cells(rows.iter().map(|row| row.velocity)),
        )
        .column(
            column(Origin::Law, "law", "a dt^2 m (m + 1) / 2 after so many steps m, m")
                .cells(rows.iter().map(law)),
        )
        .column(
            column(Origin::Law, "rounding", "position less law: what rounding did, m")
                .cells(rows.iter().map(|row| row.position - law(row))),
        )
        .column(
            column(Origin::Document, "doc_position", "as a tutorial prints it, m")
                .cells(printed(0)),
        )
        .column(
            column(Origin::Document, "doc_velocity", "as a tutorial prints it, m/s")
                .cells(printed(1)),
        )
        .note(
            "A tutorial prints 4,995,430.5 m at 1,000 s and calls it the cumulative error of \
             Euler integration. It is none: the method ends at 5,000,050 m, 50 m too far, as the \
             f64 rows show. The printed digits are those of 32 bits with a clock in 32 bits, \
             which runs fast and lets the loop end after 99,934 steps instead of 100,000; the \
             missing steps take away more than rounding adds. Its listing is JavaScript, \
             which has 64 bits and cannot print them.",
        )
        .note(
            "At 10 s the document has 500.498 where the same loop gives 500.497: that last digit \
             is not reproduced. The f64 clock falls short of 10 and of 1,000 by its rounding, so \
             that its loops make one step too many: count steps, and work out the time as step \
             x dt.",
        )
        .note(
            "The rounding of 32 bits does not cancel out. Each step adds the same 0.1 m/s, rounded to \
             what the velocity resolves: always up between 4,096 and 8,192 m/s, always down above. \
             The solver counts its steps and shares these errors: a few hundredths of a percent at \
             5,000 km.",
        ))
}

/// Way of a fall of 1 s whose velocity is the difference of two f32 positions.
fn fallen_by_difference(height: u16, rate_hz: u16) -> f64 {
    let h = 1.0 / f32::from(rate_hz);
    let (mut position, mut previous) = (f32::from(height), f32::from(height));
    for _ in 0..rate_hz {
        let velocity = (position - previous) / h - 9.81 * h;
        previous = position;
        position += velocity * h;
    }
    f64::from(height) - f64::from(position)
}

/// Way of a fall of 1 s in the solver, whose state is position and velocity.
fn fallen_in_solver(height: u16, rate_hz: u16) -> anyhow::Result<f64> {
    let rates = Rates::plain(u32::from(rate_hz));
    let text = format!("{rates}[[particle]]\nposition = [0, {height}, 0]\n");
    let solver = experiment::stepped(&text, u32::from(rate_hz))?;
    Ok(f64::from(height) - experiment::coordinate(&solver, 0, 1))
}

/// Way of a fall of 1 s without rounding: g h^2 m (m + 1) / 2 with m h = 1.
fn fallen(rate_hz: u16) -> f64 {
    let m = f64::from(rate_hz);
    9.81 * (m + 1.0) / (2.0 * m)
}

/// A velocity by difference beside a velocity as state.
fn trap() -> anyhow::Result<Table> {
    let pairs = || HEIGHTS.into_iter().flat_map(|height| FALL_HZ.map(|rate_hz| (height, rate_hz)));
    let percent = |way: f64, rate_hz: u16| 100.0 * (way / fallen(rate_hz) - 1.0);
    let difference = pairs().map(|(height, rate_hz)| fallen_by_difference(height, rate_hz));
    let difference: Vec<_> = difference.collect();
    let solver = pairs().map(|(height, rate_hz)| fallen_in_solver(height, rate_hz));
    let solver: Vec<_> = solver.collect::<anyhow::Result<_>>()?;
    let errors = |ways: &[f64]| {
        let errors = pairs().zip(ways).map(|((_, rate_hz), way)| percent(*way, rate_hz));
        errors.collect::<Vec<_>>()
    };
    let column = |origin, name, text| Column::new(origin, name, text).decimals(4);
    Ok(Table::new("trap", "the f32 trap, falling for 1 s from rest with g = 9.81 m/s^2")
        .column(
            Column::new(Origin::Given, "start", "coordinate of the start, m")
                .cells(pairs().map(|(height, _)| u32::from(height))),
        )
        .column(
            Column::new(Origin::Given, "rate", "steps a second")
                .cells(pairs().map(|(_, rate_hz)| u32::from(rate_hz))),
        )
        .column(
            column(Origin::Loop, "by_difference", "way fallen with v = (x - x[-1]) / h in f32, m")
                .cells(difference.iter().copied()),
        )
        .column(
            column(Origin::Solver, "by_velocity", "way fallen with v as state, d = h v, m")
                .cells(solver.iter().copied()),
        )
        .column(
            column(Origin::Law, "law", "g h^2 m (m + 1) / 2 after m steps, m")
                .cells(pairs().map(|(_, rate_hz)| fallen(rate_hz))),
        )
        .column(
            column(Origin::Loop, "difference_%", "error of by_difference, percent of law")
                .cells(errors(&difference)),
        )
        .column(
            column(Origin::Solver, "velocity_%", "error of by_velocity, percent of law")
                .cells(errors(&solver)),
        )
        .note(
            "Position Verlet and position based dynamics take the velocity from two positions. A \
             step adds g h^2 to their difference, 7 um at 1,200 Hz, but an f32 near 1,000 \
             resolves 61 um: the particle never falls. Smaller steps make it worse, not better.",
        )
        .note(
            "The solver keeps the velocity, and works on the displacement d = h v beside the \
             position, so that gravity is added to a small number. What is left is the rounding \
             of each step's sum.",
        ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lesson::experiment::assert_all_near;

    #[test]
    fn the_law_of_the_long_sum_is_the_sum() {
        let table = sum().unwrap();
        let steps = table.numbers("steps");
        for (law, steps) in table.numbers("law").into_iter().zip(steps) {
            let mut found = 0.0;
            let mut count = 0.0;
            while count < steps {
                count += 1.0;
                found += 1e-3 * count;
            }
            assert_all_near("law", &[law], &[found], 1e-9 * found);
        }
    }

    #[test]
    fn the_long_sum_has_the_numbers_of_its_arithmetics() {
        let table = sum().unwrap();
        let (position, velocity) = (table.numbers("position"), table.numbers("velocity"));
        let steps = [1000.0, 1001.0, 1000.0, 1000.0, 1000.0];
        assert_eq!(table.numbers("steps")[..5], steps);
        let steps = [100_000.0, 100_001.0, 100_000.0, 99_934.0, 100_000.0];
        assert_eq!(table.numbers("steps")[5..], steps);
        assert_all_near("f64", &[500.5, 100.0], &[position[0], velocity[0]], 1e-9);
        assert_all_near("f64", &[5_000_050.0, 1e4], &[position[5], velocity[5]], 1e-4);
        assert_all_near("f32", &[500.497, 99.9990], &[position[2], velocity[2]], 1e-4);
        assert_all_near("f32", &[5_002_030.5, 9998.557], &[position[7], velocity[7]], 1e-3);
        // The law within the resolution of the numbers that it adds up.
        assert_all_near("solver", &[500.5, 100.0], &[position[4], velocity[4]], 5e-3);
        assert_all_near("solver", &[5_000_050.0, 1e4], &[position[9], velocity[9]], 2500.0);
    }

    #[test]
    fn the_f32_clock_prints_the_digits_of_the_document() {
        let table = sum().unwrap();
        for (found, printed) in [("position", "doc_position"), ("velocity", "doc_velocity")] {
            let (found, printed) = (table.numbers(found)[8], table.numbers(printed)[8]);
            assert_eq!(format!("{found:.3}"), format!("{printed:.3}"));
        }
    }

    #[test]
    fn velocity_as_state_falls_as_the_law_says_wherever_it_is() {
        let table = trap().unwrap();
        let sums: Vec<_> = [60, 240, 1200]
            .map(|m| (1..=m).map(|n| 9.81 * f64::from(n) / f64::from(m).powi(2)).sum::<f64>())
            .repeat(4);
        assert_all_near("law", &sums, &table.numbers("law"), 1e-9);
        assert_all_near("velocity", &[0.0; 12], &table.numbers("velocity_%"), 0.1);
    }

    #[test]
    fn velocity_by_difference_loses_gravity_far_from_the_origin() {
        let errors = trap().unwrap().numbers("difference_%");
        assert_eq!(errors[11], -100.0, "1,200 Hz at 1 km");
        let is_small = |index: usize| errors[index].abs() < 0.1;
        assert!(is_small(0) && is_small(3) && is_small(6), "60 Hz near the origin: {errors:?}");
        assert!(errors[8] > 10.0 && errors[5] < -1.0, "1,200 Hz at 100 m and 10 m: {errors:?}");
    }
}
