//! Hinges of meshes: their energy on a cylinder, cantilevers, curved shapes at rest, and the invariants.

use sim_solver::{Bend, BendShape, ParameterValue, Solver};

use super::{energy, momenta};
use crate::physics::{
    assert_at_most, assert_close, assert_near, particles, position, solver, step,
};

/// A mesh of triangles.
#[derive(Clone)]
struct Triangles {
    vertices: Vec<[f64; 3]>,
    faces: Vec<[usize; 3]>,
}

/// Arrangement of the triangles in a sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Pattern {
    /// Cells with one diagonal, all in the same direction.
    Right,
    /// The directions of the diagonals alternate.
    Alternating,
    Equilateral,
    /// Equilateral, with each vertex moved by up to a third of the spacing.
    Irregular,
}

impl Triangles {
    /// A sheet in the plane z = 0, from the origin along x and y, with cells of size `s`.
    fn sheet(columns: usize, rows: usize, s: f64, pattern: Pattern) -> Self {
        let mut mesh = Self { vertices: Vec::new(), faces: Vec::new() };
        let is_slanted = matches!(pattern, Pattern::Equilateral | Pattern::Irregular);
        for row in 0..rows {
            for column in 0..columns {
                let shift = if is_slanted && row % 2 == 1 { 0.5 } else { 0.0 };
                let height = if is_slanted { 0.75_f64.sqrt() } else { 1.0 };
                let [dx, dy] =
                    if pattern == Pattern::Irregular { noise(row, column) } else { [0.0; 2] };
                let (x, y) = (column as f64 + shift + dx, row as f64 * height + dy);
                mesh.vertices.push([s * x, s * y, 0.0]);
            }
        }
        for row in 1..rows {
            for column in 1..columns {
                let d = row * columns + column;
                let [a, b, c] = [d - columns - 1, d - columns, d - 1];
                let is_rising = match pattern {
                    Pattern::Right => true,
                    Pattern::Alternating => (row + column) % 2 == 0,
                    Pattern::Equilateral | Pattern::Irregular => row % 2 == 0,
                };
                let two = if is_rising { [[a, b, d], [a, d, c]] } else { [[a, b, c], [b, d, c]] };
                mesh.faces.extend(two);
            }
        }
        mesh
    }

    /// The mesh with every vertex moved.
    fn mapped(&self, map: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        let vertices = self.vertices.iter().map(|vertex| map(*vertex)).collect();
        Self { vertices, faces: self.faces.clone() }
    }

    /// A table `[[generate]]` with the mesh.
    fn generate(&self, keys: &str) -> String {
        let Self { vertices, faces } = self;
        format!(
            "[[generate]]\nshape = \"obj\"\nvertices = {vertices:?}\nfaces = {faces:?}\n{keys}\n"
        )
    }
}

/// Up to a third in each direction, by a fixed rule.
fn noise(row: usize, column: usize) -> [f64; 2] {
    let hash = |seed: usize| {
        let mixed = (row * 7919 + column * 104_729 + seed).wrapping_mul(2_654_435_761) >> 7;
        (mixed % 1000) as f64 / 1500.0 - 1.0 / 3.0
    };
    [hash(1), hash(77)]
}

/// A cylinder of radius 1 m whose axis is turned by an angle.
fn on_cylinder(degrees: f64) -> impl Fn([f64; 3]) -> [f64; 3] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    move |[x, y, _]| {
        let (along, across) = (x * cos + y * sin, y * cos - x * sin);
        [along.sin(), across, along.cos()]
    }
}

fn area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let [u, v] = [b, c].map(|end| [0, 1, 2].map(|axis| end[axis] - a[axis]));
    let cross = [0, 1, 2].map(|axis| {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        u[next] * v[last] - u[last] * v[next]
    });
    cross.iter().map(|axis| axis * axis).sum::<f64>().sqrt() / 2.0
}

