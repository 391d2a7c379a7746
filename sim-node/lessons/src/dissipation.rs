//! Energy that a rigid stick loses through the time discretisation, and the cure: more substeps.

use crate::experiment::{self, Rates};
use crate::table::{Column, Origin, Table};

/// Gravity, m/s^2.
const G: f64 = 9.81;

/// Numbers of substeps, and of passes for comparison.
const COUNTS: [u32; 4] = [1, 4, 16, 64];

/// Step rate of the rotor, Hz.
const ROTOR_HZ: u32 = 60;

/// Initial angular velocity of the rotor, rad/s: one turn per second.
const TURN: f64 = std::f64::consts::TAU;

/// Step rate of the pendulum, Hz.
const PENDULUM_HZ: u32 = 240;

/// Duration of the swing, s.
const SWING_S: u32 = 10;

/// Steps of the integration of the energy balance, per second.
const BALANCE_HZ: u32 = 1000;

/// Computes the tables of the lesson.
pub(crate) fn tables() -> Vec<Table> {
    vec![rotor(), pendulum()]
}

/// Returns the angular velocity of a free rotor after 1 s in the solver, as a fraction of the first.
///
/// The rotor is a stick of 1 m with one pinned end, without gravity.
fn rotor_in_solver(rates: Rates) -> f64 {
    let text = format!(
        "gravity = [0, 0, 0]\n{rates}[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [1, 0, 0]\nvelocity = [0, {TURN}, 0]\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = 1\n"
    );
    let velocity = experiment::stepped(&text, rates.rate_hz).particle(1).velocity;
    let [x, y, _] = velocity.map(f64::from);
    x.hypot(y) / TURN
}

/// Returns 1 / sqrt(1 + 2 h w^2 t) after 1 s: the solution of dw/dt = -h w^3.
fn rotor_law(h: f64) -> f64 {
    1.0 / (1.0 + 2.0 * h * TURN * TURN).sqrt()
}

/// Rates of a scene with these substeps.
fn substeps(rate_hz: u32) -> [Rates; COUNTS.len()] {
    COUNTS.map(|substeps| Rates { substeps, ..Rates::plain(rate_hz) })
}

/// Rates of a scene with these passes in a single substep.
fn passes(rate_hz: u32) -> [Rates; COUNTS.len()] {
    COUNTS.map(|iterations| Rates { iterations, ..Rates::plain(rate_hz) })
}

/// Tabulates a stick that turns without gravity.
fn rotor() -> Table {
    let column = |origin, name, text| Column::new(origin, name, text).decimals(2);
    Table::new("rotor", "a rigid stick that turns freely, once per second at first, 60 Hz; after 1 s")
        .column(Column::new(Origin::Given, "substeps", "per step").cells(COUNTS))
        .column(
            column(Origin::Solver, "kept_%", "angular velocity, percent of its initial value")
                .cells(substeps(ROTOR_HZ).map(|rates| 100.0 * rotor_in_solver(rates))),
        )
        .column(
            column(Origin::Law, "law_%", "100 / sqrt(1 + 2 h w^2 t), from dw/dt = -h w^3")
                .cells(substeps(ROTOR_HZ).map(|rates| 100.0 * rotor_law(rates.h()))),
        )
        .column(
            column(Origin::Solver, "passes_%", "the same with 1 substep and as many passes")
                .cells(passes(ROTOR_HZ).map(|rates| 100.0 * rotor_in_solver(rates))),
        )
        .note(
            "Nothing brakes this stick except the time discretisation. A substep first moves the \
             particle straight ahead by h v. The projection then pulls it back to its distance from \
             the pin, along the stick as it points at the end of the substep. By then the stick has \
             turned by the angle h v / L, so the part T h v / L of its tension T acts against the \
             motion.",
        )
        .note(
            "This part removes energy at the rate dE/dt = -h T v^2 / L, where v is the speed and L \
             the length of the stick. A free rotor has T = m v^2 / L, which gives dw/dt = -h w^3.",
        )
}

/// Returns the energy that a pendulum of 1 m and 1 kg loses in the solver, as a fraction.
fn lost_in_solver(angle: f64, rates: Rates) -> f64 {
    let (x, y) = (angle.sin(), -angle.cos());
    let text = format!(
        "gravity = [0, -{G}, 0]\n{rates}[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [{x}, {y}, 0]\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = 1\n"
    );
    let bob = experiment::stepped(&text, SWING_S * rates.rate_hz).particle(1);
    let [vx, vy, _] = bob.velocity.map(f64::from);
    let energy = 0.5 * (vx * vx + vy * vy) + G * (f64::from(bob.position[1]) + 1.0);
    1.0 - energy / (G * (1.0 + y))
}

/// Angle and angular velocity of a pendulum.
type Swing = [f64; 2];

