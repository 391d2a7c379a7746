//! Solid meshes: against boxes, whose law is known, and against the distance from outlines.

use sim_solver::{BodyMotion, Keyframe, Pose, Solver};

use super::mesh::Mesh;
use crate::physics::{
    assert_at_most, assert_near, particles, position, rates, solver, step, stepped, velocity,
};

const NO_GRAVITY: &str = "gravity = [0, 0, 0]\n";

/// A prism around z, whose outline is a star with deep notches.
struct Star {
    outline: Vec<[f64; 2]>,
    half_depth: f64,
}

impl Star {
    fn new() -> Self {
        let corner = |index: u32| {
            let angle = std::f64::consts::PI * f64::from(index) / 5.0 + 0.1;
            let radius = if index.is_multiple_of(2) { 0.5 } else { 0.15 };
            [radius * angle.cos(), radius * angle.sin()]
        };
        Self { outline: (0..10).map(corner).collect(), half_depth: 0.2 }
    }

    fn mesh(&self) -> Mesh {
        let Self { outline, half_depth } = self;
        let count = outline.len();
        let at = |z: f64| outline.iter().map(move |[x, y]| [*x, *y, z]);
        let mut vertices: Vec<_> = at(*half_depth).chain(at(-half_depth)).collect();
        vertices.extend([[0.0, 0.0, *half_depth], [0.0, 0.0, -half_depth]]);
        let (front, back) = (2 * count, 2 * count + 1);
        let mut faces = Vec::new();
        for index in 0..count {
            let next = (index + 1) % count;
            faces.push(vec![front, index, next]);
            faces.push(vec![back, count + next, count + index]);
            faces.push(vec![index, count + index, count + next, next]);
        }
        Mesh { vertices, faces }
    }

