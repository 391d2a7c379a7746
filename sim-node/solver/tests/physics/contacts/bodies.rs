//! Bodies of other programs, against the laws of rigid bodies.

use glam::{DQuat, DVec3, Vec3};
use sim_solver::{
    BodyMotion, ColliderGeometry, Kernels, ParameterValue, Pose, Reason, Scene, Solver,
};

use crate::physics::{assert_at_most, assert_close, assert_near, bits, rates, solver};

const GRAVITY: DVec3 = DVec3::new(0.0, -9.81, 0.0);

/// A rigid body as the program integrates it that owns it.
struct Peer {
    mass: f64,
    inertia: DVec3,
    /// Relative to the pose at load.
    position: DVec3,
    rotation: DQuat,
    velocity: DVec3,
    spin: DVec3,
    gravity: DVec3,
    /// Beside gravity and the impulses of the particles.
    force: DVec3,
    torque: DVec3,
    dt: f64,
}

impl Peer {
    fn new(mass: f64, inertia: [f64; 3], rate_hz: u32) -> Self {
        Self {
            mass,
            inertia: DVec3::from_array(inertia),
            position: DVec3::ZERO,
            rotation: DQuat::IDENTITY,
            velocity: DVec3::ZERO,
            spin: DVec3::ZERO,
            gravity: GRAVITY,
            force: DVec3::ZERO,
            torque: DVec3::ZERO,
            dt: 1.0 / f64::from(rate_hz),
        }
    }

    /// Sends the motion, makes a step, and applies the impulses that come back. Returns the impulse.
    fn step(&mut self, solver: &mut Solver) -> DVec3 {
        let pose = Pose {
            translation: self.position.as_vec3().to_array(),
            rotation: self.rotation.as_quat().to_array(),
        };
        let motion = BodyMotion {
            velocity: self.velocity.as_vec3().to_array(),
            angular_velocity: self.spin.as_vec3().to_array(),
            force: self.force.as_vec3().to_array(),
            torque: self.torque.as_vec3().to_array(),
        };
        solver.drive_body(0, pose, &motion).unwrap();
        solver.step();
        let row = solver.forces().unwrap().colliders[0].impulse;
        let impulse = vector(row.linear);
        let before = self.velocity;
        self.velocity += (self.gravity + self.force / self.mass) * self.dt + impulse / self.mass;
        self.position += (before + self.velocity) * (0.5 * self.dt);
        self.turn(vector(row.angular) + self.torque * self.dt);
        impulse
    }

    fn turn(&mut self, angular_impulse: DVec3) {
        let local = self.rotation.inverse() * angular_impulse;
        self.spin += self.rotation * (local / self.inertia);
        if self.spin != DVec3::ZERO {
            self.rotation = DQuat::from_scaled_axis(self.spin * self.dt) * self.rotation;
        }
    }
}

fn vector(numbers: [f32; 3]) -> DVec3 {
    Vec3::from_array(numbers).as_dvec3()
}

fn measured(text: &str) -> Solver {
    let mut solver = solver(text);
    solver.compute_forces(true);
    solver
}

/// Momentum and angular momentum of the free particles.
fn momenta(solver: &Solver) -> (DVec3, DVec3) {
    let free = solver.particles().iter().filter(|one| one.inverse_mass > 0.0);
    let moving = free.map(|one| {
        let momentum = vector(one.velocity) / f64::from(one.inverse_mass);
        (momentum, vector(one.position).cross(momentum))
    });
    moving.fold(Default::default(), |(p, l), (dp, dl)| (p + dp, l + dl))
}

/// The solver of [`net`], whose border it pins.
fn net_solver(scene: &Scene, kernels: Kernels) -> Solver {
    let mut solver = Solver::with_kernels(scene, kernels);
    for particle in 0..169 {
        let (row, column) = (particle / 13, particle % 13);
        if [0, 12].contains(&row) || [0, 12].contains(&column) {
            solver.pin(particle).unwrap();
        }
    }
    solver.compute_forces(true);
    solver
}

fn measured_net(mass: f64, extra: &str) -> Solver {
    let text = format!("version = 1\n{}", net(mass, extra));
    net_solver(&Scene::from_toml(&text, "test").unwrap(), Kernels::best())
}

