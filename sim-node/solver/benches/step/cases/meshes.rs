//! Cost of colliders that are meshes: a sheet on a ball of triangles, open or solid, on the same ball as a sphere, and
//! without a collider.

use std::f64::consts::FRAC_PI_4;

use serde::Serialize;
use sim_solver::{Scene, Solver};

use crate::measures::clock::{cpu_ns, median};
use crate::options::Options;
use crate::report::{Report, Row};

/// Particles along a side of the sheet, and their distance in m.
const SIDE: u32 = 100;
const SPACING: f64 = 0.01;
const SUBSTEPS: u32 = 4;
/// Steps until the sheet lies on the ball, and steps that are measured.
const STEPS_BEFORE: u32 = 120;
const STEPS: u32 = 60;
/// Cells along a side of the balls: 2,028 triangles, 20,172, 99,372 and 199,692.
const CELLS: [usize; 4] = [13, 41, 91, 129];

/// A sheet on a mesh.
#[derive(Debug, Serialize)]
struct Meshes {
    case: String,
    triangles: usize,
    /// From the texts of the scene and the file to a solver.
    load_ms: f64,
    solid_load_ms: f64,
    /// Median over the steps, for each particle and substep.
    mesh_ns: f64,
    solid_ns: f64,
    sphere_ns: f64,
    free_ns: f64,
    /// Particles within 1 mm of their distance from the ball.
    touching: usize,
}

impl Row for Meshes {
    const HEADINGS: &'static [&'static str] = &[
        "triangles",
        "load: ms",
        "solid",
        "mesh: ns a particle and substep",
        "solid",
        "sphere",
        "no collider",
        "touching of 10,000",
    ];

    fn case(&self) -> &str {
        &self.case
    }

    fn cells(&self) -> Vec<String> {
        vec![
            self.triangles.to_string(),
            format!("{:.0}", self.load_ms),
            format!("{:.0}", self.solid_load_ms),
            format!("{:.1}", self.mesh_ns),
            format!("{:.1}", self.solid_ns),
            format!("{:.1}", self.sphere_ns),
            format!("{:.1}", self.free_ns),
            self.touching.to_string(),
        ]
    }
}

pub(crate) fn run(options: &Options, report: &mut Report) {
    for cells in CELLS {
        let triangles = 12 * cells * cells;
        let case = format!("meshes-{triangles}");
        if options.wants(&case) {
            report.push(&measure(case, cells));
        }
    }
}

fn measure(case: String, cells: usize) -> Meshes {
    let obj = ball(cells);
    let mesh =
        "[[collider]]\nfriction = 0.5\nshape = \"mesh\"\npath = \"ball.obj\"\ndistance = 0.002\n";
    let mesh = scene_text(mesh);
    let load = |text: &str| {
        let scene = Scene::from_toml_with_files(text, "bench", &|_| Ok(obj.clone()));
        Solver::new(&scene.unwrap())
    };
    let timed_load = |text: &str| {
        let mut solver = None;
        let load_ns = cpu_ns(|| solver = Some(load(text)));
        (solver.unwrap(), load_ns / 1e6)
    };
    let (mut solver, load_ms) = timed_load(&mesh);
    let (mut on_solid, solid_load_ms) = timed_load(&(mesh + "solid = true\n"));
    let sphere =
        "[[collider]]\nfriction = 0.5\nshape = \"sphere\"\nradius = 0.302\ncenter = [0, 0, 0]\n";
    let [mut on_sphere, mut free] = [sphere, ""]
        .map(|collider| Solver::new(&Scene::from_toml(&scene_text(collider), "bench").unwrap()));
    let solvers = [&mut solver, &mut on_solid, &mut on_sphere, &mut free];
    let [mesh_ns, solid_ns, sphere_ns, free_ns] = solvers.map(|solver| {
        (0..STEPS_BEFORE).for_each(|_| solver.step());
        let times = (0..STEPS).map(|_| cpu_ns(|| solver.step())).collect();
        median(times) / f64::from(SUBSTEPS * SIDE * SIDE)
    });
    let is_touching = |at: [f32; 3]| at.iter().map(|axis| axis * axis).sum::<f32>().sqrt() < 0.303;
    Meshes {
        case,
        triangles: 12 * cells * cells,
        load_ms,
        solid_load_ms,
        mesh_ns,
        solid_ns,
        sphere_ns,
        free_ns,
        touching: solver.particles().iter().filter(|one| is_touching(one.position)).count(),
    }
}

fn scene_text(collider: &str) -> String {
    let corner = -0.5 * f64::from(SIDE - 1) * SPACING;
    format!(
        "version = 1\n[solver]\nrate_hz = 240\nsubsteps = {SUBSTEPS}\n[[generate]]\nshape = \"cloth\"\n\
         columns = {SIDE}\nrows = {SIDE}\nspacing = {SPACING}\norigin = [{corner}, 0.31, {corner}]\n\
         down = [0, 0, 1]\nmass = 0.0001\npinned = \"none\"\n{collider}"
    )
}

/// Returns the OBJ text of a ball with a radius of 0.3 m: the six sides of a cube, each of `cells` x `cells`
/// cells of two triangles, pushed out to the ball.
fn ball(cells: usize) -> String {
    let (mut vertices, mut faces) = (String::new(), String::new());
    let row = cells + 1;
    for side in 0..6 {
        let (axis, sign) = (side / 2, if side % 2 == 0 { 1.0 } else { -1.0 });
        for place in 0..row * row {
            // Equal angles make cells of nearly equal size.
            let at = |index: usize| (FRAC_PI_4 * (2.0 * index as f64 / cells as f64 - 1.0)).tan();
            let mut point = [sign; 3];
            (point[(axis + 1) % 3], point[(axis + 2) % 3]) = (at(place % row), at(place / row));
            let length = point.iter().map(|one| one * one).sum::<f64>().sqrt();
            let [x, y, z] = point.map(|one| 0.3 * one / length);
            vertices += &format!("v {x:.6} {y:.6} {z:.6}\n");
            if place % row < cells && place / row < cells {
                let [a, b, c, d] =
                    [0, 1, row + 1, row].map(|step| side * row * row + place + step + 1);
                // Counterclockwise from outside.
                let [b, d] = if side % 2 == 0 { [b, d] } else { [d, b] };
                faces += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
            }
        }
    }
    vertices + &faces
}
