//! Bends against beam theory: the deflection of cantilevers, the energy of a cylinder, the overhang by
//! which Peirce measures cloth, and the invariants of free bodies.

mod blocks;
mod hinges;

use sim_solver::{Bend, ConstraintKind, ParameterValue, Reason, Solver};

use super::{
    assert_at_most, assert_close, assert_near, particles, position, solver, step, stepped,
};

/// A rope of `cells` free parts, level, with two fixed particles as its clamp. Without a unit: m, kg, N m^2.
struct Cantilever {
    cells: u32,
    length: f64,
    mass: f64,
    gravity: f64,
    rigidity: f64,
    substeps_hz: f64,
}

impl Cantilever {
    fn spacing(&self) -> f64 {
        self.length / f64::from(self.cells)
    }

    /// Rigidity with which the law of an ideal cantilever bends by `share` of its length at the tip.
    fn rigidity_for(&self, share: f64) -> f64 {
        let unit = Self { rigidity: 1.0, ..*self };
        unit.law_of_tip(1.0) / (share * self.length)
    }

    /// Deflection of the tip by the discrete law, where `softening` multiplies 1/EI:
    /// `y_(i+1)` = 2 `y_i` - `y_(i-1)` + s^2 M / EI with M = sum of m g (j - i) s over the particles beyond.
    fn law_of_tip(&self, softening: f64) -> f64 {
        let s = self.spacing();
        let (mut before, mut y) = (0.0, 0.0);
        for i in 0..self.cells {
            let beyond = f64::from(self.cells - i);
            let moment = self.mass * self.gravity * s * beyond * (beyond + 1.0) / 2.0;
            (before, y) = (y, 2.0 * y - before + s * s * moment * softening / self.rigidity);
        }
        y
    }

    /// Factor of the deflection that a substep of a single pass adds: 1 + k h^2 / (m alpha), where k is
    /// the mean of the factors of the cells, weighted by their part in the deflection.
    ///
    /// A bend ends a substep with C = -(alpha / h^2) Lambda only until bends of later groups move its
    /// particles: each adds w (sum of c c' over common free particles) Lambda'. In equilibrium the
    /// multipliers are those of the moments, Lambda = h^2 M / s.
    fn softening(&self, k: f64) -> f64 {
        let alpha = self.spacing().powi(3) / self.rigidity;
        1.0 + k / (self.substeps_hz.powi(2) * self.mass * alpha)
    }

    fn mean_factor(&self) -> f64 {
        let cells = i64::from(self.cells);
        let moment = |i: i64| ((cells - i) * (cells - i + 1)) as f64;
        let common = |i: i64, j: i64| {
            let free = (i.max(j).max(2)..=i.min(j) + 2)
                .map(|p| [i, j].map(|one| [1, -2, 1][usize::try_from(p - one).unwrap()]));
            free.map(|[c, other]| c * other).sum::<i64>() as f64
        };
        let (mut sum, mut weights) = (0.0, 0.0);
        for i in 0..cells {
            let later = (0.max(i - 2)..cells.min(i + 3)).filter(|j| j % 3 > i % 3);
            let moved: f64 = later.map(|j| -common(i, j) * moment(j)).sum();
            let arm = (cells - i) as f64;
            (sum, weights) = (sum + moved * arm, weights + moment(i) * arm);
        }
        sum / weights
    }

    /// The solver after `seconds`, with the damping 2 w of its lowest frequency w, which is critical.
    fn settled(&self, seconds: f64) -> Solver {
        let s = self.spacing();
        let frequency = 3.516 * (self.rigidity * s / (self.mass * self.length.powi(4))).sqrt();
        let (rate, substeps) = (self.substeps_hz / 16.0, 16);
        let text = format!(
            "gravity = [0, -{}, 0]\n[solver]\nrate_hz = {}\nsubsteps = {substeps}\ndamping = {}\n\
             [[generate]]\nshape = \"rope\"\ncount = {}\nfrom = [{}, 0, 0]\nto = [{}, 0, 0]\n\
             pinned = [0, 1]\nmass = {}\nbending = {}\n",
            self.gravity,
            rate.round(),
            2.0 * frequency,
            self.cells + 2,
            -s,
            self.length,
            self.mass,
            self.rigidity
        );
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
        stepped(&text, (seconds * rate) as u32)
    }

