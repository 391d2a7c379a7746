//! Colliders: particles neither penetrate them nor tunnel through them, and they move as commanded.

use proptest::prelude::*;
use sim_solver::{ColliderGeometry, Pose};

use super::{
    FLOOR, assert_at_most, assert_close, assert_near, position, rates, solver, step, stepped,
    velocity,
};

#[test]
fn a_particle_that_starts_inside_leaves_with_less_than_g_dt() {
    for substeps in [1, 4, 20] {
        for shape in [
            FLOOR,
            "[[collider]]\nshape = \"box\"\ncenter = [0, -0.5, 0]\nhalf_extents = [5, 0.5, 5]\n",
            "[[collider]]\nshape = \"sphere\"\ncenter = [0, -9, 0]\nradius = 9\n",
            "[[collider]]\nshape = \"bounds\"\nmin = [-9, 0, -9]\nmax = [9, 9, 9]\n",
        ] {
            let text = rates(60, substeps)
                + "[[particle]]\nposition = [0, -0.1, 0]\n"
                + shape
                + "restitution = 0.9\n";
            let mut solver = solver(&text);
            for _ in 0..30 {
                step(&mut solver, 1);
                assert_at_most("speed", 9.81 / 60.0, velocity(&solver, 0)[1].abs());
                assert_near("height", 0.0, position(&solver, 0)[1], 1e-6);
            }
        }
    }
}

#[test]
fn nothing_tunnels_through_a_thin_box_a_plane_or_bounds_at_max_speed() {
    for shape in [
        "[[collider]]\nshape = \"box\"\ncenter = [0, 0, 0]\nhalf_extents = [1e5, 1e-3, 1e5]\n",
        "[[collider]]\nshape = \"box\"\ncenter = [0, 0, 0]\nhalf_extents = [1e-3, 1e5, 1e5]\nrotation = [0, 0, 1, 1]\n",
        "[[collider]]\nshape = \"plane\"\nnormal = [0, 3, 0]\noffset = 1e-3\n",
        "[[collider]]\nshape = \"bounds\"\nmin = [-1e6, 1e-3, -1e6]\nmax = [1e6, 1e6, 1e6]\n",
    ] {
        let text = rates(60, 1)
            + "[[particle]]\nposition = [0, 1, 0]\nvelocity = [10, -10000, 3]\n"
            + shape;
        let mut solver = solver(&text);
        for _ in 0..30 {
            step(&mut solver, 1);
            assert_near(shape, 1e-3, position(&solver, 0)[1], 1e-5);
        }
    }
}

#[test]
fn a_fast_box_does_not_pass_over_a_particle() {
    let text = "gravity = [0, 0, 0]\n".to_owned()
        + &rates(60, 1)
        + "[[particle]]\nposition = [0, 0, 0]\n[[collider]]\nshape = \"box\"\ncenter = [-10, 0, 0]\n\
           half_extents = [0.01, 5, 5]\nvelocity = [900, 0, 0]\n";
    let solver = stepped(&text, 6);
    assert_near("pushed by the front", -10.0 + 90.0 + 0.01, position(&solver, 0)[0], 1e-3);
    assert_close("speed of the front", 900.0, velocity(&solver, 0)[0], 1e-3);
}

#[test]
fn a_box_that_moves_through_a_cloth_pushes_it_and_contains_no_particle() {
    let text = rates(60, 4)
        + "[[generate]]\nshape = \"cloth\"\ncolumns = 11\nrows = 11\nspacing = 0.2\norigin = [-1, 1, 0]\n\
           diagonals = 1\n[[collider]]\nshape = \"box\"\ncenter = [0, 0, -2]\nhalf_extents = [0.3, 0.4, 0.3]\n\
           rotation = [0, 0.2, 0.1, 1]\nvelocity = [0, 0, 1]\nangular_velocity = [0, 0.5, 0]\nfriction = 0.3\n";
    let mut solver = solver(&text);
    let mut carried = 0.0;
    for _ in 0..180 {
        step(&mut solver, 1);
        let shape = solver.colliders().next().unwrap().shape;
        for index in 0..solver.particle_count() {
            let depth = depth_in(&shape, position(&solver, index));
            assert!(depth < 1e-5, "particle {index} is {depth} m inside");
            carried = f64::max(carried, position(&solver, index)[2]);
        }
    }
    assert!(carried > 0.5, "the box pushes the cloth: {carried}");
}

