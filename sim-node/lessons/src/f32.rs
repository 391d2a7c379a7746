//! Effects of rounding to 32 bits on a long sum, on a clock and on a velocity.

use std::ops::{AddAssign, Mul};

use crate::experiment::{self, Rates};
use crate::table::{Column, Origin, Table};

/// End times of the long sum, s.
const ENDS_S: [u32; 2] = [10, 1000];

/// Steps per second of the long sum: dt = 0.01 s.
const SUM_HZ: u32 = 100;

/// Starting heights of the second table, m. Every u16 is exact in f32.
const HEIGHTS: [u16; 4] = [1, 10, 100, 1000];

/// Step rates of the second table, Hz.
const FALL_HZ: [u16; 3] = [60, 240, 1200];

/// Computes the tables of the lesson.
pub(crate) fn tables() -> Vec<Table> {
    vec![sum(), trap()]
}

/// Fall that is summed in the arithmetic of `T`.
#[derive(Debug, Default)]
struct SummedFall<T> {
    position: T,
    velocity: T,
    steps: u32,
}

impl<T: Copy + AddAssign + Mul<Output = T> + PartialOrd + Default> SummedFall<T> {
    /// Makes one step of semi-implicit Euler.
    fn step(&mut self, acceleration: T, dt: T) {
        self.velocity += acceleration * dt;
        self.position += self.velocity * dt;
        self.steps += 1;
    }

    /// Falls for a number of steps. Counting them involves no rounding.
    fn counted([acceleration, dt]: [T; 2], steps: u32) -> Self {
        let mut fall = Self::default();
        (0..steps).for_each(|_| fall.step(acceleration, dt));
        fall
    }

    /// Falls while a clock that adds up the steps shows at most `end`: `while (time <= end)`.
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
    /// Position and velocity that the tutorial prints.
    document: Option<[f64; 2]>,
}

impl<T: Into<f64>> SummedFall<T> {
    /// Makes the row of a fall that ends at `end_s`.
    fn row(self, end_s: u32, arithmetic: &'static str) -> Sum {
        let (position, velocity) = (self.position.into(), self.velocity.into());
        Sum { end_s, arithmetic, steps: self.steps, position, velocity, document: None }
    }
}

/// Returns the position and the velocity that the tutorial prints at an end time.
fn document(end_s: u32) -> Option<[f64; 2]> {
    match end_s {
        10 => Some([500.498, 99.999]),
        1000 => Some([4_995_430.5, 9991.982]),
        _ => None,
    }
}

/// Computes the long sum to both end times in each arithmetic.
fn sums() -> Vec<Sum> {
    let (wide, narrow) = ([10.0_f64, 0.01], [10.0_f32, 0.01]);
    let [short, long] = ENDS_S;
    let mut rows = Vec::new();
    for (end_s, end) in [(short, 10.0_f32), (long, 1000.0)] {
        let steps = end_s * SUM_HZ;
        rows.push(SummedFall::counted(wide, steps).row(end_s, "f64"));
        rows.push(SummedFall::clocked(wide, f64::from(end)).row(end_s, "f64 clock"));
        rows.push(SummedFall::counted(narrow, steps).row(end_s, "f32"));
        let clocked = SummedFall::clocked(narrow, end).row(end_s, "f32 clock");
        rows.push(Sum { document: document(end_s), ..clocked });
        rows.push(solver_sum(end_s));
    }
    rows
}

/// Computes the long sum in the solver. Its speed limit is raised, because the fall reaches 10 km/s.
fn solver_sum(end_s: u32) -> Sum {
    let rates = Rates::plain(SUM_HZ);
    let text = format!(
        "gravity = [10, 0, 0]\n{rates}max_speed = 1e5\n[[particle]]\nposition = [0, 0, 0]\n"
    );
    let steps = end_s * SUM_HZ;
    let solver = experiment::stepped(&text, steps);
    let velocity = f64::from(solver.particle(0).velocity[0]);
    let position = experiment::coordinate(&solver, 0, 0);
    Sum { end_s, arithmetic: "solver", steps, position, velocity, document: None }
}