    fn tip(&self, seconds: f64) -> f64 {
        -position(&self.settled(seconds), self.cells as usize + 1)[1]
    }
}

/// In weak gravity, so that a rigidity that few substeps reach bends it by little.
fn cantilever(cells: u32, substeps_hz: f64) -> Cantilever {
    let cantilever = Cantilever {
        cells,
        length: 0.5,
        mass: 0.1 / f64::from(cells),
        gravity: 0.1,
        rigidity: 0.0,
        substeps_hz,
    };
    Cantilever { rigidity: cantilever.rigidity_for(0.02), ..cantilever }
}

#[test]
fn a_cantilever_bends_by_the_discrete_law_of_its_cells() {
    for (cells, substeps_hz) in [(5, 4800.0), (10, 14_400.0), (20, 38_400.0)] {
        let cantilever = cantilever(cells, substeps_hz);
        let stiffness = cantilever.rigidity * substeps_hz.powi(-2)
            / (cantilever.mass * cantilever.spacing().powi(3));
        assert_at_most("B h^2 / (rho s^4)", 0.005, stiffness);
        let expected = cantilever.law_of_tip(1.0);
        assert_close(&format!("tip of {cells} cells"), expected, cantilever.tip(8.0), 0.01);
    }
}

#[test]
fn few_substeps_reach_less_rigidity_by_the_order_of_the_groups() {
    for cells in [5, 8, 10, 20] {
        let cantilever = cantilever(cells, 960.0);
        let k = cantilever.mean_factor();
        for share in [0.3, 1.0, 3.0] {
            // With this rigidity the solver is softer by the share.
            let rigidity =
                share * 960.0_f64.powi(2) * cantilever.mass * cantilever.spacing().powi(3) / k;
            let gravity = cantilever.gravity * rigidity / cantilever.rigidity / (1.0 + share);
            let cantilever = Cantilever { gravity, rigidity, ..cantilever };
            let expected = cantilever.law_of_tip(cantilever.softening(k));
            let name = format!("tip of {cells} cells, k = {k:.2}, softer by {share}");
            assert_close(&name, expected, cantilever.tip(20.0), 0.03);
            // The rule of thumb for eight cells.
            if cells == 8 {
                assert_close("k of 8 cells", 1.8, k, 0.01);
            }
        }
    }
}

/// A strip whose bending length (B / rho g)^(1/3) is half of its overhang has a chord of 41.5 degrees.
/// The error is of first order in the number of cells.
#[test]
fn an_overhang_of_two_bending_lengths_hangs_at_the_angle_of_peirce() {
    let angle = |cells: u32| {
        let (length, gravity, density) = (0.2_f64, 9.81, 0.1);
        let strip = Cantilever {
            cells,
            length,
            mass: density * length / f64::from(cells),
            gravity,
            rigidity: density * gravity * (length / 2.0).powi(3),
            substeps_hz: 38_400.0,
        };
        let [x, y, _] = position(&strip.settled(3.0), cells as usize + 1);
        (-y).atan2(x).to_degrees()
    };
    let (coarse, fine) = (angle(10), angle(20));
    println!("10 cells: {coarse}, 20 cells: {fine}");
    assert_near("angle in degrees", 41.5, 2.0 * fine - coarse, 1.0);
}

/// Energy of a bend: |C|^2 / (2 alpha).
fn energy(bend: &Bend, at: impl Fn(u32) -> [f64; 3]) -> f64 {
    let value = [0, 1, 2].map(|axis| {
        let terms = bend.particles.iter().zip(bend.coefficients);
        terms.map(|(index, c)| f64::from(c) * at(*index)[axis]).sum::<f64>()
    });
    let square: f64 = value.iter().map(|one| one * one).sum();
    square * f64::from(bend.rigidity) / (2.0 * f64::from(bend.geometry))
}