/// A horizontal net of particles of 10 g, and a ball above its middle.
fn net(mass: f64, extra: &str) -> String {
    let inertia = 0.4 * mass * 0.1 * 0.1;
    format!(
        "{}damping = 0.5\n[[generate]]\nshape = \"cloth\"\ncolumns = 13\nrows = 13\nspacing = 0.05\n\
         origin = [-0.3, 0, -0.3]\ndown = [0, 0, 1]\npinned = \"none\"\nmass = 0.01\n\
         [[collider]]\nshape = \"sphere\"\ncenter = [0, 0.11, 0]\nradius = 0.1\n{extra}\
         body = {{ mass = {mass}, inertia = [{inertia}, {inertia}, {inertia}] }}\n",
        rates(240, 4)
    )
}

#[test]
fn a_particle_that_hits_a_box_off_its_center_gives_the_impulse_of_the_closed_form() {
    // 1/w + 1/M + (r x n)^2 / I, at the arm (0.2, 0.1, 0).
    for (restitution, factor) in [(0.0, 1.0), (0.5, 1.5)] {
        let text = format!(
            "gravity = [0, 0, 0]\n{}[[particle]]\nposition = [0.2, 0.101, 0]\nvelocity = [0, -2, 0]\n\
             mass = 0.25\n[[collider]]\nshape = \"box\"\ncenter = [0, 0, 0]\nrestitution = {restitution}\n\
             half_extents = [0.3, 0.1, 0.3]\nbody = {{ mass = 0.5, inertia = [0.01, 0.02, 0.015] }}\n",
            rates(240, 4)
        );
        let mut solver = measured(&text);
        let mut peer = Peer::new(0.5, [0.01, 0.02, 0.015], 240);
        peer.gravity = DVec3::ZERO;
        let impulse = peer.step(&mut solver);
        let weight = 1.0 / 0.25 + 1.0 / 0.5 + 0.2 * 0.2 / 0.015;
        assert_close("impulse", -factor * 2.0 / weight, impulse.y, 1e-3);
        assert_near("across", 0.0, impulse.x.abs() + impulse.z.abs(), 1e-6);
        assert_close("spin", 0.2 * impulse.y / 0.015, peer.spin.z, 1e-3);
        let expected = -2.0 - impulse.y / 0.25;
        assert_close("particle", expected, f64::from(solver.particle(0).velocity[1]), 1e-5);
    }
}

#[test]
fn friction_of_a_body_is_coulombs_and_stops_the_sliding_of_its_particles() {
    // Without a turn, a small friction takes its share of the impulse; a large one makes the velocities equal.
    for friction in [0.1, 10.0] {
        let text = format!(
            "gravity = [0, 0, 0]\n{}[[particle]]\nposition = [0, 0.101, 0]\nvelocity = [1, -1, 0]\n\
             mass = 0.25\n[[collider]]\nshape = \"box\"\ncenter = [0, 0, 0]\nfriction = {friction}\n\
             half_extents = [0.3, 0.1, 0.3]\nbody = {{ mass = 0.5, inertia = [1e9, 1e9, 1e9] }}\n",
            rates(60, 1)
        );
        let mut solver = measured(&text);
        let mut peer = Peer::new(0.5, [1e9; 3], 60);
        peer.gravity = DVec3::ZERO;
        let impulse = peer.step(&mut solver);
        assert_close("across", -1.0 / (1.0 / 0.25 + 1.0 / 0.5), impulse.y, 1e-3);
        // Friction acts on the depth gained, which is all but the gap of 1 mm.
        let gained = 1.0 - 0.001 * 60.0;
        let along = f64::min(friction * gained, 1.0) / (1.0 / 0.25 + 1.0 / 0.5);
        assert_close("along", along, impulse.x, 2e-3);
    }
}

