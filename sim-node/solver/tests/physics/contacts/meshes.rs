//! Meshes of triangles: against planes and boxes, whose laws are known, and against invariants.

use sim_solver::{Pose, Scene, Solver};

use super::mesh::{Mesh, turned};
use crate::physics::{
    assert_at_most, assert_close, assert_near, particles, position, rates, solver, step, stepped,
    velocity,
};

fn particle(position: [f64; 3], velocity: [f64; 3]) -> String {
    format!("[[particle]]\nposition = {position:?}\nvelocity = {velocity:?}\n")
}

#[test]
fn a_particle_rests_at_its_distance_from_a_grid_of_triangles() {
    // On a triangle, on an edge and on a vertex.
    for place in [[0.03, 0.011], [0.05, 0.05], [0.0, 0.0]] {
        for distance in [0.0, 0.004] {
            let text = rates(240, 4)
                + &particle([place[0], 0.05, place[1]], [0.0; 3])
                + &Mesh::grid(20, 1.0).text()
                + &format!("distance = {distance}\n");
            let solver = stepped(&text, 240);
            assert_near("height", distance, position(&solver, 0)[1], 1e-5);
            assert_near("speed", 0.0, velocity(&solver, 0)[1].abs(), 1e-9);
        }
    }
}

/// The grid is turned by the vertices, or by the rotation of the collider.
#[test]
fn a_particle_slides_down_a_slope_of_triangles_as_coulomb_says() {
    for (degrees, friction) in [(10.0, 0.0), (20.0, 0.0), (30.0, 0.0), (30.0, 0.5), (35.0, 0.5)] {
        for is_rotated in [false, true] {
            let angle = f64::to_radians(degrees);
            let grid = Mesh::grid(50, 8.0);
            let half = angle / 2.0;
            let mesh = if is_rotated {
                grid.text() + &format!("rotation = [0, 0, {}, {}]\n", half.sin(), half.cos())
            } else {
                grid.turned(angle).text()
            };
            let start = turned([2.03, 1e-4, 0.011], angle);
            let text = rates(240, 4)
                + &particle(start, [0.0; 3])
                + &mesh
                + &format!("friction = {friction}\n");
            let mut solver = solver(&text);
            step(&mut solver, 24);
            let before = velocity(&solver, 0);
            step(&mut solver, 120);
            let after = velocity(&solver, 0);
            let gained = turned([after[0] - before[0], after[1] - before[1], 0.0], -angle);
            let expected = 9.81 * (angle.sin() - friction * angle.cos());
            assert_close("acceleration", expected, -gained[0] / 0.5, 0.01);
            let height = turned(position(&solver, 0), -angle)[1];
            assert_near("height", 0.0, height, 5e-5);
        }
    }
}

#[test]
fn a_particle_below_the_angle_of_friction_does_not_creep() {
    let angle = f64::to_radians(20.0);
    let start = turned([0.03, 1e-4, 0.011], angle);
    let text = rates(240, 4)
        + &particle(start, [0.0; 3])
        + &Mesh::grid(50, 8.0).turned(angle).text()
        + "friction = 0.5\n";
    let mut solver = solver(&text);
    step(&mut solver, 24);
    let before = position(&solver, 0);
    step(&mut solver, 240);
    let moved = (0..3).map(|axis| (position(&solver, 0)[axis] - before[axis]).abs()).sum();
    assert_at_most("creep", 1e-6, moved);
}

#[test]
fn sliding_over_a_hundred_edges_loses_no_speed() {
    for distance in [0.0, 0.004] {
        let text = rates(240, 4)
            + &particle([-1.9, distance + 1e-5, 0.011], [3.0, 0.0, 0.2])
            + &Mesh::grid(120, 4.0).text()
            + &format!("distance = {distance}\n");
        let solver = stepped(&text, 270);
        let [x, _, _] = position(&solver, 0);
        assert!(x > -1.9 + 4.0 / 120.0 * 100.0, "100 edges: {x}");
        assert_close("speed", 3.0, velocity(&solver, 0)[0], 1e-3);
        assert_close("speed across", 0.2, velocity(&solver, 0)[2], 1e-3);
    }
}

#[test]
fn nothing_passes_through_a_thin_plate_from_either_side() {
    let closed = || Mesh::cuboid([0.5, 0.0005, 0.5]).text();
    let open = || Mesh::grid(7, 1.0).text() + "distance = 0.0005\n";
    for (name, plate, half_width) in [("closed", closed(), 0.5), ("open", open(), 0.5)] {
        // The last one crosses 400 plates in a substep.
        for thicknesses_per_substep in [0.1, 0.4, 3.0, 400.0] {
            for side in [1.0, -1.0] {
                let speed = thicknesses_per_substep * 0.001 * 960.0;
                let mut text = "gravity = [0, 0, 0]\n".to_owned() + &rates(240, 4);
                for number in 0..100 {
                    let [x, z] = [number % 10, number / 10].map(|one| 0.09 * f64::from(one) - 0.4);
                    text += &particle([x, 0.02 * side, z], [0.1, -speed * side, 0.05]);
                }
                let solver = stepped(&(text + &plate), 120);
                for index in 0..100 {
                    let at = position(&solver, index);
                    assert!(at[0].abs() < half_width, "the plate is long enough");
                    assert_near(name, 0.0005 * side, at[1], 1e-5);
                }
            }
        }
    }
}