/// Returns the energy that the law takes from a pendulum of 1 m and 1 kg, as a fraction.
///
/// dE/dt = -h T v^2 / L with T = v^2 / L + g cos(angle) is an angular acceleration of -h T w beside
/// that of gravity. The classical Runge-Kutta method of order 4 integrates both.
fn lost_by_balance(angle: f64, h: f64) -> f64 {
    let slope = |[angle, w]: Swing| [w, -G * angle.sin() - h * (w * w + G * angle.cos()) * w];
    let after = |[angle, w]: Swing, [da, dw]: Swing, dt: f64| [angle + da * dt, w + dw * dt];
    let dt = 1.0 / f64::from(BALANCE_HZ);
    let mut state = [angle, 0.0];
    for _ in 0..SWING_S * BALANCE_HZ {
        let k1 = slope(state);
        let k2 = slope(after(state, k1, dt / 2.0));
        let k3 = slope(after(state, k2, dt / 2.0));
        let k4 = slope(after(state, k3, dt));
        let mean = [0, 1].map(|part| (k1[part] + 2.0 * (k2[part] + k3[part]) + k4[part]) / 6.0);
        state = after(state, mean, dt);
    }
    let [end, w] = state;
    1.0 - (w * w / 2.0 + G * (1.0 - end.cos())) / (G * (1.0 - angle.cos()))
}

/// Returns 1 - exp(-g h t / L), the fraction of its energy that a small swing loses.
fn small_law(h: f64) -> f64 {
    1.0 - (-G * h * f64::from(SWING_S)).exp()
}

/// Tabulates the energy that a pendulum loses.
fn pendulum() -> Table {
    let column = |origin, name, text| Column::new(origin, name, text).decimals(2);
    let percent = |rates: [Rates; COUNTS.len()], form: &dyn Fn(Rates) -> f64| {
        rates.map(|rates| 100.0 * form(rates))
    };
    let rates = substeps(PENDULUM_HZ);
    Table::new("pendulum", "a pendulum of 1 m, damping = 0, 240 Hz: energy lost in 10 s, in percent")
        .column(Column::new(Origin::Given, "substeps", "per step; the cost").cells(COUNTS))
        .column(
            column(Origin::Solver, "from_1", "released at 1 rad")
                .cells(percent(rates, &|rates| lost_in_solver(1.0, rates))),
        )
        .column(
            column(Origin::Loop, "balance", "dE/dt = -h T v^2 / L, integrated from 1 rad")
                .cells(percent(rates, &|rates| lost_by_balance(1.0, rates.h()))),
        )
        .column(
            column(Origin::Solver, "from_0.1", "released at 0.1 rad")
                .cells(percent(rates, &|rates| lost_in_solver(0.1, rates))),
        )
        .column(
            column(Origin::Law, "law_small", "1 - exp(-g h t / L), for small swings")
                .cells(percent(rates, &|rates| small_law(rates.h()))),
        )
        .column(
            column(Origin::Solver, "passes", "released at 1 rad, 1 substep, as many passes")
                .cells(percent(passes(PENDULUM_HZ), &|rates| lost_in_solver(1.0, rates))),
        )
        .column(
            Column::new(Origin::Law, "damping", "g h / L, 1/s: the damping with the same effect")
                .decimals(4)
                .cells(rates.map(|rates| G * rates.h())),
        )
        .note(
            "The pendulum loses energy by the same law, dE/dt = -h T v^2 / L. In a small swing the \
             tension is about m g and v^2 is on average half of its maximum, so the energy decays \
             as exp(-g h t / L), as if `damping` were g h / L. A wide swing has a higher tension and \
             loses more. The solver and the laws differ by less than 0.2, by terms of higher order in h \
             and by rounding.",
        )
        .note(
            "The loss is proportional to h. The cure is more substeps: four times as many leave about \
             a quarter of the loss and take four times as long to compute. Spending the same time on \
             passes changes nothing, because one pass already solves a single stick.",
        )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::assert_all_near;

    #[test]
    fn a_free_rotor_slows_down_by_its_law() {
        let table = rotor();
        assert_all_near("kept", &table.numbers("law_%"), &table.numbers("kept_%"), 0.2);
        assert_all_near("60 Hz", &[65.7], &table.numbers("kept_%")[..1], 0.2);
    }

    #[test]
    fn a_pendulum_loses_the_energy_of_the_balance() {
        let table = pendulum();
        assert_all_near("1 rad", &table.numbers("balance"), &table.numbers("from_1"), 0.5);
        assert_all_near("0.1 rad", &table.numbers("law_small"), &table.numbers("from_0.1"), 0.5);
    }

    #[test]
    fn four_times_the_substeps_leave_a_quarter_of_the_loss() {
        let lost = pendulum().numbers("from_1");
        let rates: Vec<_> = lost.iter().map(|percent| -(1.0 - percent / 100.0).ln()).collect();
        for pair in rates.windows(2) {
            assert_all_near("ratio of the decay rates", &[4.0], &[pair[0] / pair[1]], 0.4);
        }
    }

    #[test]
    fn passes_do_not_reduce_the_loss() {
        let lost = pendulum().numbers("passes");
        assert_all_near("passes", &[lost[0]; 4], &lost, 0.01);
        let kept = rotor().numbers("passes_%");
        assert_all_near("passes", &[kept[0]; 4], &kept, 0.01);
    }

    #[test]
    fn the_balance_without_loss_keeps_the_energy() {
        assert_all_near("h = 0", &[0.0], &[lost_by_balance(1.0, 0.0)], 1e-9);
    }
}