/// Energy of the hinges away from the border, on a cylinder, in units of B / (2 R^2) and of their area.
fn energy_on_cylinder(mesh: &Triangles, degrees: f64) -> f64 {
    let solver = solver(&mesh.generate("bending = 0.3"));
    let bent = mesh.mapped(on_cylinder(degrees));
    let size = mesh
        .vertices
        .iter()
        .fold([0.0_f64; 2], |size, [x, y, _]| [size[0].max(*x), size[1].max(*y)]);
    let is_inside = |index: &u32| {
        let [x, y, _] = mesh.vertices[*index as usize];
        [x / size[0], y / size[1]].iter().all(|share| (0.15..0.85).contains(share))
    };
    let (mut sum, mut covered) = (0.0, 0.0);
    for bend in solver.bends().filter(|bend| bend.particles.iter().all(is_inside)) {
        let [a, p, q, d] = bend.particles.map(|index| mesh.vertices[index as usize]);
        sum += energy(&bend, |index| bent.vertices[index as usize]);
        // A triangle has three edges.
        covered += (area([a, p, q]) + area([d, p, q])) / 3.0;
    }
    sum / (covered * 0.3 / 2.0)
}

/// By the jump of the slope at each kind of edge, on a surface of the curvatures `w_xx`, `w_yy` and `w_xy`.
#[test]
fn hinges_have_the_energy_of_their_triangles_on_a_cylinder() {
    let sheet = |pattern| Triangles::sheet(60, 60, 0.004, pattern);
    let [right, equilateral, irregular] =
        [Pattern::Right, Pattern::Equilateral, Pattern::Irregular].map(sheet);
    for degrees in [0.0, 15.0, 45.0, 70.0, 90.0, 135.0] {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let (xx, yy, xy) = (cos * cos, sin * sin, sin * cos);
        let law = (xx + xy).powi(2) + (yy + xy).powi(2) + 4.0 * xy * xy;
        let name = |pattern: &str| format!("{pattern}, {degrees} degrees");
        assert_close(&name("right"), law, energy_on_cylinder(&right, degrees), 0.02);
        assert_close(&name("equilateral"), 1.0, energy_on_cylinder(&equilateral, degrees), 0.01);
        assert_close(&name("irregular"), 1.0, energy_on_cylinder(&irregular, degrees), 0.2);
    }
}

/// A strip that is clamped at its first two columns and bends under its weight, out of its plane.
struct Strip {
    pattern: Pattern,
    cells: usize,
    rows: usize,
    /// Rate of steps of 16 substeps.
    rate_hz: u32,
}

impl Strip {
    const LENGTH: f64 = 0.5;
    const GRAVITY: f64 = 0.1;
    const DENSITY: f64 = 1.0;
    const RIGIDITY: f64 = 0.08;

    fn spacing(&self) -> f64 {
        Self::LENGTH / self.cells as f64
    }

    /// Deflection of the tip as that of a rope of the cells, where `share` multiplies B:
    /// `y_(i+1)` = 2 `y_i` - `y_(i-1)` + s^2 M / B, for each unit of width.
    fn law_of_tip(&self, share: f64) -> f64 {
        let s = self.spacing();
        let weight = Self::DENSITY * Self::GRAVITY * s;
        let (mut before, mut y) = (0.0, 0.0);
        for i in 0..self.cells {
            let beyond = (self.cells - i) as f64;
            // The last column has half of the weight of the others.
            let moment = weight * s * (beyond * (beyond + 1.0) - beyond) / 2.0;
            (before, y) = (y, 2.0 * y - before + s * s * moment / (share * Self::RIGIDITY));
        }
        y
    }

    fn settled(&self) -> Solver {
        let s = self.spacing();
        let mesh = Triangles::sheet(self.cells + 2, self.rows, s, self.pattern);
        let frequency = 3.516 * (Self::RIGIDITY / Self::DENSITY / Self::LENGTH.powi(4)).sqrt();
        let keys = format!(
            "bending = {}\ndensity = {}\npinned = \"x < {}\"",
            Self::RIGIDITY,
            Self::DENSITY,
            1.6 * s
        );
        let mut solver = solver(&format!(
            "gravity = [0, 0, -{}]\n[solver]\nrate_hz = {}\nsubsteps = 16\ndamping = {}\n{}",
            Self::GRAVITY,
            self.rate_hz,
            2.0 * frequency,
            mesh.generate(&keys)
        ));
        step(&mut solver, 6 * self.rate_hz);
        solver
    }

