//! One fall, computed by Euler's two methods, by Verlet's and by the solver.

use crate::experiment::{self, Rates};
use crate::table::{Column, Origin, Table};

/// Acceleration of the fall, m/s^2.
const A: f64 = 10.0;

/// Duration of the fall, s.
const END_S: u32 = 10;

/// Step rates of the second table, Hz.
const RATES_HZ: [u32; 4] = [1, 10, 100, 1000];

/// Computes the tables of the lesson.
pub(crate) fn tables() -> Vec<Table> {
    vec![fall(), document(), errors()]
}

/// Method of integration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Method {
    /// Moves the position first.
    Explicit,
    /// Changes the velocity first.
    SemiImplicit,
    /// Has no velocity. The position before the start is the start itself.
    Verlet,
    /// Has no velocity. The position before the start is that of the same fall one step earlier.
    VerletHalf,
}

/// A falling particle. Verlet's methods use `previous`, and Euler's use `velocity`.
#[derive(Debug, Default)]
struct FallState {
    position: f64,
    velocity: f64,
    previous: f64,
}

impl Method {
    /// Returns the state before the first step.
    fn start(self, dt: f64) -> FallState {
        let previous = if self == Self::VerletHalf { A * dt * dt / 2.0 } else { 0.0 };
        FallState { previous, ..FallState::default() }
    }

    /// Advances the state by one step.
    fn step(self, fall: &mut FallState, dt: f64) {
        match self {
            Self::Explicit => {
                fall.position += fall.velocity * dt;
                fall.velocity += A * dt;
            }
            Self::SemiImplicit => {
                fall.velocity += A * dt;
                fall.position += fall.velocity * dt;
            }
            Self::Verlet | Self::VerletHalf => {
                let next = 2.0 * fall.position - fall.previous + A * dt * dt;
                fall.previous = fall.position;
                fall.position = next;
            }
        }
    }

    /// Returns the positions after 0, 1, ... steps.
    fn positions(self, dt: f64, steps: u32) -> Vec<f64> {
        let mut fall = self.start(dt);
        let mut positions = vec![fall.position];
        for _ in 0..steps {
            self.step(&mut fall, dt);
            positions.push(fall.position);
        }
        positions
    }

    /// Returns the position at the end of the fall minus a t^2 / 2, in m.
    fn error(self, rate_hz: u32) -> f64 {
        let positions = self.positions(1.0 / f64::from(rate_hz), END_S * rate_hz);
        positions[positions.len() - 1] - exact(f64::from(END_S))
    }
}

/// Returns a t^2 / 2, in m.
fn exact(t: f64) -> f64 {
    A * t * t / 2.0
}

/// Returns the position of semi-implicit Euler at a time: a h^2 m (m + 1) / 2 with m = t / h, in m.
fn law(t: f64, h: f64) -> f64 {
    let m = t / h;
    A * h * h * m * (m + 1.0) / 2.0
}

/// Runs the fall in the solver. Returns the positions after 0, 1, ... steps.
fn solver_positions(rates: Rates) -> Vec<f64> {
    let text = format!("gravity = [{A}, 0, 0]\n{rates}[[particle]]\nposition = [0, 0, 0]\n");
    let mut solver = experiment::solver(&text);
    let mut positions = vec![0.0];
    for _ in 0..END_S * rates.rate_hz {
        solver.step();
        positions.push(experiment::coordinate(&solver, 0, 0));
    }
    positions
}