/// A sheet of 20 x 15 particles and its energies on a cylinder of radius 1 m whose axis is turned by an
/// angle: of bends across, down, and of twists, each divided by the area that it covers, in units of
/// B / (2 R^2).
fn energies_on_cylinder(degrees: f64, right: f64) -> [f64; 3] {
    let (columns, rows, s, rigidity) = (20_u32, 15_u32, 0.01, 0.3);
    let solver = solver(&format!(
        "[[generate]]\nshape = \"cloth\"\ncolumns = {columns}\nrows = {rows}\nspacing = {s}\n\
         right = [{right}, 0, 0]\nbending = {rigidity}\n"
    ));
    let (sin, cos) = degrees.to_radians().sin_cos();
    let at = |index: u32| {
        let u = f64::from(index % columns) * s * right;
        let v = f64::from(index / columns) * s;
        let along = u * cos + v * sin;
        [along.sin(), v * cos - u * sin, along.cos()]
    };
    let mut sums = [0.0; 3];
    for bend in solver.bends() {
        let [a, b, _, d] = bend.particles;
        let family = if d == b { usize::from(b - a == columns) } else { 2 };
        sums[family] += energy(&bend, at);
    }
    let cell = s * s * right;
    let (wide, high) = (f64::from(columns - 1), f64::from(rows - 1));
    let areas = [(wide - 1.0) * high, wide * (high - 1.0), wide * high];
    [0, 1, 2].map(|family| sums[family] / (areas[family] * cell * rigidity / 2.0))
}

#[test]
fn a_cylinder_has_the_same_energy_in_every_direction() {
    for right in [1.0, 0.6] {
        for degrees in [0.0, 15.0, 30.0, 45.0, 70.0, 90.0] {
            let [across, down, twist] = energies_on_cylinder(degrees, right);
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let name = format!("{degrees} degrees, cells {right} wide");
            assert_near(&name, 1.0, across + down + twist, 1e-3);
            assert_near("bends across", cos.powi(4), across, 1e-3);
            assert_near("bends down", sin.powi(4), down, 1e-3);
        }
    }
}

/// A free strip, bent, in which every particle has another mass and velocity.
fn free_strip(rigidity: f64, extra: &str) -> String {
    let mut text = format!("gravity = [0, 0, 0]\n[solver]\n{extra}\n");
    for index in 0..12 {
        let (x, angle) = (f64::from(index), f64::from(index) * 0.7);
        text += &format!(
            "[[particle]]\nposition = [{}, {}, {}]\nmass = {}\nvelocity = [{}, {}, {}]\n",
            0.1 * x,
            0.02 * x * x * 0.1,
            0.03 * angle.sin(),
            0.1 + 0.01 * x,
            angle.sin(),
            angle.cos(),
            0.2 * x.cos()
        );
    }
    for index in 0..10 {
        let line = [index, index + 1, index + 2];
        text += &format!("[[bend]]\nparticles = {line:?}\nrigidity = {rigidity}\n");
    }
    for index in 0..9 {
        let cell = [index, index + 1, index + 2, index + 3];
        text += &format!("[[bend]]\nparticles = {cell:?}\nrigidity = {rigidity}\n");
    }
    text
}

/// Momentum, and angular momentum about the origin.
fn momenta(solver: &Solver) -> [[f64; 3]; 2] {
    let mut sums = [[0.0; 3]; 2];
    for particle in particles(solver) {
        let mass = 1.0 / f64::from(particle.inverse_mass);
        let (x, v) = (particle.position.map(f64::from), particle.velocity.map(f64::from));
        for axis in 0..3 {
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            sums[0][axis] += mass * v[axis];
            sums[1][axis] += mass * (x[next] * v[last] - x[last] * v[next]);
        }
    }
    sums
}

