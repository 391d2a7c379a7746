//! Forces on colliders, anchors and fixed particles, against weights, Coulomb's law and the balance of
//! momentum.

use glam::{DVec3, Vec3};
use sim_solver::{Forces, Grab, Kernels, ParameterValue, Particle, Pose, Scene, Solver};

use super::{FLOOR, assert_at_most, assert_near, rates, solver, step};

/// A solver that measures forces.
fn measured(text: &str) -> Solver {
    let mut solver = solver(text);
    solver.compute_forces(true);
    solver
}

fn forces(solver: &Solver) -> &Forces {
    solver.forces().unwrap()
}

/// Force on a collider in N at a rate.
fn collider_force(solver: &Solver, rate_hz: u32) -> DVec3 {
    vector(forces(solver).colliders[0].impulse.linear) * f64::from(rate_hz)
}

fn vector(numbers: [f32; 3]) -> DVec3 {
    Vec3::from_array(numbers).as_dvec3()
}

/// Impulse on everything that particles cannot move.
fn total(solver: &Solver) -> DVec3 {
    let Forces { colliders, particles, .. } = forces(solver);
    let colliders = colliders.iter().map(|one| vector(one.impulse.linear));
    colliders.chain(particles.iter().map(|one| vector(one.impulse))).sum()
}

/// Momentum of the free particles, and their mass.
fn momentum(particles: &[Particle]) -> (DVec3, f64) {
    let free = particles.iter().filter(|one| one.inverse_mass > 0.0);
    let masses = free.clone().map(|one| 1.0 / f64::from(one.inverse_mass));
    let moving = free.zip(masses.clone()).map(|(one, mass)| vector(one.velocity) * mass);
    (moving.sum(), masses.sum())
}

#[test]
fn a_hanging_rope_pulls_its_pin_with_its_weight() {
    for rate_hz in [60, 120, 240, 480] {
        for extra in ["", "tethers = true\n"] {
            let text = format!(
                "{}damping = 2\n{extra}[[generate]]\nshape = \"rope\"\ncount = 21\nmass = 0.02\n\
                 from = [0, 2, 0]\nto = [0, 1, 0]\n",
                rates(rate_hz, 4)
            );
            let mut solver = measured(&text);
            step(&mut solver, 20 * rate_hz);
            let [pin] = forces(&solver).particles[..] else { panic!("one pin") };
            let weight = 20.0 * 0.02 * 9.81;
            let force = vector(pin.impulse) * f64::from(rate_hz);
            assert_eq!(pin.particle, 0);
            let name = format!("pull at {rate_hz} Hz {extra:?}");
            assert_near(&name, -weight, force.y, 1e-3 * weight);
            assert_near("across", 0.0, force.x.abs() + force.z.abs(), 1e-3 * weight);
        }
    }
}

/// Equal figures lie side by side in memory: each has its own pin and mass.
#[test]
fn each_of_many_pendulums_pulls_its_pin_with_its_weight() {
    for settings in ["damping = 2\n", "damping = 2\ntethers = 1\n"] {
        let mut text = rates(120, 4) + settings;
        for pendulum in 0..11 {
            let (x, mass) = (f64::from(pendulum), 0.1 + 0.05 * f64::from(pendulum));
            text += &format!(
                "[[particle]]\nposition = [{x}, 1, 0]\npinned = true\n\
                 [[particle]]\nposition = [{x}, 0, 0]\nmass = {mass}\n"
            );
        }
        for pin in (0..22).step_by(2) {
            text += &format!("[[constraint]]\nparticles = [{pin}, {}]\n", pin + 1);
        }
        // A floor that holds nothing but a last, loose particle.
        text += "[[particle]]\nposition = [0, -1.999, 5]\nmass = 0.3\n\
            [[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = -2\n";
        let mut solver = measured(&text);
        step(&mut solver, 2400);
        let pins = &forces(&solver).particles;
        assert_eq!(pins.len(), 11);
        for (pin, one) in (0..).zip(pins) {
            let weight = (0.1 + 0.05 * f64::from(pin)) * 9.81;
            assert_eq!(one.particle, 2 * pin);
            assert_near("pull", -weight, vector(one.impulse).y * 120.0, 1e-3 * weight);
        }
        assert_near("floor", -0.3 * 9.81, collider_force(&solver, 120).y, 1e-2);
    }
}