#[test]
fn a_particle_on_a_thin_box_is_not_pulled_through_it() {
    let text = rates(240, 4)
        + "[[particle]]\nposition = [0, 0.3, 0]\n[[particle]]\nposition = [0, -3, 0]\nmass = 100\npinned = true\n\
           [[constraint]]\nparticles = [0, 1]\nrest_length = 0.5\ncompliance = 1e-5\n\
           [[collider]]\nshape = \"box\"\ncenter = [0, 0.1, 0]\nhalf_extents = [1, 1e-3, 1]\n";
    let mut solver = solver(&text);
    for _ in 0..480 {
        step(&mut solver, 1);
        assert_at_most("top of the box", position(&solver, 0)[1], 0.101 - 1e-6);
    }
}

#[test]
fn a_box_pushes_particles_out_through_the_nearest_face_with_ties_in_fixed_order() {
    let place = |at: [f64; 3]| {
        let text = "gravity = [0, 0, 0]\n".to_owned()
            + &rates(60, 1)
            + &format!(
                "[[particle]]\nposition = {at:?}\n[[collider]]\nshape = \"box\"\ncenter = [0, 0, 0]\nhalf_extents = [1, 1, 1]\n"
            );
        stepped(&text, 1).particle(0).position
    };
    assert_eq!(place([0.5, 0.25, 0.25]), [1.0, 0.25, 0.25]);
    assert_eq!(place([0.25, -0.5, 0.25]), [0.25, -1.0, 0.25]);
    assert_eq!(place([0.5, 0.5, 0.5]), [1.0, 0.5, 0.5]);
    assert_eq!(place([-0.5, 0.5, -0.5]), [-0.5, 1.0, -0.5]);
    assert_eq!(place([0.0, 0.0, 0.0]), [1.0, 0.0, 0.0]);
}

#[test]
fn a_particle_at_the_center_of_a_sphere_is_pushed_out() {
    for shape in [
        "[[collider]]\nshape = \"sphere\"\ncenter = [0, 0, 0]\nradius = 1\n",
        "[[collider]]\nshape = \"capsule\"\na = [-2, 0, 0]\nb = [2, 0, 0]\nradius = 1\n",
        // Too short to have a direction in f32.
        "[[collider]]\nshape = \"capsule\"\na = [0, 0, 0]\nb = [0, 1e-25, 0]\nradius = 1\n",
    ] {
        let text = "gravity = [0, 0, 0]\n".to_owned()
            + &rates(60, 1)
            + "[[particle]]\nposition = [0, 0, 0]\n"
            + shape;
        let solver = stepped(&text, 1);
        let [x, y, z] = position(&solver, 0);
        assert_near(shape, 1.0, (x * x + y * y + z * z).sqrt(), 1e-6);
        assert_eq!((solver.particle(0).velocity, solver.frozen_count()), ([0.0; 3], 0));
    }
}