#[test]
fn bends_do_not_change_the_momentum() {
    for (rigidity, iterations) in [(1e-3, 1), (1.0, 3), (1e6, 1)] {
        let mut solver = solver(&free_strip(rigidity, &format!("iterations = {iterations}")));
        let [before, _] = momenta(&solver);
        step(&mut solver, 240);
        let [after, _] = momenta(&solver);
        for axis in 0..3 {
            assert_near("momentum", before[axis], after[axis], 3e-6);
        }
    }
}

/// From rest, the multiplier lies along C at the start of the substep, so that no torque acts. In motion
/// the two differ by the way of a substep, as they do in a distance constraint.
#[test]
fn a_bend_that_is_released_changes_neither_momentum_nor_angular_momentum() {
    let cell = "gravity = [0, 0, 0]\n[[particle]]\nposition = [0, 0, 0.3]\n\
         [[particle]]\nposition = [1, 0.1, 0]\nmass = 2\n[[particle]]\nposition = [0, 1, 0.2]\n\
         mass = 5\n[[particle]]\nposition = [1, 1, 0]\n[[bend]]\nparticles = [0, 1, 2, 3]\n\
         rigidity = 1e4\n";
    let line = CORNER
        .replace("rigidity = 10", "rigidity = 1e4")
        .replace("[1, 1, 0]", "[1, 1, 0.5]\nmass = 3");
    for text in [cell, &line] {
        let one_substep = "gravity = [0, 0, 0]\n[solver]\nsubsteps = 1\n";
        let solver = stepped(&text.replace("gravity = [0, 0, 0]\n", one_substep), 1);
        assert!(!is_at_rest(&solver));
        for (name, sum) in ["momentum", "angular momentum"].into_iter().zip(momenta(&solver)) {
            for along in sum {
                assert_near(name, 0.0, along, 1e-5);
            }
        }
    }
}

/// Kinetic energy and that of the bends, in J.
fn total_energy(solver: &Solver) -> f64 {
    let kinetic = particles(solver).map(|particle| {
        let speed: f64 = particle.velocity.iter().map(|one| f64::from(*one).powi(2)).sum();
        speed / (2.0 * f64::from(particle.inverse_mass))
    });
    let at = |index: u32| position(solver, index as usize);
    kinetic.sum::<f64>() + solver.bends().map(|bend| energy(&bend, at)).sum::<f64>()
}

#[test]
fn an_undamped_strip_never_gains_energy() {
    for substeps in [1, 4] {
        for exponent in -6..=3 {
            let rigidity = 10.0_f64.powi(exponent);
            let extra = format!("rate_hz = 240\nsubsteps = {substeps}");
            let mut solver = solver(&free_strip(rigidity, &extra));
            let start = total_energy(&solver);
            let mut most: f64 = 0.0;
            for _ in 0..480 {
                solver.step();
                most = most.max(total_energy(&solver));
            }
            let name = format!("energy, rigidity {rigidity}, {substeps} substeps");
            assert_at_most(&name, start * (1.0 + 1e-4), most);
        }
    }
}

#[test]
fn more_passes_and_the_other_method_have_the_same_rigidity() {
    let tip = |extra: &str| {
        let text = format!(
            "gravity = [0, -0.1, 0]\n[solver]\nrate_hz = 960\nsubsteps = 8\ndamping = 8\n{extra}\n\
             [[generate]]\nshape = \"rope\"\ncount = 7\nfrom = [-0.1, 0, 0]\nto = [0.5, 0, 0]\n\
             pinned = [0, 1]\nmass = 0.02\nbending = 0.08\n"
        );
        -position(&stepped(&text, 6000), 6)[1]
    };
    let expected = tip("");
    for extra in ["iterations = 4", "method = \"pbd\""] {
        assert_close(extra, expected, tip(extra), 0.01);
    }
}