#[test]
fn momentum_passes_between_a_body_and_a_free_cloth_and_none_is_lost() {
    for shape in [
        "shape = \"sphere\"\ncenter = [0.05, 0.15, 0.02]\nradius = 0.1\n",
        "shape = \"capsule\"\na = [-0.1, 0.15, 0.02]\nb = [0.2, 0.15, 0.02]\nradius = 0.1\n",
        "shape = \"box\"\ncenter = [0.05, 0.15, 0.02]\nhalf_extents = [0.1, 0.1, 0.08]\n",
        "shape = \"mesh\"\ncenter = [0.05, 0.15, 0.02]\nvertices = [[-0.2, -0.1, -0.2], [0.2, -0.1, -0.2], \
         [0, -0.1, 0.3], [0, 0.2, 0]]\nfaces = [[0, 1, 2], [1, 0, 3], [2, 1, 3], [0, 2, 3]]\n",
    ] {
        let text = format!(
            "gravity = [0, 0, 0]\n{}[[generate]]\nshape = \"cloth\"\ncolumns = 11\nrows = 11\n\
             spacing = 0.05\norigin = [-0.25, 0, -0.25]\ndown = [0, 0, 1]\npinned = \"none\"\nmass = 0.01\n\
             [[collider]]\n{shape}friction = 0.4\nrestitution = 0.2\n\
             body = {{ mass = 0.6, inertia = [0.002, 0.0025, 0.003] }}\n",
            rates(240, 4)
        );
        let mut solver = measured(&text);
        let mut peer = Peer::new(0.6, [0.002, 0.0025, 0.003], 240);
        peer.gravity = DVec3::ZERO;
        peer.velocity = DVec3::new(0.3, -1.5, 0.1);
        peer.spin = DVec3::new(0.5, 2.0, -1.0);
        let (start, scale) = (peer.velocity * peer.mass, peer.velocity.length() * peer.mass);
        let mut contact_count = 0;
        for _ in 0..120 {
            let (before, turning) = momenta(&solver);
            let impulse = peer.step(&mut solver);
            let (after, turned) = momenta(&solver);
            let balance = (after - before + impulse).length();
            assert!(balance < 1e-5 * scale, "{shape}: {balance}");
            let row = solver.forces().unwrap().colliders[0];
            contact_count += row.contacts;
            let about_origin = vector(row.impulse.angular)
                + (peer.position + DVec3::new(0.05, 0.15, 0.02)).cross(impulse);
            let balance = (turned - turning + about_origin).length();
            assert!(balance < 2e-3 * scale, "{shape}: angular {balance}");
        }
        let end = momenta(&solver).0 + peer.velocity * peer.mass;
        assert_near(shape, 0.0, (end - start).length(), 1e-4 * scale);
        assert!(contact_count > 40, "{shape}: {contact_count} contacts");
    }
}

#[test]
fn a_body_at_rest_weighs_what_it_weighs() {
    for mass in [0.01, 0.1, 1.0] {
        let mut solver = measured_net(mass, "friction = 0.5\n");
        solver.set("damping", ParameterValue::Number(3.0), None).unwrap();
        let mut peer = Peer::new(mass, [0.4 * mass * 0.01; 3], 240);
        let mut sum = 0.0;
        for step in 0..2400 {
            let impulse = peer.step(&mut solver);
            if step >= 2160 {
                sum += impulse.y;
            }
        }
        assert_close(&format!("{mass} kg"), mass * 9.81, sum, 1e-2);
        assert_at_most("speed", 0.05, peer.velocity.length());
    }
}

#[test]
fn a_ball_that_falls_on_a_pinned_particle_lands_as_on_a_rigid_floor() {
    for (restitution, rebound) in [(0.0, 0.0), (0.5, 0.5)] {
        let text = format!(
            "{}[[particle]]\nposition = [0, 0, 0]\npinned = true\n[[collider]]\nshape = \"sphere\"\n\
             center = [0, 0.3, 0]\nradius = 0.1\nrestitution = {restitution}\n\
             body = {{ mass = 3, inertia = [0.012, 0.012, 0.012] }}\n",
            rates(240, 4)
        );
        let mut solver = measured(&text);
        let mut peer = Peer::new(3.0, [0.012; 3], 240);
        // It falls by 0.2 m.
        let landing = (2.0 * 0.2 / 9.81_f64).sqrt();
        let speed = 9.81 * landing;
        let mut first = None;
        for step in 0..480 {
            let impulse = peer.step(&mut solver);
            if impulse.y > 0.0 && first.is_none() {
                first = Some((f64::from(step) / 240.0, peer.velocity.y));
            }
        }
        let (time, after) = first.unwrap();
        assert_near("landing", landing, time, 1.5 / 240.0);
        // The step of the impact also has gravity.
        assert_near("rebound", rebound * speed, after, 9.81 / 240.0);
        assert_near("height", -0.2, peer.position.y, 1e-3);
        let impulse = peer.step(&mut solver);
        assert_close("weight", 3.0 * 9.81 / 240.0, impulse.y, 1e-2);
    }
}