#[test]
fn a_mesh_behind_a_slope_bounces_like_a_plane_behind_it() {
    // The particle falls into the corner of the slope and the ground, and hits both in one substep.
    let slope =
        "[[collider]]\nshape = \"plane\"\nnormal = [0.6, 0.8, 0]\noffset = 0\nrestitution = 0.5\n";
    let plane =
        "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0.001\nrestitution = 0.5\n";
    let mesh = Mesh::grid(3, 1.0).text() + "distance = 0.001\nrestitution = 0.5\n";
    let falling = "gravity = [0, 0, 0]\n".to_owned()
        + &rates(100, 1)
        + &particle([0.02, 0.02, 0.0], [-2.0, -4.0, 0.0])
        + slope;
    let [on_plane, on_mesh] =
        [plane, mesh.as_str()].map(|ground| velocity(&stepped(&(falling.clone() + ground), 1), 0));
    for axis in 0..3 {
        assert_near("velocity", on_plane[axis], on_mesh[axis], 1e-4);
    }
}

#[test]
fn a_particle_in_a_closed_mesh_stays_inside_and_one_outside_stays_outside() {
    let mut text = rates(240, 4);
    for number in 0..40 {
        let angle = f64::from(number);
        let (inside, outside) = (0.15, if number % 2 == 0 { 0.4 } else { 0.6 });
        for distance in [inside, outside] {
            let at = [distance * angle.cos(), 0.1, distance * angle.sin()];
            text += &particle(at, [-6.0 * at[0], 0.0, -6.0 * at[2]]);
        }
    }
    let text = text + &Mesh::ball(0.3, 12).text() + "restitution = 0.5\n";
    let mut solver = solver(&text);
    for _ in 0..240 {
        step(&mut solver, 1);
        for index in 0..80 {
            let [x, y, z] = position(&solver, index);
            let radius = (x * x + y * y + z * z).sqrt();
            if index % 2 == 0 {
                assert_at_most("inside", 0.3, radius);
            } else {
                assert!(radius > 0.3 * (1.0 - 0.02), "outside: {radius}");
            }
        }
    }
}

/// A chord between the corners of a ridge is the closest that a convex shape allows.
#[test]
fn a_mesh_of_a_box_holds_a_cloth_like_the_box() {
    let sheet = |collider: &str| {
        rates(240, 8)
            + "[[generate]]\nshape = \"cloth\"\ncolumns = 24\nrows = 24\nspacing = 0.04\n\
               origin = [-0.47, 0.36, -0.45]\ndown = [0, 0, 1]\npinned = \"none\"\nmass = 0.001\n"
            + collider
            + "friction = 0.4\n"
    };
    let mesh = Mesh::cuboid([0.3, 0.3, 0.3]).text();
    let solid =
        "[[collider]]\nshape = \"box\"\ncenter = [0, 0, 0]\nhalf_extents = [0.3, 0.3, 0.3]\n";
    let [mesh, solid] = [mesh, solid.to_owned()].map(|collider| stepped(&sheet(&collider), 480));
    let height = |solver: &Solver| {
        let sum: f64 = (0..solver.particle_count()).map(|index| position(solver, index)[1]).sum();
        sum / solver.particle_count() as f64
    };
    assert_near("mean height", height(&solid), height(&mesh), 5e-3);
    for one in particles(&mesh) {
        let depth = one.position.iter().map(|axis| 0.3 - axis.abs()).fold(f32::INFINITY, f32::min);
        assert_at_most("depth", 1e-6, depth.into());
    }
}