#[test]
fn a_new_rigidity_has_its_own_deflection_until_a_reset() {
    let cantilever = Cantilever { rigidity: 0.05, ..cantilever(5, 4800.0) };
    let mut solver = cantilever.settled(8.0);
    let tip = |solver: &Solver| -position(solver, 6)[1];
    assert_close("tip", cantilever.law_of_tip(1.0), tip(&solver), 0.01);
    solver.set("bending", ParameterValue::Number(0.025), None).unwrap();
    assert_eq!(solver.parameter_values().bending(None), Some(0.025));
    step(&mut solver, 300 * 8);
    assert_close("softer", 2.0 * cantilever.law_of_tip(1.0), tip(&solver), 0.01);
    solver.reset();
    assert_eq!(solver.parameter_values().bending(None), None);
    step(&mut solver, 300 * 8);
    assert_close("after a reset", cantilever.law_of_tip(1.0), tip(&solver), 0.01);
}

#[test]
fn a_rigidity_is_refused_without_bends_and_below_zero() {
    let mut bent = solver(CORNER);
    let set = |solver: &mut Solver, value| solver.set("bending", value, None);
    for wrong in [ParameterValue::Number(-1.0), ParameterValue::Off] {
        assert_eq!(set(&mut bent, wrong), Err(Reason::OutOfRange));
    }
    let kind = Some(ConstraintKind::Bend);
    let of_kind = bent.set("bending", ParameterValue::Number(1.0), kind);
    assert_eq!(of_kind, Err(Reason::OutOfRange));
    let mut straight = solver("[[particle]]\nposition = [0, 0, 0]\n");
    assert_eq!(set(&mut straight, ParameterValue::Number(1.0)), Err(Reason::NoEffectHere));
}

/// Three particles at a right angle, which their bend straightens.
const CORNER: &str = "gravity = [0, 0, 0]\n[[particle]]\nposition = [0, 0, 0]\n\
     [[particle]]\nposition = [1, 0, 0]\n[[particle]]\nposition = [1, 1, 0]\n\
     [[constraint]]\nparticles = [1, 0]\n[[constraint]]\nparticles = [1, 2]\n\
     [[bend]]\nparticles = [0, 1, 2]\nrigidity = 10\n";

fn is_at_rest(solver: &Solver) -> bool {
    particles(solver).all(|particle| particle.velocity == [0.0; 3])
}

#[test]
fn a_bend_stops_when_a_constraint_of_its_path_is_cut_and_acts_again_after_a_reset() {
    for constraint in [0, 1] {
        let mut solver = solver(CORNER);
        solver.cut(constraint).unwrap();
        step(&mut solver, 10);
        assert!(is_at_rest(&solver), "constraint {constraint}");
        solver.reset();
        step(&mut solver, 10);
        assert!(!is_at_rest(&solver));
    }
}

#[test]
fn a_bend_stops_at_the_end_of_the_step_in_which_its_path_tears() {
    // The first constraint is 10 % longer than at rest, and tears in the first step.
    let text = CORNER.replacen(
        "particles = [1, 0]\n",
        "particles = [1, 0]\nrest_length = 0.9\ntear_stretch = 1.05\n",
        1,
    );
    let mut solver = stepped(&text, 1);
    assert_eq!(solver.torn(), [0]);
    // The particle that is free now moves on in a straight line.
    let velocity = solver.particle(0).velocity;
    assert!(velocity[1] != 0.0);
    step(&mut solver, 20);
    assert_eq!(solver.particle(0).velocity, velocity);
}