/// Loose particles lie side by side, too.
#[test]
fn grains_at_rest_weigh_what_they_weigh() {
    let mut text = format!("{}damping = 3\n{FLOOR}friction = 0.5\n", rates(120, 4));
    for grain in 0..21 {
        text += &format!("[[particle]]\nposition = [{grain}, 0.001, 0]\nmass = 0.2\n");
    }
    let mut solver = measured(&text);
    step(&mut solver, 600);
    let weight = 21.0 * 0.2 * 9.81;
    assert_near("weight", -weight, collider_force(&solver, 120).y, 1e-2 * weight);
    let turning = vector(forces(&solver).colliders[0].impulse.angular) * 120.0;
    assert_near("about the origin", -10.0 * weight, turning.z, 1e-2 * weight);
    assert_eq!(forces(&solver).colliders[0].contacts, 21);
}

#[test]
fn a_sheet_at_rest_weighs_what_it_weighs_on_every_shape() {
    let shapes = [
        "shape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\n",
        "shape = \"bounds\"\nmin = [-9, 0, -9]\nmax = [9, 9, 9]\n",
        "shape = \"box\"\ncenter = [0, -0.5, 0]\nhalf_extents = [2, 0.5, 2]\n",
        "shape = \"mesh\"\nvertices = [[-3, 0, -3], [3, 0, -3], [0, 0, 4]]\nfaces = [[0, 2, 1]]\n",
        "shape = \"sphere\"\ncenter = [0, -2, 0]\nradius = 2\nfriction = 1\n",
        "shape = \"capsule\"\na = [-2, -1, 0]\nb = [2, -1, 0]\nradius = 1\nfriction = 1\n",
    ];
    for shape in shapes {
        let text = format!(
            "{}damping = 3\n[[generate]]\nshape = \"cloth\"\ncolumns = 9\nrows = 9\nspacing = 0.05\n\
             origin = [-0.2, 0.01, -0.2]\ndown = [0, 0, 1]\npinned = \"none\"\nmass = 0.01\n\
             [[collider]]\n{shape}",
            rates(120, 4)
        );
        let mut solver = measured(&text);
        step(&mut solver, 600);
        let weight = 81.0 * 0.01 * 9.81;
        let force = collider_force(&solver, 120);
        assert_near(shape, -weight, force.y, 1e-2 * weight);
        assert_eq!(forces(&solver).colliders[0].contacts, 81, "{shape}");
    }
}

#[test]
fn a_slope_feels_the_weight_across_and_the_friction_along() {
    // A particle that slides down a plane of 30 degrees with friction 0.3: m g cos on the plane, 0.3 of it along.
    let text = format!(
        "{}[[particle]]\nposition = [0, 0.001, 0]\nmass = 0.5\n[[collider]]\nshape = \"plane\"\n\
         normal = [0.5, 0.8660254, 0]\noffset = 0\nfriction = 0.3\n",
        rates(240, 8)
    );
    let mut solver = measured(&text);
    step(&mut solver, 240);
    let (force, normal) = (collider_force(&solver, 240), DVec3::new(0.5, 0.866_025_4, 0.0));
    let pressing = 0.5 * 9.81 * 0.866_025_4;
    assert_near("across", -pressing, force.dot(normal), 1e-3 * pressing);
    let down = DVec3::new(0.866_025_4, -0.5, 0.0);
    assert_near("along", 0.3 * pressing, force.dot(down), 1e-3 * pressing);
}

#[test]
fn a_ball_that_is_caught_gives_its_momentum_and_one_that_bounces_twice_that() {
    for (restitution, factor) in [(0, 1.0), (1, 2.0)] {
        let text = format!(
            "gravity = [0, 0, 0]\n{}[[particle]]\nposition = [1, 0.9, 2]\nvelocity = [0, -3, 0]\n\
             mass = 0.25\n{FLOOR}restitution = {restitution}\nfriction = 0\n",
            rates(100, 10)
        );
        let mut solver = measured(&text);
        let (mut linear, mut angular) = (DVec3::ZERO, DVec3::ZERO);
        for _ in 0..60 {
            step(&mut solver, 1);
            let impulse = forces(&solver).colliders[0].impulse;
            linear += vector(impulse.linear);
            angular += vector(impulse.angular);
        }
        let expected = -0.25 * 3.0 * factor;
        assert_near("impulse", expected, linear.y, 1e-6);
        // (1, 0, 2) x (0, -p, 0), about the point of the plane that is nearest to the origin.
        assert_near("about x", -2.0 * expected, angular.x, 1e-5);
        assert_near("about z", expected, angular.z, 1e-5);
    }
}