#[test]
fn a_plank_on_two_ropes_tilts_under_a_ball_and_loads_them_by_the_law_of_the_lever() {
    // The ropes lie along z, at x = -0.3 and x = 0.3. The plank lies across them. Its engine lets a ball of 1 kg
    // roll on it, which is a force and a torque for the particles.
    let rope = |x: f32| {
        format!(
            "[[generate]]\nshape = \"rope\"\ncount = 25\nmass = 0.01\npinned = \"both\"\n\
             compliance = {{ structural = 1e-4 }}\n\
             from = [{x}, 0, -0.6]\nto = [{x}, 0, 0.6]\n"
        )
    };
    let text = format!(
        "{}damping = 4\n{}{}[[collider]]\nshape = \"box\"\ncenter = [0, 0.021, 0]\nfriction = 1\n\
         half_extents = [0.5, 0.02, 0.2]\nbody = {{ mass = 2, inertia = [0.027, 0.19, 0.167] }}\n",
        rates(240, 16),
        rope(-0.3),
        rope(0.3)
    );
    let mut solver = measured(&text);
    let mut plank = Peer::new(2.0, [0.027, 0.19, 0.167], 240);
    let weight = 9.81;
    let mut tilt_before = f64::NEG_INFINITY;
    for ball in [-0.2, 0.0, 0.2] {
        // Slowly to the place, then it waits.
        let start = plank.torque.z / -weight;
        let mut supports = [0.0; 2];
        let mut torque = 0.0;
        for step in 0..240 * 12 {
            let share = f64::min(f64::from(step) / (240.0 * 4.0), 1.0);
            let at = start + (ball - start) * share;
            plank.force = DVec3::new(0.0, -weight, 0.0);
            plank.torque = DVec3::new(0.0, 0.0, -at * weight);
            // Some friction of the engine's own, so that the plank settles.
            plank.velocity *= 1.0 - 2.0 / 240.0;
            plank.spin *= 1.0 - 2.0 / 240.0;
            plank.step(&mut solver);
            if step >= 240 * 10 {
                let forces = solver.forces().unwrap();
                torque += f64::from(forces.colliders[0].impulse.angular[2]) / 2.0;
                for row in &forces.particles {
                    supports[usize::from(row.particle >= 25)] -= f64::from(row.impulse[1]) / 2.0;
                }
            }
        }
        assert_near("torque", ball * weight, torque, 0.02 * weight * 0.2);
        // Each rope carries itself, half of the plank, and its share of the ball.
        for (side, support) in [(-1.0, supports[0]), (1.0, supports[1])] {
            let share = 0.5 + side * ball / 0.6;
            let expected = 0.23 * 9.81 + 9.81 + share * weight;
            assert_close(&format!("rope {side} with the ball at {ball}"), expected, support, 2e-2);
        }
        let tilt = -2.0 * plank.rotation.z;
        assert!(tilt > tilt_before + 0.01, "{tilt} at {ball} after {tilt_before}");
        tilt_before = tilt;
        if ball == 0.0 {
            assert_near("level", 0.0, tilt, 2e-3);
        }
    }
}

