//! The loop of a tutorial: particles as structs, sticks in the order of the grid, one step of many
//! passes. (In small steps of one pass its numbers are soon none.)

use glam::Vec3;

struct Particle {
    position: Vec3,
    previous: Vec3,
    inverse_mass: f32,
}

struct Stick {
    a: usize,
    b: usize,
    length: f32,
}

/// A sheet of particles and sticks.
pub(crate) struct Sheet {
    particles: Vec<Particle>,
    sticks: Vec<Stick>,
}

impl Sheet {
    pub(crate) fn new(columns: u32) -> Self {
        let spacing = 2.0 / (columns - 1) as f32;
        let count = columns as usize;
        let particles: Vec<_> = (0..count * count)
            .map(|index| {
                let (row, column) = (index / count, index % count);
                let position = Vec3::new(column as f32 * spacing, 0.0, row as f32 * spacing);
                let inverse_mass = if row == 0 { 0.0 } else { 1.0 };
                Particle { position, previous: position, inverse_mass }
            })
            .collect();
        let mut sheet = Self { particles, sticks: Vec::new() };
        for row in 0..count {
            for column in 0..count {
                let at = |down: usize, right: usize| (row + down) * count + column + right;
                let (has_right, has_down) = (column + 1 < count, row + 1 < count);
                if has_right {
                    sheet.join(at(0, 0), at(0, 1));
                }
                if has_down {
                    sheet.join(at(0, 0), at(1, 0));
                }
                if has_right && has_down {
                    sheet.join(at(0, 0), at(1, 1));
                    sheet.join(at(0, 1), at(1, 0));
                }
            }
        }
        sheet
    }

    fn join(&mut self, a: usize, b: usize) {
        let length = (self.particles[b].position - self.particles[a].position).length();
        self.sticks.push(Stick { a, b, length });
    }

    /// One frame of 1/60 s: Verlet, then the passes.
    pub(crate) fn step(&mut self, passes: u32) {
        let dt = 1.0 / 60.0;
        for particle in &mut self.particles {
            if particle.inverse_mass > 0.0 {
                let velocity = particle.position - particle.previous;
                particle.previous = particle.position;
                particle.position += velocity + Vec3::new(0.0, -9.81, 0.0) * dt * dt;
            }
        }
        for _ in 0..passes {
            for stick in &self.sticks {
                let way = self.particles[stick.b].position - self.particles[stick.a].position;
                let length = way.length();
                let sum =
                    self.particles[stick.a].inverse_mass + self.particles[stick.b].inverse_mass;
                if length == 0.0 || sum == 0.0 {
                    continue;
                }
                let push = way * ((length - stick.length) / (length * sum));
                let (w_a, w_b) =
                    (self.particles[stick.a].inverse_mass, self.particles[stick.b].inverse_mass);
                self.particles[stick.a].position += push * w_a;
                self.particles[stick.b].position -= push * w_b;
            }
        }
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.particles.iter().all(|particle| particle.position.is_finite())
    }
}