/// Tabulates the fall step by step.
fn fall() -> Table {
    let times = || (0..=END_S).map(f64::from);
    let by = |method: Method| method.positions(1.0, END_S);
    let [whole, twentieth] = [1, 20].map(|substeps| Rates { substeps, ..Rates::plain(1) });
    let column = |origin, name, text| Column::new(origin, name, text).decimals(1);
    Table::new("fall", "a = 10 m/s^2 from rest, dt = 1 s; position in m")
        .column(Column::new(Origin::Given, "t", "time, s").cells(0..=END_S))
        .column(column(Origin::Law, "exact", "a t^2 / 2").cells(times().map(exact)))
        .column(
            column(Origin::Loop, "explicit", "explicit Euler: x += v dt, then v += a dt")
                .cells(by(Method::Explicit)),
        )
        .column(
            column(Origin::Loop, "semi", "semi-implicit Euler: v += a dt, then x += v dt")
                .cells(by(Method::SemiImplicit)),
        )
        .column(
            column(Origin::Loop, "verlet", "x' = 2 x - x[-1] + a dt^2, started with x[-1] = x[0]")
                .cells(by(Method::Verlet)),
        )
        .column(
            column(Origin::Loop, "verlet_half", "the same, started with x[-1] = x[0] + a dt^2 / 2")
                .cells(by(Method::VerletHalf)),
        )
        .column(
            column(Origin::Law, "velocity", "a t, m/s: exact, and the same for both Euler methods")
                .cells(times().map(|t| A * t)),
        )
        .column(column(Origin::Solver, "solver_1", "1 substep per step").cells(solver_positions(whole)))
        .column(
            column(Origin::Law, "law_1", "a h^2 m (m + 1) / 2 after m substeps of h = 1 s")
                .cells(times().map(|t| law(t, whole.h()))),
        )
        .column(
            column(Origin::Solver, "solver_20", "20 substeps per step")
                .decimals(2)
                .cells(solver_positions(twentieth)),
        )
        .column(
            column(Origin::Law, "law_20", "the same with h = 1/20 s")
                .decimals(2)
                .cells(times().map(|t| law(t, twentieth.h()))),
        )
        .note(
            "Tutorials call both methods Euler's. Explicit Euler moves the position first, with the \
             velocity from before the step. It falls short by a t dt / 2 and ends at 450. \
             Semi-implicit Euler changes the velocity first. It falls too far by the same amount \
             and ends at 550.",
        )
        .note(
            "Verlet is no better here. With the usual start x[-1] = x[0], it agrees with \
             semi-implicit Euler to the last digit. The start x[-1] = x[0] + a dt^2 / 2 makes it \
             exact, because that is where this fall would have been one step earlier.",
        )
        .note(
            "The solver applies semi-implicit Euler in substeps. With 20 of them, the error of 50 m \
             becomes 2.5 m.",
        )
}

/// Runs the loop of a tutorial, `while (time <= 10)`, with its print statement in two places.
fn document() -> Table {
    let mut fall = FallState::default();
    let (mut top, mut bottom) = (Vec::new(), Vec::new());
    for _ in 0..=END_S {
        top.push((fall.position, fall.velocity));
        Method::SemiImplicit.step(&mut fall, 1.0);
        bottom.push((fall.position, fall.velocity));
    }
    let lines = [top, bottom];
    let first = lines.each_ref().map(|lines| lines[0].0);
    let last = lines.each_ref().map(|lines| lines[lines.len() - 1]);
    Table::new(
        "print",
        "the loop of \"Verlet Integration and Cloth Physics Simulation\" (pikuma.com), while (time <= 10), with the \
         print statement in two places",
    )
    .column(Column::new(Origin::Given, "printed", "where the loop prints").cells(["top", "bottom"]))
    .column(Column::new(Origin::Loop, "passes", "through the loop").cells([END_S + 1; 2]))
    .column(Column::new(Origin::Loop, "first", "position in the line for time = 0, m").cells(first))
    .column(
        Column::new(Origin::Loop, "position", "in the line for time = 10, m")
            .cells(last.map(|(position, _)| position)),
    )
    .column(
        Column::new(Origin::Loop, "velocity", "in the line for time = 10, m/s")
            .cells(last.map(|(_, velocity)| velocity)),
    )
    .column(
        Column::new(Origin::Document, "doc_position", "as the tutorial prints it, m")
            .cells([Some(550.0), None]),
    )
    .column(
        Column::new(Origin::Document, "doc_velocity", "as the tutorial prints it, m/s")
            .cells([Some(100.0), None]),
    )
    .note(
        "The loop runs 11 times, for the times 0, 1, ... 10. The tutorial's table matches a loop \
             that prints before the update. A loop that prints after it shows the state of 11 s, \
             660 m and 110 m/s, in the line for 10 s.",
    )
}