#[test]
fn five_orders_of_magnitude_of_mass_stay_bounded_for_a_minute() {
    for ratio in [0.1, 1.0, 10.0, 100.0, 1_000.0, 10_000.0] {
        let mass = ratio * 0.01;
        let mut solver = measured_net(mass, "friction = 0.5\n");
        let mut peer = Peer::new(mass, [0.4 * mass * 0.01; 3], 240);
        // Off the middle and spinning, so that it rolls.
        peer.position = DVec3::new(0.07, 0.1, 0.03);
        peer.spin = DVec3::new(3.0, 1.0, -4.0);
        let energy = mass * 9.81 * 0.3 + 0.5 * 0.4 * mass * 0.01 * peer.spin.length_squared();
        let mut energy_max = 0.0_f64;
        for _ in 0..60 * 240 {
            peer.step(&mut solver);
            let moving =
                0.5 * peer.velocity.length_squared() + 0.5 * 0.004 * peer.spin.length_squared();
            // Relative to the height at load; a body that has left the net keeps falling.
            energy_max = energy_max.max(mass * (moving + 9.81 * peer.position.y));
            assert!(peer.position.is_finite(), "{ratio}");
        }
        assert_at_most(&format!("energy of {ratio} particles"), energy, energy_max);
        let free = solver.particles().iter().filter(|one| one.inverse_mass > 0.0);
        let speed = free.map(|one| vector(one.velocity).length()).fold(0.0, f64::max);
        assert_at_most(&format!("speed of the net under {ratio} particles"), 3.0, speed);
    }
}

#[test]
fn a_body_without_a_command_stands_like_a_collider_and_is_counted() {
    let with_body = net(1.0, "");
    let (without, _) = with_body.split_once("body").unwrap();
    let (mut body, mut collider) = (measured(&with_body), measured(without));
    for step in 0..240_u32 {
        body.step();
        collider.step();
        assert_eq!(bits(&body), bits(&collider), "step {step}");
        assert_eq!(body.forces(), collider.forces());
    }
    assert_eq!(body.standing_body_steps(), 0, "never driven");
    let mut peer = Peer::new(1.0, [0.004; 3], 240);
    peer.step(&mut body);
    let pose = Pose {
        translation: (Vec3::from_array(center(&body)) - Vec3::new(0.0, 0.11, 0.0)).to_array(),
        rotation: [0.0, 0.0, 0.0, 1.0],
    };
    for _ in 0..5 {
        body.step();
        assert_eq!(body.colliders().next().unwrap().velocity, [0.0; 3]);
    }
    assert_eq!(body.standing_body_steps(), 5);
    // A motion of a client moves it.
    body.move_collider_over(0, pose, 0.05).unwrap();
    for _ in 0..3 {
        body.step();
    }
    assert_eq!(body.standing_body_steps(), 5);
    body.move_collider(0, pose).unwrap();
    body.step();
    body.step();
    assert_eq!(body.standing_body_steps(), 6);
    let stands = Vec3::from_array(center(&body)) - Vec3::new(0.0, 0.11, 0.0);
    assert_eq!(stands.to_array(), pose.translation);
}

fn center(solver: &Solver) -> [f32; 3] {
    solver.colliders().next().unwrap().shape.fields().center
}

#[test]
fn commands_alone_repeat_every_bit_on_all_kernels_and_threads_and_from_a_keyframe() {
    let run = |kernels, threads, restored: bool| {
        let text = format!("version = 1\n{}", net(0.3, "friction = 0.3\n"));
        let scene = Scene::from_toml(&text, "test").unwrap();
        let mut solver = net_solver(&scene, kernels);
        solver.set_threads(threads);
        let mut peer = Peer::new(0.3, [0.0012; 3], 240);
        peer.velocity = DVec3::new(0.2, -1.0, 0.1);
        let mut hashes = Vec::new();
        for step in 0..240 {
            if step == 100 && restored {
                let (keyframe, particles) = (solver.keyframe(), solver.particles().to_vec());
                let mut other = Solver::with_kernels(&scene, kernels);
                other.restore(&particles, &keyframe).unwrap();
                other.compute_forces(true);
                solver = other;
            }
            // Every third command is missing.
            if step % 3 == 2 {
                solver.step();
            } else {
                peer.step(&mut solver);
            }
            hashes.push(solver.state_hash());
        }
        hashes
    };
    let expected = run(Kernels::Reference, 1, false);
    for kernels in Kernels::available() {
        for (threads, restored) in [(1, false), (3, true)] {
            assert_eq!(run(kernels, threads, restored), expected, "{kernels:?} {threads}");
        }
    }
}