/// Every second triangle of the fan is a sliver, and some have no area at all.
#[test]
fn slivers_are_left_out_and_close_no_hole() {
    let mut vertices = vec![[0.0, 0.0, 0.0]];
    let mut faces = Vec::new();
    for number in 0..=24 {
        let angle = f64::from(number) * std::f64::consts::TAU / 24.0;
        vertices.push([angle.cos(), 0.0, angle.sin()]);
        vertices.push([(angle + 1e-7).cos(), 0.0, (angle + 1e-7).sin()]);
    }
    for number in 0..24_usize {
        let [a, b, c] = [1, 2, 3].map(|corner| 2 * number + corner);
        faces.extend([vec![0, c, b], vec![0, b, a]]);
    }
    vertices.push([0.5, 0.0, 0.0]);
    faces.push(vec![0, 1, vertices.len() - 1]);
    let mesh = Mesh { vertices, faces };
    let mut text = rates(240, 4);
    for number in 0..240 {
        let angle = f64::from(number) * std::f64::consts::TAU / 240.0;
        text += &particle([0.6 * angle.cos(), 0.2, 0.6 * angle.sin()], [0.0; 3]);
    }
    let text = text + &mesh.text();
    let scene = Scene::from_toml(&format!("version = 1\n{text}"), "test").unwrap();
    let expected = "collider[0]: 25 triangles are too narrow for a contact and omitted";
    assert!(
        sim_solver::warnings(&scene).iter().any(|one| one == expected),
        "{:?}",
        sim_solver::warnings(&scene)
    );
    let solver = stepped(&text, 240);
    for index in 0..240 {
        assert_near("height", 0.0, position(&solver, index)[1], 1e-5);
    }
}

#[test]
fn a_turned_and_shifted_mesh_moves_a_turned_and_shifted_cloth_alike() {
    let scene = |angle: f64, shift: [f64; 3]| {
        let vector = |one: [f64; 3]| format!("{:?}", turned(one, angle));
        let place = |one: [f64; 3]| {
            let at = turned(one, angle);
            format!("{:?}", [0, 1, 2].map(|axis| at[axis] + shift[axis]))
        };
        let half = angle / 2.0;
        format!("gravity = {}\n", vector([0.0, -9.81, 0.0]))
            + &rates(240, 8)
            + &format!(
                "[[generate]]\nshape = \"cloth\"\ncolumns = 9\nrows = 9\nspacing = 0.05\norigin = {}\n\
                 right = {}\ndown = [0, 0, 1]\npinned = \"none\"\nmass = 0.01\n",
                place([-0.2, 0.32, -0.19]),
                vector([1.0, 0.0, 0.0])
            )
            + &Mesh::ball(0.3, 8).text()
            + &format!(
                "distance = 0.005\nfriction = 0.5\ncenter = {}\nrotation = [0, 0, {}, {}]\n",
                place([0.0; 3]),
                half.sin(),
                half.cos()
            )
    };
    let shift = [0.25, -0.125, 0.5];
    let (straight, moved) = (stepped(&scene(0.0, [0.0; 3]), 24), stepped(&scene(0.7, shift), 24));
    for index in 0..81 {
        let at = turned(position(&straight, index), 0.7);
        for axis in 0..3 {
            assert_near("place", at[axis] + shift[axis], position(&moved, index)[axis], 1e-5);
        }
    }
}

#[test]
fn a_mesh_that_moves_carries_and_pushes_particles() {
    let mesh = Mesh::grid(9, 2.0).text() + "friction = 1\nvelocity = [0.5, 1, 0]\n";
    let solver = stepped(&(rates(240, 4) + &particle([-0.3, 0.001, 0.1], [0.0; 3]) + &mesh), 240);
    assert_near("lifted", 1.0, position(&solver, 0)[1], 2e-5);
    assert_near("carried", -0.3 + 0.5, position(&solver, 0)[0], 2e-2);
    assert_close("speed", 1.0, velocity(&solver, 0)[1], 1e-3);
    // A plate that sweeps through particles at 100 times its thickness in a substep.
    let plate =
        Mesh::cuboid([0.5, 0.0005, 0.5]).text() + "velocity = [0, 96, 0]\ncenter = [0, -1, 0]\n";
    let text =
        "gravity = [0, 0, 0]\n".to_owned() + &rates(240, 4) + &particle([0.1, 0.0, 0.1], [0.0; 3]);
    let solver = stepped(&(text + &plate), 10);
    assert_near("pushed", -1.0 + 4.0 + 0.0005, position(&solver, 0)[1], 1e-4);
}

/// The bowl turns upside down by a command: what lay in it is carried by its wall, then falls out.
#[test]
fn a_mesh_that_a_client_turns_loses_no_particle_through_its_wall() {
    let mut bowl = Mesh::ball(0.3, 10);
    // Only the lower half.
    bowl.faces.retain(|face| face.iter().all(|corner| bowl.vertices[*corner][1] < 0.05));
    let mut text = rates(240, 4);
    for number in 0..30 {
        let angle = f64::from(number);
        text += &particle([0.15 * angle.cos(), 0.0, 0.15 * angle.sin()], [0.0; 3]);
    }
    let mut solver = solver(&(text + &bowl.text() + "friction = 0.4\ndistance = 0.002\n"));
    step(&mut solver, 120);
    for turn in 0..=60_u8 {
        let half = f64::from(turn) / 60.0 * std::f64::consts::FRAC_PI_2;
        #[allow(clippy::cast_possible_truncation, reason = "a sine")]
        let rotation = [0.0, 0.0, half.sin() as f32, half.cos() as f32];
        solver.move_collider(0, Pose { translation: [0.0; 3], rotation }).unwrap();
        step(&mut solver, 1);
        for one in particles(&solver) {
            let [x, y, z] = one.position.map(f64::from);
            let radius = (x * x + y * y + z * z).sqrt();
            let [_, own_y, _] = turned([x, y, z], -2.0 * half);
            // Below the rim, on the inner side of the wall.
            assert!(own_y > -0.02 || radius < 0.3, "{radius} after {turn} parts of a turn");
        }
    }
}