    /// Mean deflection of the last column.
    fn tip(&self) -> f64 {
        let solver = self.settled();
        let last = (1..=self.rows).map(|row| row * (self.cells + 2) - 1);
        -last.map(|index| position(&solver, index)[2]).sum::<f64>() / self.rows as f64
    }
}

/// A narrow strip with one diagonal also twists, by -1/5 of its curvature, and bends across by 1/5: that is where
/// the energy of its hinges is least, at 4/5 of that of a cylinder.
#[test]
fn strips_of_meshes_bend_as_beams() {
    let strip = |pattern| Strip { pattern, cells: 16, rows: 3, rate_hz: 600 };
    let right = strip(Pattern::Right);
    assert_close("one diagonal", right.law_of_tip(0.8), right.tip(), 0.04);
    for pattern in [Pattern::Alternating, Pattern::Equilateral, Pattern::Irregular] {
        let strip = strip(pattern);
        assert_close(&format!("{pattern:?}"), strip.law_of_tip(1.0), strip.tip(), 0.2);
    }
}

/// The multipliers of an evenly bent surface are equal and its forces cancel, so that each bend loses half of
/// what it moves to the bends after it. Near the clamp it loses less.
#[test]
fn few_substeps_reach_less_of_the_rigidity_of_a_mesh() {
    for pattern in [Pattern::Right, Pattern::Alternating, Pattern::Equilateral, Pattern::Irregular]
    {
        let strip = |rate_hz| Strip { pattern, cells: 12, rows: 5, rate_hz };
        let settled = strip(600).settled();
        let (mut geometry, mut weights) = (0.0, 0.0);
        for bend in settled.bends() {
            geometry += f64::from(bend.geometry);
            for (index, c) in bend.particles.into_iter().zip(bend.coefficients) {
                let w = f64::from(settled.particle(index as usize).inverse_mass);
                weights += w * f64::from(c * c) / 2.0;
            }
        }
        let tip = strip(600).tip();
        for rate_hz in [30, 60] {
            let softening = weights * Strip::RIGIDITY / geometry / f64::from(16 * rate_hz).powi(2);
            let found = strip(rate_hz).tip() / tip - 1.0;
            let name = format!("{pattern:?}, share of the law at 16 x {rate_hz}/s");
            assert_near(&name, 0.8, found / softening, 0.25);
        }
    }
}

/// A half of a tube of radius 0.2 m, with its axis along y.
fn shell(pattern: Pattern, keys: &str) -> String {
    let sheet = Triangles::sheet(14, 9, 0.05, pattern);
    let tube = sheet.mapped(|[x, y, _]| [0.2 * (x / 0.2).sin(), y, 0.2 * (x / 0.2).cos()]);
    tube.generate(&format!("density = 0.3\n{keys}"))
}

/// Largest distance of a particle from its position at load.
fn largest_displacement(before: &Solver, after: &Solver) -> f64 {
    let distance = |index: usize| {
        let (a, b) = (position(before, index), position(after, index));
        (0..3).map(|axis| (b[axis] - a[axis]).powi(2)).sum::<f64>().sqrt()
    };
    (0..before.particle_count()).map(distance).fold(0.0, f64::max)
}

#[test]
fn a_curved_shell_keeps_the_shape_in_which_it_was_loaded() {
    for pattern in [Pattern::Right, Pattern::Irregular] {
        let displacement = |rest: &str| {
            let text = format!("gravity = [0, 0, 0]\n{}", shell(pattern, rest));
            let mut shell = solver(&text);
            let start = shell.clone();
            step(&mut shell, 480);
            largest_displacement(&start, &shell)
        };
        let loaded = displacement("bending = 0.1\nrest = \"loaded\"");
        assert_at_most("displacement of a loaded shell", 1e-5, loaded);
        assert!(displacement("bending = 0.1\nrest = \"flat\"") > 0.05, "a flat shell unrolls");
    }
}