#[test]
fn an_anchor_feels_the_weight_and_the_moment_of_what_it_carries() {
    // A beam of two particles on an anchor whose origin is 0.3 m beside them, and a rope from one of them.
    let text = format!(
        "{}damping = 2\n[[generate]]\nshape = \"rope\"\ncount = 11\nmass = 0.05\n\
         from = [0.3, 1, 0]\nto = [0.3, 0.5, 0]\npinned = \"none\"\n\
         [[anchor]]\nparticles = [0]\norigin = [0, 1, 0]\n",
        rates(240, 4)
    );
    let mut solver = measured(&text);
    step(&mut solver, 240 * 10);
    let weight = 10.0 * 0.05 * 9.81;
    let anchor = forces(&solver).anchors[0];
    let (force, torque) = (vector(anchor.linear) * 240.0, vector(anchor.angular) * 240.0);
    assert_near("force", -weight, force.y, 1e-3 * weight);
    assert_near("torque", -0.3 * weight, torque.z, 1e-3 * weight);
    // Moved by a client, its center moves along, and the torque stays.
    let translation = [0.0, 0.001, 0.0];
    solver.move_anchor(0, Pose { translation, rotation: [0.0, 0.0, 0.0, 1.0] }).unwrap();
    step(&mut solver, 240 * 10);
    let torque = vector(forces(&solver).anchors[0].angular) * 240.0;
    assert_near("torque of the moved one", -0.3 * weight, torque.z, 1e-3 * weight);
    // Grabbed, the particle pulls at the client's hand and no longer at the anchor.
    solver.grab(1, Grab { particle: 0, target: [0.3, 1.0, 0.0], over_s: 0.1 }).unwrap();
    step(&mut solver, 1);
    assert_eq!(forces(&solver).anchors[0].linear, [0.0; 3]);
    assert_eq!(forces(&solver).particles[0].particle, 0);
}

/// Every kind of constraint, bend, tether, collider and holder at once, without damping and wind. Only the
/// ragdoll touches itself, because contacts between particles are no part of the forces on fixed ones.
const EVERYTHING: &str = "gravity = [0.5, -9.81, 0.2]\n\
    [solver]\nrate_hz = 120\nsubsteps = 5\niterations = 2\nmax_stretch = 1.05\ntethers = 2\n\
    [contact]\nmode = \"particles\"\nthickness = 0.02\n\
    [[generate]]\nshape = \"cloth\"\ncolumns = 19\nrows = 15\nspacing = 0.05\norigin = [-0.4, 1, 0]\n\
    bending = 1e-4\nlinks = [\"structural\", \"shear\", \"bend\"]\nmass = 0.003\ncontact = false\n\
    [[generate]]\nshape = \"rope\"\ncount = 40\nfrom = [-0.5, 1.2, 0.2]\nto = [0.6, 1.1, 0.3]\n\
    bending = 1e-5\nmass = 0.01\ncontact = false\n\
    [[generate]]\nshape = \"web\"\ncenter = [0, 1, -0.5]\nradius = 0.5\nspokes = 40\nrings = 6\ncontact = false\n\
    [[generate]]\nshape = \"ragdoll\"\norigin = [0.1, 1.4, -0.5]\nheight = 0.6\n\
    [[anchor]]\nparticles = [3, 4]\norigin = [0, 1, 0]\n\
    [[anchor.path]]\ntime = 0\n[[anchor.path]]\ntime = 1\ntranslation = [0.3, 0.1, 0]\n\
    [[collider]]\nshape = \"sphere\"\ncenter = [0, 0.8, 0.1]\nradius = 0.15\nvelocity = [0.1, 0.1, -0.1]\n\
    [[collider]]\nshape = \"capsule\"\na = [-0.5, 0.7, 0]\nb = [0.5, 0.7, 0]\nradius = 0.1\nrestitution = 0.5\n\
    [[collider]]\nshape = \"box\"\ncenter = [0.2, 0.5, 0.3]\nhalf_extents = [0.2, 0.1, 0.2]\n\
    [[collider]]\nshape = \"mesh\"\nvertices = [[-2, 0.3, -2], [2, 0.3, -2], [0, 0.2, 3]]\n\
    faces = [[0, 2, 1]]\n";

