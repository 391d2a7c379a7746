//! The same falling cloths in this solver and in rapier3d: cost, and how often a cloth crosses itself.
//!
//! `cargo run --release --manifest-path tests/rapier/Cargo.toml`

#[path = "../../../sim-node/solver/tests/physics/contacts/crossings.rs"]
mod crossings;

use std::time::Instant;

use rapier3d::prelude::{ColliderBuilder, PhysicsWorld, SoftBodyBuilder, SoftBodyHandle, Vector};
use sim_solver::{Scene, Solver};

/// Particles on a side of the sheet.
const SIDE: u32 = 32;
/// Distance of neighbours in m, which is also the contact distance.
const SPACING: f32 = 0.02;
const RATE_HZ: u32 = 60;
const SECONDS: u32 = 3;

/// A falling sheet: its first corner, and the directions of its rows and columns.
struct Fall {
    name: &'static str,
    origin: [f32; 3],
    right: [f32; 3],
    down: [f32; 3],
    has_ball: bool,
}

const LENGTH: f32 = (SIDE - 1) as f32 * SPACING;

const FALLS: [Fall; 2] = [
    Fall {
        name: "ball",
        origin: [-LENGTH / 2.0, 0.5, -LENGTH / 2.0],
        right: [1.0, 0.0, 0.0],
        down: [0.0, 0.0, 1.0],
        has_ball: true,
    },
    // On its edge, a little inclined.
    Fall {
        name: "heap",
        origin: [0.0, LENGTH + 0.01, 0.0],
        right: [1.0, 0.0, 0.01],
        down: [0.02, -1.0, 0.01],
        has_ball: false,
    },
];

/// An engine with a sheet.
trait Engine {
    fn step(&mut self);
    fn positions(&self) -> Vec<[f64; 3]>;
}

impl Engine for Solver {
    fn step(&mut self) {
        Solver::step(self);
    }

    fn positions(&self) -> Vec<[f64; 3]> {
        self.particles().iter().map(|one| one.position.map(f64::from)).collect()
    }
}

fn ours(fall: &Fall, substeps: u32, mode: &str) -> Solver {
    let ball =
        "[[collider]]\nshape = \"sphere\"\ncenter = [0, 0.15, 0]\nradius = 0.16\nfriction = 0.3\n";
    let Fall { origin, right, down, .. } = fall;
    let text = format!(
        "version = 1\n[solver]\nrate_hz = {RATE_HZ}\nsubsteps = {substeps}\n[contact]\nmode = \"{mode}\"\n\
         [[generate]]\nshape = \"mesh\"\ncolumns = {SIDE}\nrows = {SIDE}\nspacing = {SPACING}\nmass = 0.001\n\
         compliance = {{ bend = 1e-3 }}\norigin = {origin:?}\nright = {right:?}\ndown = {down:?}\n{}\
         [[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0.01\nfriction = 0.3\n",
        if fall.has_ball { ball } else { "" }
    );
    Solver::new(&Scene::from_toml(&text, "benchmark").expect("the scene is valid"))
}

struct Rapier {
    world: PhysicsWorld,
    cloth: SoftBodyHandle,
}

impl Engine for Rapier {
    fn step(&mut self) {
        self.world.step();
    }

    fn positions(&self) -> Vec<[f64; 3]> {
        let cloth = self.world.soft_bodies.get(self.cloth).expect("the cloth is there");
        cloth.particle_positions().map(|at| [at.x, at.y, at.z].map(f64::from)).collect()
    }
}

fn rapier(fall: &Fall, substeps: u32, has_self_contacts: bool) -> Rapier {
    let vector = |[x, y, z]: [f32; 3]| Vector::new(x, y, z);
    let along = |direction| vector(direction).normalize() * SPACING;
    let mut world = PhysicsWorld::new();
    world.integration_parameters.dt = 1.0 / RATE_HZ as f32;
    world.integration_parameters.num_solver_iterations = substeps as usize;
    // Particles have the radius of half of the contact distance there.
    let ground = ColliderBuilder::cuboid(5.0, 1.0, 5.0).translation(-Vector::Y).friction(0.3);
    world.insert_collider(ground, None);
    if fall.has_ball {
        let ball = ColliderBuilder::ball(0.15).translation(Vector::Y * 0.15).friction(0.3);
        world.insert_collider(ball, None);
    }
    let side = SIDE as usize;
    let cloth = SoftBodyBuilder::cloth(
        vector(fall.origin),
        along(fall.down),
        along(fall.right),
        side,
        side,
    )
    .particle_mass(0.001)
    .self_contacts(has_self_contacts)
    .surface_collider(ColliderBuilder::default().friction(0.3))
    .can_sleep(false);
    let cloth = world.insert_soft_body(cloth);
    Rapier { world, cloth }
}

/// Result of a run.
struct Run {
    /// Median time of a particle and substep.
    cost_ns: f64,
    /// Most crossings at any tenth of a second, and at the end.
    worst: usize,
    end: usize,
}

#[allow(clippy::disallowed_methods, reason = "a benchmark reads the clock")]
fn run(engine: &mut dyn Engine, substeps: u32) -> Run {
    let (edges, triangles) = grid();
    let (mut times_ns, mut worst, mut end) = (Vec::new(), 0, 0);
    for step in 0..SECONDS * RATE_HZ {
        let start = Instant::now();
        engine.step();
        // In free fall, there are no contacts.
        if step > RATE_HZ / 4 {
            times_ns.push(start.elapsed().as_secs_f64() * 1e9);
        }
        if step % (RATE_HZ / 10) == 0 {
            end = crossings::count(&engine.positions(), &edges, &triangles);
            worst = worst.max(end);
        }
    }
    times_ns.sort_by(f64::total_cmp);
    let cost_ns = times_ns[times_ns.len() / 2] / f64::from(SIDE * SIDE * substeps);
    Run { cost_ns, worst, end }
}

/// The structural edges of a sheet in rows, and its triangles.
fn grid() -> (Vec<[u32; 2]>, Vec<[u32; 3]>) {
    let at = |row: u32, column: u32| SIDE * row + column;
    let (mut edges, mut triangles) = (Vec::new(), Vec::new());
    for (row, column) in (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| (row, column))) {
        let (has_right, has_below) = (column + 1 < SIDE, row + 1 < SIDE);
        if has_right {
            edges.push([at(row, column), at(row, column + 1)]);
        }
        if has_below {
            edges.push([at(row, column), at(row + 1, column)]);
        }
        if has_right && has_below {
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
            triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    (edges, triangles)
}

fn main() {
    println!(
        "| cloth of {SIDE} x {SIDE}, {RATE_HZ} Hz | engine | ns a particle and substep | most crossings | at the end |"
    );
    println!("| --- | --- | ---: | ---: | ---: |");
    for fall in &FALLS {
        for substeps in [4, 16] {
            let mut engines: [(&str, Box<dyn Engine>); 4] = [
                ("particles", Box::new(ours(fall, substeps, "particles"))),
                ("surfaces", Box::new(ours(fall, substeps, "surfaces"))),
                ("rapier3d without self-contacts", Box::new(rapier(fall, substeps, false))),
                ("rapier3d", Box::new(rapier(fall, substeps, true))),
            ];
            for (name, engine) in &mut engines {
                let Run { cost_ns, worst, end } = run(engine.as_mut(), substeps);
                let scene = format!("{}, {substeps} substeps", fall.name);
                println!("| {scene} | {name} | {cost_ns:.1} | {worst} | {end} |");
            }
        }
    }
}