#[test]
fn all_bends_of_a_cell_and_its_lines_stop_when_a_side_is_cut() {
    let text = "gravity = [0, 0, 0]\n[[generate]]\nshape = \"cloth\"\ncolumns = 2\nrows = 2\n\
         spacing = 1\nbending = 1e6\nlinks = [\"structural\"]\npinned = \"none\"\n";
    for side in 0..4 {
        let mut solver = solver(text);
        solver.cut(side).unwrap();
        // Out of the plane, the twist pulls the particle back, and the sides pull it towards neighbours.
        let mut start = particles(&solver).collect::<Vec<_>>();
        start[3].position[2] = 1e-3;
        solver.restore(&start, &solver.keyframe()).unwrap();
        let torn = solver.torn().to_vec();
        assert_eq!(torn, [side]);
        step(&mut solver, 1);
        let pulled = particles(&solver).filter(|one| one.velocity[2].abs() > 1e-4).count();
        assert_eq!(pulled, 0, "side {side}");
    }
    let mut whole = solver(text);
    let mut start = particles(&whole).collect::<Vec<_>>();
    start[3].position[2] = 1e-3;
    whole.restore(&start, &whole.keyframe()).unwrap();
    step(&mut whole, 1);
    assert!(particles(&whole).all(|one| one.velocity[2].abs() > 1e-3));
}

#[test]
fn a_particle_that_blows_up_does_not_move_the_others_of_its_bend() {
    let mut solver = solver(CORNER);
    let mut start = particles(&solver).collect::<Vec<_>>();
    start[0].velocity = [f32::MAX, f32::MAX, 0.0];
    start[0].position = [f32::MAX, 0.0, 0.0];
    start[2].position = [1.0, 0.0, 1.0];
    solver.restore(&start, &solver.keyframe()).unwrap();
    step(&mut solver, 1);
    let others = [1, 2].map(|index| solver.particle(index));
    assert!(others.iter().flat_map(|one| one.position).all(f32::is_finite));
}

#[test]
fn fixed_particles_of_a_bend_stay_bit_for_bit() {
    let text = CORNER.replace("position = [1, 0, 0]\n", "position = [1, 0, 0]\npinned = true\n");
    let solver = stepped(&text, 50);
    assert_eq!(solver.particle(1).position, [1.0, 0.0, 0.0]);
    let all = CORNER.replace("0]\n[[part", "0]\npinned = true\n[[part");
    let all = all.replace("[1, 1, 0]\n", "[1, 1, 0]\npinned = true\n");
    let all = all.replacen("0]\npinned = true\n", "0]\n", 1);
    assert_eq!(super::bits(&stepped(&all, 5)), super::bits(&super::solver(&all)));
}

#[test]
fn a_rigidity_of_zero_bends_freely() {
    let text = CORNER.replace("rigidity = 10", "rigidity = 0");
    assert!(is_at_rest(&stepped(&text, 10)));
}

/// Neighbours at different distances: at rest on a straight line, and with the deflection of a beam.
#[test]
fn an_explicit_bend_weighs_its_parts_by_their_lengths() {
    let straight = "gravity = [0, 0, 0]\n[[particle]]\nposition = [0, 0, 0]\n[[particle]]\n\
         position = [0.25, 0.25, 0]\n[[particle]]\nposition = [0.75, 0.75, 0]\n\
         [[bend]]\nparticles = [0, 1, 2]\nrigidity = 10\n";
    assert!(is_at_rest(&stepped(straight, 100)));
    // A clamp of 0.1 m and a free part of 0.3 m with a mass at its end: C = s (a - b) / l_1 + s y / l_2.
    let text = "gravity = [0, -0.1, 0]\n[solver]\nrate_hz = 480\nsubsteps = 16\ndamping = 10\n\
         [[particle]]\nposition = [-0.1, 0, 0]\npinned = true\n[[particle]]\n\
         position = [0, 0, 0]\npinned = true\n[[particle]]\nposition = [0.3, 0, 0]\nmass = 0.1\n\
         [[constraint]]\nparticles = [1, 2]\n[[bend]]\nparticles = [0, 1, 2]\nrigidity = 0.02\n";
    // M = m g l_2, and C = s^2 M / EI = s y / l_2 with s = (l_1 + l_2) / 2.
    let (mean, free, moment) = (0.2, 0.3, 0.1 * 0.1 * 0.3);
    let expected = mean * free * moment / 0.02;
    assert_close("deflection", expected, -position(&stepped(text, 4800), 2)[1], 0.01);
}