/// Tabulates the long sum beside its closed form and the tutorial.
fn sum() -> Table {
    let rows = sums();
    let law = |row: &Sum| {
        let (m, h) = (f64::from(row.steps), 1.0 / f64::from(SUM_HZ));
        10.0 * h * h * m * (m + 1.0) / 2.0
    };
    let column = |origin, name, text| Column::new(origin, name, text).decimals(3);
    let printed = |index: usize| rows.iter().map(move |row| row.document.map(|pair| pair[index]));
    Table::new("sum", "semi-implicit Euler from rest to 10 s and 1,000 s, a = 10 m/s^2, dt = 0.01 s")
        .column(
            Column::new(Origin::Given, "t", "end time, s; the exact positions are 500 m and 5,000,000 m")
                .cells(rows.iter().map(|row| row.end_s)),
        )
        .column(
            Column::new(Origin::Given, "arithmetic", "type of the numbers; clock: the loop runs while (time <= end)")
                .cells(rows.iter().map(|row| row.arithmetic)),
        )
        .column(
            Column::new(Origin::Loop, "steps", "steps until the end; given for the solver")
                .cells(rows.iter().map(|row| row.steps)),
        )
        .column(
            column(Origin::Loop, "position", "m; from the solver in its rows")
                .cells(rows.iter().map(|row| row.position)),
        )
        .column(
            column(Origin::Loop, "velocity", "m/s; from the solver in its rows")
                .cells(rows.iter().map(|row| row.velocity)),
        )
        .column(
            column(Origin::Law, "law", "a dt^2 m (m + 1) / 2 after m steps, m")
                .cells(rows.iter().map(law)),
        )
        .column(
            column(Origin::Law, "rounding", "position minus law: the effect of rounding, m")
                .cells(rows.iter().map(|row| row.position - law(row))),
        )
        .column(
            column(Origin::Document, "doc_position", "as the tutorial prints it, m")
                .cells(printed(0)),
        )
        .column(
            column(Origin::Document, "doc_velocity", "as the tutorial prints it, m/s")
                .cells(printed(1)),
        )
        .note(
            "The tutorial \"Verlet Integration and Cloth Physics Simulation\" (pikuma.com) prints \
             4,995,430.5 m at 1,000 s and calls the difference from 5,000,000 m the \
             cumulative error of Euler integration. It is not: the method ends at 5,000,050 m, which \
             is 50 m too far, as the f64 rows show. The printed digits come from f32 with a clock \
             in f32. That clock runs fast and ends the loop after 99,934 steps instead of 100,000. \
             The missing steps remove more than rounding adds. The tutorial's listing is JavaScript, \
             whose numbers have 64 bits, so it cannot print these digits.",
        )
        .note(
            "At 10 s the tutorial prints 500.498, but the same loop gives 500.497. The last digit is \
             not reproduced. The f64 clock falls short of 10 s and of 1,000 s by its rounding error, \
             so its loops take one step too many. Count the steps, and compute the time as \
             step x dt.",
        )
        .note(
            "The rounding errors of f32 do not cancel. Each step adds the same 0.1 m/s, rounded to \
             the resolution of the velocity: always up between 4,096 and 8,192 m/s, and always down \
             above that. The solver counts its steps, and it shares these rounding errors: a few \
             hundredths of a percent of 5,000 km.",
        )
}

/// Returns the distance of a 1 s fall whose velocity is the difference of two f32 positions, m.
fn distance_by_difference(height: u16, rate_hz: u16) -> f64 {
    let h = 1.0 / f32::from(rate_hz);
    let (mut position, mut previous) = (f32::from(height), f32::from(height));
    for _ in 0..rate_hz {
        let velocity = (position - previous) / h - 9.81 * h;
        previous = position;
        position += velocity * h;
    }
    f64::from(height) - f64::from(position)
}

/// Returns the distance of a 1 s fall in the solver, whose state is position and velocity, m.
fn distance_in_solver(height: u16, rate_hz: u16) -> f64 {
    let rates = Rates::plain(u32::from(rate_hz));
    let text = format!("{rates}[[particle]]\nposition = [0, {height}, 0]\n");
    let solver = experiment::stepped(&text, u32::from(rate_hz));
    f64::from(height) - experiment::coordinate(&solver, 0, 1)
}

/// Returns the distance of a 1 s fall without rounding: g h^2 m (m + 1) / 2 with m h = 1 s, m.
fn distance_law(rate_hz: u16) -> f64 {
    let m = f64::from(rate_hz);
    9.81 * (m + 1.0) / (2.0 * m)
}