    /// Distance of a point from the surface; negative inside.
    fn height(&self, [x, y, z]: [f64; 3]) -> f64 {
        let Self { outline, half_depth } = self;
        let (mut is_inside, mut beside) = (false, f64::INFINITY);
        for (index, [ax, ay]) in outline.iter().enumerate() {
            let [bx, by] = outline[(index + 1) % outline.len()];
            let (ex, ey) = (bx - ax, by - ay);
            let share = (((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey)).clamp(0.0, 1.0);
            beside = beside.min((x - ax - share * ex).hypot(y - ay - share * ey));
            // A ray along x crosses the edge.
            if (*ay > y) != (by > y) && x < ax + (y - ay) / ey * ex {
                is_inside = !is_inside;
            }
        }
        let beside = if is_inside { -beside } else { beside };
        let above = z.abs() - half_depth;
        if beside > 0.0 && above > 0.0 { beside.hypot(above) } else { beside.max(above) }
    }
}

fn particle(position: [f64; 3]) -> String {
    format!("[[particle]]\nposition = {position:?}\n")
}

/// Points in a box around the origin, from the fractions of multiples of irrational numbers.
fn points(count: u32, half: [f64; 3]) -> Vec<[f64; 3]> {
    let along = |index: u32, step: f64| 2.0 * (f64::from(index) * step).fract() - 1.0;
    let steps = [0.819_172_513, 0.671_043_607, 0.549_700_478];
    (1..=count).map(|index| [0, 1, 2].map(|axis| half[axis] * along(index, steps[axis]))).collect()
}

#[test]
fn particles_inside_a_star_leave_it_at_the_nearest_point_and_others_do_not_move() {
    let star = Star::new();
    let starts: Vec<_> = points(3000, [0.55, 0.55, 0.25])
        .into_iter()
        .filter(|start| star.height(*start).abs() > 1e-4)
        .collect();
    let particles: String = starts.iter().map(|start| particle(*start)).collect();
    let text = NO_GRAVITY.to_owned() + &rates(240, 1) + &particles + &star.mesh().text();
    let solver = stepped(&(text + "solid = true\n"), 1);
    let mut inside_count = 0;
    for (start, index) in starts.iter().zip(0..) {
        let (end, height) = (position(&solver, index), star.height(*start));
        let moved: f64 = (0..3).map(|axis| (end[axis] - start[axis]).powi(2)).sum();
        if height > 0.0 {
            assert_at_most("outside, moved", 1e-12, moved);
        } else {
            inside_count += 1;
            assert_near("way out", -height, moved.sqrt(), 2e-5);
            assert_near("height", 0.0, star.height(end), 2e-5);
        }
        let speed = velocity(&solver, index).iter().map(|axis| axis.abs()).sum();
        assert_at_most("speed", 1e-12, speed);
    }
    assert!(inside_count > 400, "{inside_count}");
}

#[test]
fn a_solid_mesh_of_a_box_pushes_out_what_is_inside_like_the_box() {
    let half = [0.5, 0.3, 0.4];
    let starts: Vec<_> = points(200, half);
    let text = |collider: &str| {
        let particles: String = starts.iter().map(|start| particle(*start)).collect();
        rates(240, 4)
            + &particles
            + collider
            + "friction = 0.4\nrestitution = 0.3\n\
            velocity = [0.2, 0.1, -0.3]\nangular_velocity = [0.5, 1, -0.7]\n"
    };
    let mesh = text(&(Mesh::cuboid(half).text() + "solid = true\n"));
    let solid = text(&format!(
        "[[collider]]\nshape = \"box\"\ncenter = [0, 0, 0]\nhalf_extents = {half:?}\n"
    ));
    let [mesh, solid] = [mesh, solid].map(|text| stepped(&text, 1));
    for index in 0..starts.len() {
        for axis in 0..3 {
            let [of_mesh, of_box] = [&mesh, &solid].map(|one| position(one, index)[axis]);
            assert_near("position", of_box, of_mesh, 1e-5);
            let [of_mesh, of_box] = [&mesh, &solid].map(|one| velocity(one, index)[axis]);
            assert_near("velocity", of_box, of_mesh, 1e-3);
        }
    }
}

#[test]
fn particles_end_at_the_distance_of_the_solid_that_they_leave() {
    let star = Star::new();
    let starts = points(500, [0.3, 0.3, 0.15]);
    let particles: String = starts.iter().map(|start| particle(*start)).collect();
    let text = NO_GRAVITY.to_owned() + &rates(240, 1) + &particles + &star.mesh().text();
    let solver = stepped(&(text + "solid = true\ndistance = 0.01\n"), 2);
    for (index, start) in starts.iter().enumerate() {
        assert!(star.height(position(&solver, index)) > 0.01 - 1e-5, "{start:?}");
    }
}

/// A sheet around a ball: it starts in its middle.
fn sheet_through_ball(keys: &str) -> String {
    sheet_through(&Mesh::ball(0.25, 10), keys)
}

fn sheet_through(mesh: &Mesh, keys: &str) -> String {
    rates(240, 4)
        + "[[generate]]\nshape = \"cloth\"\ncolumns = 30\nrows = 30\nspacing = 0.03\nmass = 0.001\n\
           origin = [-0.43, 0.02, -0.44]\ndown = [0, 0, 1]\npinned = \"none\"\n"
        + &mesh.text()
        + "friction = 0.3\n"
        + keys
}

#[test]
fn a_cloth_that_starts_in_a_solid_comes_to_lie_on_it() {
    let solver = stepped(&sheet_through_ball("solid = true\n"), 480);
    let least = |solver: &Solver| {
        let radius = |index| position(solver, index).iter().map(|axis| axis * axis).sum::<f64>();
        (0..solver.particle_count()).map(radius).fold(f64::INFINITY, f64::min).sqrt()
    };
    // The faces are inside of the ball by up to 2.5 %.
    assert!(least(&solver) > 0.25 * 0.97, "{}", least(&solver));
    let open = stepped(&sheet_through_ball(""), 480);
    assert!(least(&open) < 0.2, "an open mesh keeps it inside");
}

#[test]
fn a_cloth_outside_a_solid_has_the_same_bits_as_on_an_open_mesh() {
    let above =
        |mesh: &Mesh, keys: &str| sheet_through(mesh, keys).replace("0.02, -0.44", "0.3, -0.44");
    let mut ball = Mesh::ball(0.25, 10);
    for _ in 0..2 {
        let [open, solid] = ["", "solid = true\n"].map(|keys| stepped(&above(&ball, keys), 240));
        assert_eq!(open.state_hash(), solid.state_hash());
        // The same mesh, facing inwards.
        for face in &mut ball.faces {
            face.reverse();
        }
    }
}

/// Lists of triangles are no state, and neither is the side on which a particle is.
#[test]
fn a_restored_state_in_a_solid_goes_on_with_the_same_bits() {
    let keys = "solid = true\nvelocity = [0, 2, 0]\nangular_velocity = [0, 1, 1]\n";
    assert_restores(&sheet_through_ball(keys));
}

fn assert_restores(text: &str) {
    let mut solver = stepped(text, 3);
    let mut copy = crate::physics::solver(text);
    for steps in [1, 5, 40] {
        let keyframe = Keyframe::decode(&solver.keyframe().encode()).unwrap();
        copy.restore(&particles(&solver).collect::<Vec<_>>(), &keyframe).unwrap();
        step(&mut solver, steps);
        step(&mut copy, steps);
        assert_eq!(solver.state_hash(), copy.state_hash());
    }
}

#[test]
fn the_order_of_the_corners_of_all_faces_does_not_matter() {
    let ball = Mesh::ball(0.25, 10);
    let mut turned_over = Mesh { vertices: ball.vertices.clone(), faces: ball.faces.clone() };
    for face in &mut turned_over.faces {
        face.reverse();
    }
    let [one, other] = [ball, turned_over].map(|mesh| {
        let text = NO_GRAVITY.to_owned()
            + &rates(240, 1)
            + &particle([0.1, 0.02, 0.03])
            + &mesh.text()
            + "solid = true\n";
        let mut solver = solver(&text);
        step(&mut solver, 1);
        position(&solver, 0)
    });
    assert!(one[0] > 0.2, "it stays inside: {one:?}");
    for axis in 0..3 {
        assert_near("position", one[axis], other[axis], 1e-3);
    }
}

/// At 1e-9 m, the direction from the nearest point is rounding.
#[test]
fn a_particle_just_below_a_face_leaves_along_its_normal() {
    let (half, distance) = (1.0, 0.01);
    for exponent in 3..10 {
        let depth = 10_f64.powi(-exponent);
        let text = NO_GRAVITY.to_owned()
            + &rates(240, 1)
            + &particle([0.3, half - depth, 0.2])
            + &Mesh::cuboid([half; 3]).text()
            + &format!("solid = true\ndistance = {distance}\n");
        let solver = stepped(&text, 1);
        let [x, y, z] = position(&solver, 0);
        assert_near("height", half + distance, y, 1e-6);
        assert_near("beside", 0.0, (x - 0.3).hypot(z - 0.2), 1e-6);
    }
}

/// Cubes that overlap, which have no clear inside where they do.
fn overlapping_cubes() -> Mesh {
    let mut mesh = Mesh::cuboid([0.3, 0.3, 0.3]);
    let second = Mesh::cuboid([0.3, 0.15, 0.15]);
    mesh.vertices.extend(second.vertices.iter().map(|[x, y, z]| [x + 0.3, *y, *z]));
    mesh.faces.extend(second.faces.iter().map(|face| face.iter().map(|one| one + 8).collect()));
    mesh
}

#[test]
fn surfaces_that_intersect_themselves_keep_the_bits_of_restored_states() {
    let text = sheet_through(&overlapping_cubes(), "solid = true\nvelocity = [0.4, 0.2, 0]\n");
    assert_restores(&text);
}

/// A solid and an open mesh near the same particles, whose lists of triangles share their places.
#[test]
fn an_open_mesh_beside_a_solid_stops_what_leaves_the_solid() {
    let grid = Mesh::grid(4, 3.0).text() + "center = [0, 0.008, 0]\n";
    let block = Mesh::cuboid([1.0; 3]).text() + "solid = true\ncenter = [0, -0.995, 0]\n";
    let moving = "[[particle]]\nposition = [0.1, 0, 0.2]\nvelocity = [0, 2.4, 0]\n";
    let text = NO_GRAVITY.to_owned() + &rates(240, 1) + moving + &block + &grid;
    let mut solver = solver(&text);
    for _ in 0..10 {
        step(&mut solver, 1);
        assert_at_most("height", 0.008, position(&solver, 0)[1]);
    }
    assert_restores(&(sheet_through_ball("solid = true\n") + &Mesh::grid(3, 3.0).text()));
}

#[test]
fn a_driven_solid_and_a_particle_inside_part() {
    let text = NO_GRAVITY.to_owned()
        + &rates(240, 4)
        + "[[particle]]\nposition = [0.02, 0.28, 0.05]\nmass = 0.1\n"
        + &Mesh::cuboid([0.3; 3]).text()
        + "solid = true\nbody = { mass = 2, inertia = [0.1, 0.1, 0.1] }\n";
    let mut solver = solver(&text);
    solver
        .drive_body(
            0,
            Pose { translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] },
            &BodyMotion::default(),
        )
        .unwrap();
    step(&mut solver, 1);
    assert_near("height", 0.3, position(&solver, 0)[1], 0.002);
    let speed = velocity(&solver, 0).iter().map(|axis| axis.abs()).sum();
    assert_at_most("speed", 1e-6, speed);
}

/// By the law of an elastic collision with a body of 20 times the mass.
#[test]
fn a_particle_bounces_off_a_driven_mesh_open_or_solid() {
    for keys in ["", "solid = true\n"] {
        for distance in [0.0, 0.01] {
            let text = NO_GRAVITY.to_owned()
                + &rates(240, 4)
                + "[[particle]]\nposition = [0, 0.4, 0]\nvelocity = [0, -3, 0]\nmass = 0.1\n"
                + &Mesh::cuboid([0.3; 3]).text()
                + &format!("restitution = 1\ndistance = {distance}\n{keys}")
                + "body = { mass = 2, inertia = [0.1, 0.1, 0.1] }\n";
            let mut solver = solver(&text);
            let pose = Pose { translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] };
            for _ in 0..12 {
                solver.drive_body(0, pose, &BodyMotion::default()).unwrap();
                step(&mut solver, 1);
            }
            assert_near("speed", 3.0 * (2.0 - 0.1) / (2.0 + 0.1), velocity(&solver, 0)[1], 1e-3);
        }
    }
}