#[test]
fn a_deformed_shell_returns_to_its_rest_shape() {
    let text = format!(
        "gravity = [0, 0, 0]\n[solver]\nsubsteps = 8\ndamping = 3\n{}",
        shell(
            Pattern::Irregular,
            "bending = 0.003\nrest = \"loaded\"\npinned = \"x < 0.03 and z > 0\""
        )
    );
    let mut shell = solver(&text);
    let start = shell.clone();
    shell.set("gravity", ParameterValue::Vector([0.0, -1.0, -3.0]), None).unwrap();
    step(&mut shell, 480);
    assert!(largest_displacement(&start, &shell) > 0.1, "the shell bends under its weight");
    shell.set("gravity", ParameterValue::Vector([0.0; 3]), None).unwrap();
    step(&mut shell, 240 * 20);
    assert_at_most("distance from its shape", 1e-3, largest_displacement(&start, &shell));
}

/// A free shell in which every particle has another velocity.
fn shaken_shell(rigidity: f64, rest: &str, substeps: u32) -> Solver {
    let text = format!(
        "gravity = [0, 0, 0]\n[solver]\nsubsteps = {substeps}\n{}",
        shell(Pattern::Irregular, &format!("bending = {rigidity:e}\nrest = \"{rest}\""))
    );
    let mut shell = solver(&text);
    let mut states: Vec<_> = particles(&shell).collect();
    for (index, state) in states.iter_mut().enumerate() {
        let angle = 0.9 * index as f32;
        state.velocity = [0.2 * angle.sin(), 0.1 * angle.cos(), 0.3 * (2.0 * angle).sin()];
    }
    shell.restore(&states, &shell.keyframe()).unwrap();
    step(&mut shell, 1);
    shell
}

/// C - rest n / |n|, by the angle of the fold: |e| 2 sin(t / 2), less the rest value.
fn hinge_energy(bend: &Bend, at: impl Fn(u32) -> [f64; 3]) -> f64 {
    let BendShape::Hinge { rest, area_ratio } = bend.shape else { panic!("{bend:?}") };
    let [a, p, q, d] = bend.particles.map(|index| glam::DVec3::from_array(at(index)));
    let first = (q - p).cross(a - p);
    let second = (d - p).cross(q - p);
    let normal = (first + f64::from(area_ratio) * second).normalize_or_zero();
    let terms = bend.particles.iter().zip(bend.coefficients);
    let sum: glam::DVec3 =
        terms.map(|(index, c)| f64::from(c) * glam::DVec3::from_array(at(*index))).sum();
    let value = (sum - f64::from(rest) * normal).length_squared();
    value * f64::from(bend.rigidity) / (2.0 * f64::from(bend.geometry))
}

#[test]
fn an_undamped_shell_keeps_its_momentum_and_never_gains_energy() {
    for rest in ["flat", "loaded"] {
        for exponent in [-6, -4, -2, -1, 0, 1, 3] {
            let mut shell = shaken_shell(10.0_f64.powi(exponent), rest, 4);
            let total = |solver: &Solver| {
                let kinetic = particles(solver).map(|particle| {
                    let speed: f64 = particle.velocity.iter().map(|v| f64::from(*v).powi(2)).sum();
                    speed / (2.0 * f64::from(particle.inverse_mass))
                });
                let at = |index: u32| position(solver, index as usize);
                kinetic.sum::<f64>() + solver.bends().map(|one| hinge_energy(&one, at)).sum::<f64>()
            };
            let ([momentum, _], start) = (momenta(&shell), total(&shell));
            let mut most: f64 = 0.0;
            for _ in 0..480 {
                shell.step();
                most = most.max(total(&shell));
            }
            let [momentum_after, _] = momenta(&shell);
            assert_at_most(&format!("energy, {rest}, 1e{exponent}"), start * (1.0 + 1e-4), most);
            for axis in 0..3 {
                assert_near("momentum", momentum[axis], momentum_after[axis], 1e-6);
            }
        }
    }
}