#[test]
fn spheres_and_capsules_push_particles_to_the_nearest_point_of_their_surface() {
    let capsule = "shape = \"capsule\"\na = [-1, 0, 0]\nb = [1, 0, 0]\nradius = 0.5\n";
    let sphere = "shape = \"sphere\"\ncenter = [0, 1, 0]\nradius = 2\n";
    for (solid, at, expected) in [
        (sphere, [0.6, 1.8, 0.0], [1.2, 2.6, 0.0]),
        (sphere, [0.0, 1.0, -0.1], [0.0, 1.0, -2.0]),
        (sphere, [0.0, 3.5, 0.0], [0.0, 3.5, 0.0]),
        (capsule, [0.3, 0.0, -0.4], [0.3, 0.0, -0.5]),
        (capsule, [1.3, 0.0, 0.0], [1.5, 0.0, 0.0]),
        (capsule, [-1.24, 0.18, 0.0], [-1.4, 0.3, 0.0]),
        (capsule, [1.4, 0.4, 0.0], [1.4, 0.4, 0.0]),
    ] {
        let text = "gravity = [0, 0, 0]\n".to_owned()
            + &rates(60, 1)
            + &format!("[[particle]]\nposition = {at:?}\n[[collider]]\n{solid}");
        let solver = stepped(&text, 1);
        for (axis, expected) in expected.into_iter().enumerate() {
            assert_near(solid, expected, position(&solver, 0)[axis], 1e-6);
            assert_near("speed", 0.0, velocity(&solver, 0)[axis], 1e-9);
        }
    }
}

#[test]
fn a_collider_moves_and_rotates_with_its_own_velocities() {
    let text = rates(100, 2)
        + "[[collider]]\nshape = \"box\"\ncenter = [1, 2, 3]\nhalf_extents = [1, 1, 1]\n\
           velocity = [0.5, 0, -1]\nangular_velocity = [0, 0, 2]\n";
    let solver = stepped(&text, 250);
    let placed = solver.colliders().next().unwrap();
    let ColliderGeometry::Box { center, rotation, .. } = placed.shape else { panic!("{placed:?}") };
    for (axis, expected) in [2.25, 2.0, 0.5].into_iter().enumerate() {
        assert_near("center", expected, f64::from(center[axis]), 1e-5);
    }
    // The quaternion has half of the angle of 5 radians. It is the same rotation with all signs
    // changed.
    let [x, y, z, w] = rotation.map(|part| f64::from(part) * f64::from(rotation[3].signum()));
    let sign = 2.5_f64.cos().signum();
    assert_near("z", 2.5_f64.sin() * sign, z, 1e-6);
    assert_near("w", 2.5_f64.cos() * sign, w, 1e-6);
    assert_near("x and y", 0.0, x.abs() + y.abs(), 1e-9);
    assert_eq!((placed.velocity, placed.angular_velocity), ([0.5, 0.0, -1.0], [0.0, 0.0, 2.0]));
}

#[test]
fn bounds_keep_the_box_of_the_pixel_demonstration_inside_in_every_snapshot() {
    let text = "dimensions = 2\nup = \"-y\"\nunit = \"px\"\ngravity = [0, 50, 0]\n[solver]\nrate_hz = 60\nsubsteps = 4\n\
         [[particle]]\nposition = [220, 20, 0]\nvelocity = [90, 0, 0]\n[[particle]]\nposition = [280, 20, 0]\n\
         [[particle]]\nposition = [280, 60, 0]\n[[particle]]\nposition = [220, 60, 0]\n\
         [[constraint]]\nparticles = [0, 1]\n[[constraint]]\nparticles = [1, 2]\n\
         [[constraint]]\nparticles = [2, 3]\n[[constraint]]\nparticles = [3, 0]\n\
         [[constraint]]\nparticles = [0, 2]\n[[constraint]]\nparticles = [1, 3]\n\
         [[collider]]\nshape = \"bounds\"\nmin = [0, 0, 0]\nmax = [500, 400, 0]\n";
    let mut solver = solver(text);
    for _ in 0..3000 {
        step(&mut solver, 1);
        for index in 0..4 {
            let [x, y, z] = solver.particle(index).position;
            assert!((0.0..=500.0).contains(&x) && (0.0..=400.0).contains(&y), "{x} {y}");
            assert_eq!(z.to_bits(), 0);
        }
    }
    let lowest = (0..4).map(|index| solver.particle(index).position[1]).fold(0.0, f32::max);
    assert_eq!(lowest, 400.0);
}

