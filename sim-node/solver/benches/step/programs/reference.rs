//! Reference motion of a sheet: the same method in f64 with 256 substeps, plain and slow, without any
//! code of the solver.

use crate::scenes::sheet::{RATE_HZ, SIDE, Sheet, Start};

/// Substeps of a frame.
const SUBSTEPS: u32 = 256;
const GRAVITY: f64 = -9.81;

struct Particle {
    position: [f64; 3],
    velocity: [f64; 3],
    /// Displacement d of the current substep.
    displacement: [f64; 3],
    /// 1, or 0 if pinned.
    inverse_mass: f64,
}

struct Link {
    a: usize,
    b: usize,
    length: f64,
}

/// Returns the positions of a sheet after some frames. Its own substeps and tethers are ignored.
pub(crate) fn positions(sheet: &Sheet, frames: u32) -> Vec<[f64; 3]> {
    let mut particles = particles(sheet);
    let links = links(sheet.columns as usize);
    let h = 1.0 / f64::from(RATE_HZ * SUBSTEPS);
    for _ in 0..frames * SUBSTEPS {
        substep(&mut particles, &links, h);
    }
    particles.iter().map(|particle| particle.position).collect()
}

fn particles(sheet: &Sheet) -> Vec<Particle> {
    let columns = sheet.columns as usize;
    let spacing = SIDE / (columns - 1) as f64;
    let particle = |index: usize| {
        let (row, column) = (index / columns, index % columns);
        let (right, down) = (column as f64 * spacing, row as f64 * spacing);
        let is_end = column == 0 || column + 1 == columns;
        let is_pinned = row == 0 && (sheet.start != Start::Corners || is_end);
        Particle {
            position: if sheet.start == Start::Hang {
                [right, -down, 0.0]
            } else {
                [right, 0.0, down]
            },
            velocity: [0.0; 3],
            displacement: [0.0; 3],
            inverse_mass: if is_pinned { 0.0 } else { 1.0 },
        }
    };
    (0..columns * columns).map(particle).collect()
}

/// Families of links in the order of projection, each as (row, column) of its two ends relative to the
/// first particle: vertical, horizontal, diagonal to the right, diagonal to the left.
const FAMILIES: [[(usize, usize); 2]; 4] =
    [[(0, 0), (1, 0)], [(0, 0), (0, 1)], [(0, 0), (1, 1)], [(0, 1), (1, 0)]];

/// Returns the links family by family, each with its even and then its odd half. Rows decide the half,
/// or columns if a link stays in its row, so that no two links of a half share a particle.
fn links(columns: usize) -> Vec<Link> {
    let spacing = SIDE / (columns - 1) as f64;
    let mut links = Vec::new();
    for [a, b] in FAMILIES {
        let (down, across) = (a.0.abs_diff(b.0), a.1.abs_diff(b.1));
        let length = spacing * ((down + across) as f64).sqrt();
        for half in 0..2 {
            let begins = (0..columns * columns).map(|index| (index / columns, index % columns));
            let of_half = begins.filter(|(row, column)| {
                let is_inside = row + down < columns && column + across < columns;
                is_inside && (if down == 0 { column } else { row }) % 2 == half
            });
            links.extend(of_half.map(|(row, column)| {
                let at = |end: (usize, usize)| (row + end.0) * columns + column + end.1;
                Link { a: at(a), b: at(b), length }
            }));
        }
    }
    links
}

/// Applies semi-implicit Euler to v, projects the links on d = h v, then sets x += d and v = d / h.
fn substep(particles: &mut [Particle], links: &[Link], h: f64) {
    for particle in particles.iter_mut().filter(|particle| particle.inverse_mass > 0.0) {
        particle.velocity[1] += h * GRAVITY;
        particle.displacement = particle.velocity.map(|axis| h * axis);
    }
    for link in links {
        project(particles, link);
    }
    for particle in particles {
        for axis in 0..3 {
            particle.position[axis] += particle.displacement[axis];
            particle.velocity[axis] = particle.displacement[axis] / h;
        }
    }
}

/// C = |r| - L, r = `x_b` - `x_a` + `d_b` - `d_a`, lambda = -C / (`w_a` + `w_b`): the ends move by
/// w lambda along r / |r| (Position Based Dynamics: Mueller et al. 2007, 3.3).
fn project(particles: &mut [Particle], link: &Link) {
    let (a, b) = (&particles[link.a], &particles[link.b]);
    let (w_a, w_b) = (a.inverse_mass, b.inverse_mass);
    if w_a + w_b == 0.0 {
        return;
    }
    let r = [0, 1, 2].map(|axis| {
        b.position[axis] - a.position[axis] + (b.displacement[axis] - a.displacement[axis])
    });
    let length = (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt();
    let scale = (link.length - length) / ((w_a + w_b) * length);
    for (axis, along) in r.iter().enumerate() {
        particles[link.a].displacement[axis] -= w_a * scale * along;
        particles[link.b].displacement[axis] += w_b * scale * along;
    }
}