#[test]
fn wrong_commands_are_refused_and_change_nothing() {
    let mut solver =
        measured(&net(1.0, "[[collider]]\nshape = \"sphere\"\ncenter = [9, 9, 9]\nradius = 1\n"));
    let before = bits(&solver);
    let pose = Pose { translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] };
    let still = BodyMotion::default();
    // The key of the body belongs to the second collider.
    assert_eq!(solver.drive_body(0, pose, &still), Err(Reason::NoEffectHere));
    assert_eq!(solver.drive_body(2, pose, &still), Err(Reason::UnknownCollider));
    let wrong = [
        (BodyMotion { velocity: [f32::NAN, 0.0, 0.0], ..still }, Reason::NonFinite),
        (BodyMotion { torque: [0.0, f32::INFINITY, 0.0], ..still }, Reason::NonFinite),
        (BodyMotion { velocity: [2e7, 0.0, 0.0], ..still }, Reason::OutOfRange),
        (BodyMotion { angular_velocity: [0.0, 2e4, 0.0], ..still }, Reason::OutOfRange),
        (BodyMotion { torque: [0.0, 1e30, 0.0], ..still }, Reason::OutOfRange),
        (BodyMotion { force: [0.0, 0.0, -1e38], ..still }, Reason::OutOfRange),
    ];
    for (motion, reason) in wrong {
        assert_eq!(solver.drive_body(1, pose, &motion), Err(reason), "{motion:?}");
    }
    solver.drive_body(1, pose, &still).unwrap();
    assert_eq!(bits(&solver), before);
}

/// A needle, which hardly resists a turn about its axis, under a torque across the axis: the body turns, and soon the
/// torque acts about the axis.
#[test]
fn no_torque_and_no_contact_gives_a_body_a_state_that_is_not_finite() {
    let body = "body = { mass = 1, inertia = [1e-30, 1, 1] }";
    let text = "[solver]\nrate_hz = 10\nsubsteps = 100\n[[particle]]\nposition = [0.6, 0, 0.1]\nmass = 1e20\n\
         [[collider]]\nshape = \"box\"\ncenter = [0, 0, 0]\nhalf_extents = [0.5, 0.2, 0.2]\nfriction = 1\n";
    let mut solver = measured(&format!("{text}{body}\n"));
    let mut pose = Pose { translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] };
    let motion = BodyMotion {
        velocity: [10.0, 0.0, 0.0],
        angular_velocity: [0.0, 30.0, 0.0],
        torque: [0.0, 0.0, 9e4],
        ..BodyMotion::default()
    };
    let mut refused_count = 0;
    for _ in 0..20 {
        if solver.drive_body(0, pose, &motion).is_err() {
            // The torque acts about the axis already.
            (pose.rotation, refused_count) = ([0.0, 0.0, 0.0, 1.0], refused_count + 1);
            continue;
        }
        solver.step();
        let collider = solver.colliders().next().unwrap();
        let ColliderGeometry::Box { center, rotation, .. } = collider.shape else { panic!() };
        let spin = collider.angular_velocity;
        for number in center.iter().chain(&rotation).chain(&collider.velocity).chain(&spin) {
            assert!(number.is_finite(), "{collider:?}");
        }
        assert!(spin.iter().all(|axis| axis.abs() <= 1e4), "{spin:?}");
        let state: Vec<_> = solver.particles().to_vec();
        solver.restore(&state, &solver.keyframe()).unwrap();
        pose = Pose { translation: center, rotation };
    }
    assert!((1..=10).contains(&refused_count), "{refused_count} of 20 commands were refused");
}

#[test]
fn the_complete_text_of_a_scene_has_its_bodies() {
    let text = format!("version = 1\n{}", net(0.3, "friction = 0.3\n"));
    let scene = Scene::from_toml(&text, "test").unwrap();
    assert!(scene.colliders[0].body.is_some());
    assert_eq!(Scene::from_toml(&scene.to_toml(), "test").unwrap(), scene);
}