/// Tabulates the errors at the end of the fall, for smaller and smaller steps.
fn errors() -> Table {
    let dts = || RATES_HZ.map(|rate_hz| 1.0 / f64::from(rate_hz));
    let by = |method: Method| RATES_HZ.map(|rate_hz| method.error(rate_hz));
    let end = f64::from(END_S);
    let mut solver = Vec::new();
    for rate_hz in RATES_HZ {
        let positions = solver_positions(Rates::plain(rate_hz));
        solver.push(positions[positions.len() - 1] - exact(end));
    }
    let column = |origin, name, text| Column::new(origin, name, text).decimals(3);
    Table::new("error", "position at t = 10 s minus the exact 500 m, for four step lengths; in m")
        .column(column(Origin::Given, "dt", "length of a step, s").cells(dts()))
        .column(column(Origin::Loop, "explicit", "explicit Euler").cells(by(Method::Explicit)))
        .column(
            column(Origin::Law, "law_explicit", "-a t dt / 2")
                .cells(dts().map(|dt| -A * end * dt / 2.0)),
        )
        .column(column(Origin::Loop, "semi", "semi-implicit Euler").cells(by(Method::SemiImplicit)))
        .column(column(Origin::Loop, "verlet", "Verlet with x[-1] = x[0]").cells(by(Method::Verlet)))
        .column(column(Origin::Solver, "solver", "1 substep per step, in f32").cells(solver))
        .column(
            column(Origin::Law, "law_semi", "a t dt / 2, for the three columns before it")
                .cells(dts().map(|dt| A * end * dt / 2.0)),
        )
        .column(
            column(Origin::Loop, "verlet_half", "Verlet with x[-1] = x[0] + a dt^2 / 2")
                .cells(by(Method::VerletHalf)),
        )
        .note(
            "A tenth of the step gives a tenth of the error. All methods except the last are of \
             first order and differ only in the sign of the error. Verlet with the second start has \
             no error under constant acceleration. Where the solver differs from the law, it shows \
             the rounding of 32 bits.",
        )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::assert_all_near;

    /// Adds up a h^2 (1 + 2 + ... + n) term by term, without the formula.
    fn sum(n: u32, h: f64) -> f64 {
        (1..=n).map(|term| A * h * h * f64::from(term)).sum()
    }

    #[test]
    fn each_column_of_the_fall_agrees_with_its_closed_form() {
        let table = fall();
        let expect = |name: &str, form: &dyn Fn(f64) -> f64, tolerance: f64| {
            let expected: Vec<_> = (0..=10).map(f64::from).map(form).collect();
            assert_all_near(name, &expected, &table.numbers(name), tolerance);
        };
        expect("explicit", &|t| 5.0 * t * (t - 1.0), 0.0);
        expect("semi", &|t| 5.0 * t * (t + 1.0), 0.0);
        expect("verlet", &|t| 5.0 * t * (t + 1.0), 0.0);
        expect("verlet_half", &|t| 5.0 * t * t, 0.0);
        expect("exact", &|t| 5.0 * t * t, 0.0);
        expect("velocity", &|t| 10.0 * t, 0.0);
        expect("solver_1", &|t| 5.0 * t * (t + 1.0), 0.0);
        expect("solver_20", &|t| 5.0 * t * (t + 0.05), 1e-3);
    }

    #[test]
    fn the_laws_agree_with_the_sums_that_they_replace() {
        let table = fall();
        for (name, substeps) in [("law_1", 1), ("law_20", 20)] {
            let h = 1.0 / f64::from(substeps);
            let expected: Vec<_> = (0..=10).map(|t| sum(t * substeps, h)).collect();
            assert_all_near(name, &expected, &table.numbers(name), 1e-9);
        }
        let errors = errors();
        let [explicit, semi] = [0, 1].map(|more| {
            let position = |rate: u32| sum(10 * rate - 1 + more, 1.0 / f64::from(rate)) - 500.0;
            RATES_HZ.map(position)
        });
        assert_all_near("law_explicit", &explicit, &errors.numbers("law_explicit"), 1e-8);
        assert_all_near("law_semi", &semi, &errors.numbers("law_semi"), 1e-8);
    }

    #[test]
    fn the_errors_shrink_in_proportion_to_the_step() {
        let table = errors();
        assert_all_near("explicit", &[-50.0, -5.0, -0.5, -0.05], &table.numbers("explicit"), 1e-8);
        for name in ["semi", "verlet"] {
            assert_all_near(name, &[50.0, 5.0, 0.5, 0.05], &table.numbers(name), 1e-7);
        }
        assert_all_near("half", &[0.0; 4], &table.numbers("verlet_half"), 1e-7);
        // 10,000 additions in f32, which resolves 0.03 mm at 500 m.
        assert_all_near("solver", &[50.0, 5.0, 0.5, 0.05], &table.numbers("solver"), 2e-2);
    }

    #[test]
    fn the_loop_of_the_tutorial_ends_at_550_or_660() {
        let table = document();
        assert_eq!(table.numbers("first"), [0.0, 10.0]);
        assert_eq!(table.numbers("position"), [550.0, 660.0]);
        assert_eq!(table.numbers("velocity"), [100.0, 110.0]);
        assert_eq!(table.numbers("passes"), [11.0, 11.0]);
    }
}