/// A V of two slopes of 60 degrees, and a corner of three walls.
#[test]
fn a_particle_in_a_wedge_comes_to_rest_in_it() {
    let vertices = vec![
        [-0.5, 0.866, -1.0],
        [0.0, 0.0, -1.0],
        [0.5, 0.866, -1.0],
        [-0.5, 0.866, 1.0],
        [0.0, 0.0, 1.0],
        [0.5, 0.866, 1.0],
    ];
    let wedge = Mesh { vertices, faces: vec![vec![0, 1, 4, 3], vec![1, 2, 5, 4]] };
    let text = rates(240, 4) + &particle([0.1, 0.5, 0.0], [0.0, 0.0, 0.3]) + &wedge.text();
    let mut solver = solver(&text);
    step(&mut solver, 480);
    let [x, y, _] = position(&solver, 0);
    assert_near("bottom", 0.0, x.abs() + y, 3e-3);
    let [vx, vy, vz] = velocity(&solver, 0);
    assert_near("speed across", 0.0, vx.abs() + vy.abs(), 1e-3);
    assert_at_most("speed along", 0.3 + 1e-6, vz);
}

#[test]
fn a_contact_with_a_mesh_adds_no_energy() {
    let mut text = rates(240, 4);
    for number in 0..60 {
        let angle = 0.1 * f64::from(number);
        text += &particle([0.25 * angle.cos(), 0.5, 0.25 * angle.sin()], [0.4, 0.0, 0.0]);
    }
    let ball = Mesh::ball(0.3, 9).text() + "restitution = 1\n";
    let mut solver = solver(&(text + &ball));
    let energy = |solver: &Solver, index: usize| {
        let [x, y, z] = velocity(solver, index);
        0.5 * (x * x + y * y + z * z) + 9.81 * position(solver, index)[1]
    };
    let before: Vec<_> = (0..60).map(|index| energy(&solver, index)).collect();
    for _ in 0..240 {
        step(&mut solver, 1);
        for (index, before) in before.iter().enumerate() {
            assert_at_most("energy", before * (1.0 + 1e-2), energy(&solver, index));
        }
    }
}

/// Walls of 5 degrees leave no room at the bottom, whichever of them pushes last.
#[test]
fn a_particle_that_is_thrown_into_a_crevice_stays_between_its_walls() {
    let vertices = vec![
        [-0.0875, 1.0, -1.0],
        [0.0, 0.0, -1.0],
        [0.0875, 1.0, -1.0],
        [-0.0875, 1.0, 1.0],
        [0.0, 0.0, 1.0],
        [0.0875, 1.0, 1.0],
    ];
    let crevice = Mesh { vertices, faces: vec![vec![0, 1, 4, 3], vec![1, 2, 5, 4]] };
    for speed in [1.0, 20.0, 400.0] {
        let text =
            rates(240, 4) + &particle([0.02, 0.9, 0.0], [0.3, -speed, 0.0]) + &crevice.text();
        let mut solver = solver(&text);
        for _ in 0..480 {
            step(&mut solver, 1);
            let [x, y, _] = position(&solver, 0);
            assert!(x.abs() <= 0.0875 * y, "{speed} m/s: {x} at {y}");
        }
        assert_at_most("speed at rest", 1e-3, velocity(&solver, 0)[1].abs());
    }
}

#[test]
fn a_particle_rolls_off_the_border_of_an_open_mesh_at_its_distance() {
    let distance = 0.004;
    let text = rates(240, 8)
        + &particle([0.502, 0.02, 0.011], [0.0; 3])
        + &Mesh::grid(4, 1.0).text()
        + &format!("distance = {distance}\n");
    let mut solver = solver(&text);
    let mut nearest = f64::INFINITY;
    for _ in 0..120 {
        step(&mut solver, 1);
        let [x, y, _] = position(&solver, 0);
        nearest = nearest.min((x - 0.5).hypot(y));
    }
    assert_close("distance from the edge", distance, nearest, 1e-2);
    assert_at_most("height", -0.5, position(&solver, 0)[1]);
}