#[test]
fn a_collider_moved_by_a_client_has_the_velocity_of_its_displacement() {
    let text = "gravity = [0, 0, 0]\n".to_owned()
        + &rates(100, 4)
        + "[[particle]]\nposition = [0.5, 0, 0]\n[[collider]]\nshape = \"box\"\ncenter = [0, 0, 0]\nhalf_extents = [0.4, 1, 1]\n";
    let mut solver = solver(&text);
    let no_turn = [0.0, 0.0, 0.0, 1.0];
    solver.move_collider(0, Pose { translation: [0.2, 0.0, 0.0], rotation: no_turn }).unwrap();
    step(&mut solver, 1);
    assert_near("pushed to the face", 0.6, position(&solver, 0)[0], 1e-5);
    assert_close("speed of the face", 20.0, velocity(&solver, 0)[0], 1e-4);
    let placed = solver.colliders().next().unwrap();
    assert!(
        matches!(placed.shape, ColliderGeometry::Box { center: [x, ..], .. } if (x - 0.2).abs() < 1e-6)
    );
    assert!(solver.has_moving_colliders());
    // Then it stands still.
    step(&mut solver, 1);
    assert!(!solver.has_moving_colliders());
    assert_eq!(solver.colliders().next().unwrap().velocity, [0.0; 3]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn no_snapshot_is_inside_of_a_plane_or_a_turned_box(
        normal in prop::array::uniform3(-1.0_f64..1.0),
        offset in -2.0_f64..2.0,
        rotation in prop::array::uniform4(-1.0_f64..1.0),
        velocity in prop::array::uniform3(-20.0_f64..20.0),
        gravity in prop::array::uniform3(-20.0_f64..20.0),
    ) {
        let length = normal.iter().map(|axis| axis * axis).sum::<f64>().sqrt();
        prop_assume!(length > 0.1 && rotation.iter().map(|part| part * part).sum::<f64>() > 0.1);
        let solids = [
            format!("shape = \"plane\"\nnormal = {normal:?}\noffset = {offset}\n"),
            format!("shape = \"box\"\ncenter = [0, 0, 0]\nhalf_extents = [1, 0.5, 2]\nrotation = {rotation:?}\n"),
        ];
        for solid in solids {
            let text = format!("gravity = {gravity:?}\n") + &rates(60, 4)
                + &format!("[[particle]]\nposition = [0.1, 0.3, -0.2]\nvelocity = {velocity:?}\n[[collider]]\n{solid}friction = 0.3\nrestitution = 0.5\n");
            let mut solver = solver(&text);
            for _ in 0..60 {
                step(&mut solver, 1);
                let at = position(&solver, 0);
                let depth = depth_in(&solver.colliders().next().unwrap().shape, at);
                let size = at.iter().fold(1.0_f64, |most, axis| most.max(axis.abs()));
                prop_assert!(depth < 2e-6 * size, "{at:?} is {depth} m inside {solid}");
            }
        }
    }
}

/// Returns the depth of a point inside a plane or a box, in f64 and by the definition of the shape.
fn depth_in(shape: &ColliderGeometry, at: [f64; 3]) -> f64 {
    match *shape {
        ColliderGeometry::Plane { normal, offset } => {
            let height: f64 = (0..3).map(|axis| f64::from(normal[axis]) * at[axis]).sum();
            f64::from(offset) - height
        }
        ColliderGeometry::Box { center, half_extents, rotation } => {
            let [x, y, z, w] = rotation.map(f64::from);
            let arm: Vec<f64> = (0..3).map(|axis| at[axis] - f64::from(center[axis])).collect();
            // Columns of the rotation matrix.
            let axes = [
                [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w), 2.0 * (x * z - y * w)],
                [2.0 * (x * y - z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + x * w)],
                [2.0 * (x * z + y * w), 2.0 * (y * z - x * w), 1.0 - 2.0 * (x * x + y * y)],
            ];
            let depth = |axis: usize| {
                let along: f64 = (0..3).map(|part| axes[axis][part] * arm[part]).sum();
                f64::from(half_extents[axis]) - along.abs()
            };
            depth(0).min(depth(1)).min(depth(2))
        }
        _ => panic!("no plane and no box"),
    }
}