/// Compares a velocity that is a difference of positions with a velocity that is part of the state.
fn trap() -> Table {
    let pairs = || HEIGHTS.into_iter().flat_map(|height| FALL_HZ.map(|rate_hz| (height, rate_hz)));
    let by = |form: fn(u16, u16) -> f64| {
        pairs().map(|(height, rate_hz)| form(height, rate_hz)).collect::<Vec<_>>()
    };
    let (difference, solver) = (by(distance_by_difference), by(distance_in_solver));
    let percent = |distance: f64, rate_hz: u16| 100.0 * (distance / distance_law(rate_hz) - 1.0);
    let errors = |distances: &[f64]| {
        let errors = pairs().zip(distances).map(|((_, rate_hz), one)| percent(*one, rate_hz));
        errors.collect::<Vec<_>>()
    };
    let column = |origin, name, text| Column::new(origin, name, text).decimals(4);
    Table::new("trap", "the f32 trap: a fall of 1 s from rest with g = 9.81 m/s^2")
        .column(
            Column::new(Origin::Given, "start", "height of the start, m")
                .cells(pairs().map(|(height, _)| u32::from(height))),
        )
        .column(
            Column::new(Origin::Given, "rate", "steps per second")
                .cells(pairs().map(|(_, rate_hz)| u32::from(rate_hz))),
        )
        .column(
            column(Origin::Loop, "by_difference", "distance with v = (x - x[-1]) / h in f32, m")
                .cells(difference.iter().copied()),
        )
        .column(
            column(Origin::Solver, "by_velocity", "distance with v in the state and d = h v, m")
                .cells(solver.iter().copied()),
        )
        .column(
            column(Origin::Law, "law", "g h^2 m (m + 1) / 2 after m steps, m")
                .cells(pairs().map(|(_, rate_hz)| distance_law(rate_hz))),
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
            "Position Verlet and position-based dynamics compute the velocity from two positions. A \
             step adds g h^2 to their difference. At 1,200 Hz that is 7 um, but an f32 near 1,000 m \
             resolves only 61 um, so the particle never falls. Smaller steps make this worse.",
        )
        .note(
            "The solver keeps the velocity in its state and works on the displacement d = h v beside \
             the position. Gravity is thus added to a small number. What remains is the rounding \
             error of each step's sum.",
        )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::assert_all_near;

    #[test]
    fn the_law_of_the_long_sum_agrees_with_the_sum() {
        let table = sum();
        let steps = table.numbers("steps");
        for (law, steps) in table.numbers("law").into_iter().zip(steps) {
            let mut total = 0.0;
            let mut count = 0.0;
            while count < steps {
                count += 1.0;
                total += 1e-3 * count;
            }
            assert_all_near("law", &[law], &[total], 1e-9 * total);
        }
    }

    #[test]
    fn each_arithmetic_has_its_own_step_count_and_sum() {
        let table = sum();
        let (position, velocity) = (table.numbers("position"), table.numbers("velocity"));
        let steps = [1000.0, 1001.0, 1000.0, 1000.0, 1000.0];
        assert_eq!(table.numbers("steps")[..5], steps);
        let steps = [100_000.0, 100_001.0, 100_000.0, 99_934.0, 100_000.0];
        assert_eq!(table.numbers("steps")[5..], steps);
        assert_all_near("f64", &[500.5, 100.0], &[position[0], velocity[0]], 1e-9);
        assert_all_near("f64", &[5_000_050.0, 1e4], &[position[5], velocity[5]], 1e-4);
        assert_all_near("f32", &[500.497, 99.9990], &[position[2], velocity[2]], 1e-4);
        assert_all_near("f32", &[5_002_030.5, 9998.557], &[position[7], velocity[7]], 1e-3);
        // The tolerance is the resolution of the numbers that the solver adds up.
        assert_all_near("solver", &[500.5, 100.0], &[position[4], velocity[4]], 5e-3);
        assert_all_near("solver", &[5_000_050.0, 1e4], &[position[9], velocity[9]], 2500.0);
    }

    #[test]
    fn the_f32_clock_prints_the_digits_of_the_tutorial() {
        let table = sum();
        for (computed, printed) in [("position", "doc_position"), ("velocity", "doc_velocity")] {
            let (computed, printed) = (table.numbers(computed)[8], table.numbers(printed)[8]);
            assert_eq!(format!("{computed:.3}"), format!("{printed:.3}"));
        }
    }

    #[test]
    fn a_velocity_in_the_state_follows_the_law_at_every_height() {
        let table = trap();
        let sums: Vec<_> = [60, 240, 1200]
            .map(|m| (1..=m).map(|n| 9.81 * f64::from(n) / f64::from(m).powi(2)).sum::<f64>())
            .repeat(4);
        assert_all_near("law", &sums, &table.numbers("law"), 1e-9);
        assert_all_near("velocity", &[0.0; 12], &table.numbers("velocity_%"), 0.1);
    }

    #[test]
    fn a_velocity_by_difference_loses_gravity_far_from_the_origin() {
        let errors = trap().numbers("difference_%");
        assert_eq!(errors[11], -100.0, "1,200 Hz at 1 km");
        let is_small = |index: usize| errors[index].abs() < 0.1;
        assert!(is_small(0) && is_small(3) && is_small(6), "60 Hz near the origin: {errors:?}");
        assert!(errors[8] > 10.0 && errors[5] < -1.0, "1,200 Hz at 100 m and 10 m: {errors:?}");
    }
}