/// The solver of [`EVERYTHING`] with a grab and a pin, which measures forces.
fn everything(kernels: Kernels, threads: usize) -> Solver {
    let scene = Scene::from_toml(&format!("version = 1\n{EVERYTHING}"), "test").unwrap();
    let mut solver = Solver::with_kernels(&scene, kernels);
    solver.set_threads(threads);
    solver.compute_forces(true);
    solver
}

/// Commands before a step.
fn disturb(solver: &mut Solver, step: u32) {
    match step {
        20 => solver.pin(120).unwrap(),
        30 => {
            let grab = Grab { particle: 200, target: [0.3, 1.0, 0.4], over_s: 0.2 };
            solver.grab(1, grab).unwrap();
        }
        60 => solver.cut(50).unwrap(),
        80 => solver.release(1, 200).unwrap(),
        90 => solver.set("tear_stretch", ParameterValue::Number(1.5), None).unwrap(),
        _ => {}
    }
}

#[test]
fn the_impulses_of_every_step_are_the_change_of_momentum() {
    for kernels in [Kernels::best(), Kernels::Reference] {
        let mut solver = everything(kernels, 1);
        let gravity = DVec3::new(0.5, -9.81, 0.2);
        let (mut touched, mut largest) = ([0; 4], 0.0_f64);
        for number in 0..240 {
            disturb(&mut solver, number);
            let (before, mass) = momentum(solver.particles());
            step(&mut solver, 1);
            let (after, _) = momentum(solver.particles());
            // A particle that becomes fixed or free at this boundary changes the sum before the step.
            let expected = gravity * (mass / 120.0) - total(&solver);
            let found = after - before;
            let size = total(&solver).length() + mass * 9.81 / 120.0;
            if ![20, 30, 80].contains(&number) {
                assert_at_most("difference", 1e-5 * size, (found - expected).length());
            }
            largest = largest.max(total(&solver).length() / (mass * 9.81 / 120.0));
            for (count, collider) in touched.iter_mut().zip(&forces(&solver).colliders) {
                *count += collider.contacts;
            }
        }
        assert!(touched.iter().all(|count| *count > 0), "{touched:?}");
        assert!(largest > 0.5, "{largest}");
    }
}

#[test]
fn measuring_changes_no_bit_and_the_forces_are_the_same_on_any_number_of_threads() {
    // Enough rows for a band of each thread.
    let text = format!("version = 1\n{EVERYTHING}").replace("rows = 15", "rows = 300");
    let scene = Scene::from_toml(&text, "test").unwrap();
    let mut silent = Solver::new(&scene);
    let mut single = Solver::new(&scene);
    single.compute_forces(true);
    let mut others = [2, 3].map(|threads| {
        let mut solver = Solver::new(&scene);
        solver.set_threads(threads);
        solver.compute_forces(true);
        solver
    });
    for number in 0..100 {
        for solver in others.iter_mut().chain([&mut single, &mut silent]) {
            disturb(solver, number);
            step(solver, 1);
        }
        assert_eq!(single.state_hash(), silent.state_hash(), "step {number}");
        for other in &others {
            assert_eq!(other.state_hash(), single.state_hash(), "step {number}");
            assert_eq!(forces(other), forces(&single), "step {number}");
        }
    }
    assert!(silent.forces().is_none());
}

#[test]
fn a_step_that_puts_a_state_in_place_has_no_forces() {
    let mut solver = everything(Kernels::best(), 1);
    step(&mut solver, 50);
    assert!(total(&solver).length() > 0.0);
    solver.reset();
    step(&mut solver, 1);
    assert_eq!(total(&solver), DVec3::ZERO);
    step(&mut solver, 1);
    assert!(total(&solver).length() > 0.0);
    solver.compute_forces(false);
    assert!(solver.forces().is_none());
}