/// The order of the groups of edges decides: in the order in which they are found, they go around each vertex in a circle,
/// and the sheet gains 35 J in half a second.
#[test]
fn a_rigid_mesh_of_equilateral_triangles_under_pressure_gains_no_energy() {
    for rigidity in [0.01, 6.0] {
        let sheet = Triangles::sheet(22, 11, 0.025, Pattern::Equilateral);
        let keys = format!("bending = {rigidity}\ndensity = 1\npinned = \"y > 0.21\"");
        let text =
            format!("gravity = [0, 9.81, 0]\n[solver]\nsubsteps = 64\n{}", sheet.generate(&keys));
        let mut sheet = solver(&text);
        let mut states: Vec<_> = particles(&sheet).collect();
        for (index, state) in states.iter_mut().enumerate().filter(|(_, one)| one.flags == 0) {
            let angle = 0.9 * index as f32;
            state.velocity = [0.1 * angle.sin(), 0.1 * angle.cos(), 0.1 * (2.0 * angle).sin()];
        }
        sheet.restore(&states, &sheet.keyframe()).unwrap();
        let total = |solver: &Solver| {
            let motion = particles(solver).filter(|one| one.flags == 0).map(|one| {
                let speed: f64 = one.velocity.iter().map(|v| f64::from(*v).powi(2)).sum();
                (speed / 2.0 - 9.81 * f64::from(one.position[1])) / f64::from(one.inverse_mass)
            });
            let at = |index: u32| position(solver, index as usize);
            motion.sum::<f64>() + solver.bends().map(|one| hinge_energy(&one, at)).sum::<f64>()
        };
        let start = total(&sheet);
        let mut most = f64::NEG_INFINITY;
        for _ in 0..120 {
            sheet.step();
            most = most.max(total(&sheet));
        }
        assert_at_most(&format!("energy with {rigidity} N m"), start + 1e-4, most);
    }
}

/// Two triangles, folded by a right angle.
const FOLD: &str = "gravity = [0, 0, 0]\n[[generate]]\nshape = \"obj\"\n\
     vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]\nfaces = [[0, 1, 2], [0, 3, 1]]\n";

#[test]
fn a_hinge_stops_when_any_side_of_its_triangles_is_cut() {
    let text = format!("{FOLD}bending = 1\n");
    let is_at_rest = |solver: &Solver| particles(solver).all(|one| one.velocity == [0.0; 3]);
    for side in 0..5 {
        let mut fold = solver(&text);
        fold.cut(side).unwrap();
        step(&mut fold, 10);
        assert!(is_at_rest(&fold), "side {side}");
        fold.reset();
        step(&mut fold, 10);
        assert!(!is_at_rest(&fold));
    }
    let mut fold = solver(&text);
    fold.set("bending", ParameterValue::Number(0.0), None).unwrap();
    step(&mut fold, 10);
    assert!(is_at_rest(&fold));
    assert_eq!(fold.constraint_count(), 5, "no constraint of the kind \"bend\" beside the hinge");
}

/// C of a fold by the angle t has the size |e| 2 sin(t / 2).
#[test]
fn the_rest_value_of_a_hinge_is_that_of_its_angle() {
    for (height, angle) in [(1.0_f64, 90.0_f64), (0.2, 11.31), (-0.2, -11.31), (-4.0, -75.96)] {
        let text = format!(
            "[[generate]]\nshape = \"obj\"\nvertices = [[0, 0, 0], [2, 0, 0], [0.3, -1, 0], [1, {}, {}]]\n\
             faces = [[0, 1, 3], [2, 1, 0]]\nbending = 1\nrest = \"loaded\"\n",
            if height == 1.0 { 0.0 } else { 1.0 },
            height
        );
        let bend = solver(&text).bends().next().unwrap();
        let BendShape::Hinge { rest, .. } = bend.shape else { panic!("{bend:?}") };
        let size = 2.0 * 2.0 * (angle.to_radians() / 2.0).sin();
        assert_near("size", size.abs(), f64::from(rest).abs(), 1e-3);
        let opposite = size.signum() * f64::from(rest).signum();
        assert_near("sign", -1.0, opposite, 0.0);
    }
}
