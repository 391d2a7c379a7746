//! Bends: resistance of ropes, sheets and meshes to curvature.

pub mod families;
pub(crate) mod hinge;

use glam::Vec3;

/// A bend of three or four particles.
///
/// C is the sum of c x over its particles: a vector, 0 where they lie straight, because the sum of the
/// coefficients c is 0. The energy is |C|^2 / (2 alpha), where alpha = `geometry` / `rigidity`.
///
/// - Second difference: C = `x_a` - 2 `x_b` + `x_c`. On a sheet with the distances `s_x` along the bend
///   and `s_y` across it, the curvature is |C| / `s_x`^2 and the area of a node `s_x` `s_y`, so
///   alpha = `s_x`^3 / (`s_y` B). On a rope alpha = s^3 / EI.
/// - Twist of a cell: C = `x_a` - `x_b` - `x_c` + `x_d`, alpha = `s_x` `s_y` / (2 B). With it, the energy
///   of a cylinder is the same in every direction.
/// - Hinge of two triangles: see [`BendShape::Hinge`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bend {
    /// Indices of the particles. The fourth of a bend of three is its second one again.
    pub particles: [u32; 4],
    /// Coefficients c. The fourth of a bend of three is 0.
    pub coefficients: [f32; 4],
    /// Compliance alpha times rigidity: m^2 on a surface, m^3 on a line.
    pub geometry: f32,
    /// Bending rigidity >= 0: B in N m on a surface, EI in N m^2 on a line.
    pub rigidity: f32,
    /// Arrangement of the particles.
    pub shape: BendShape,
    /// Index of the generated block that it comes from. None for an explicit bend.
    pub block: Option<u32>,
}

/// Arrangement of the particles of a bend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BendShape {
    /// Three neighbours on a line.
    Line,
    /// The corners of a cell: two above, two below.
    Cell,
    /// A third corner, the ends of an edge, and the other third corner of two triangles with that edge.
    ///
    /// For every fold by an angle t that keeps the triangles, C lies along the sum n of their unit normals
    /// and has the size |e| 2 sin(t / 2), where |e| is the length of the edge. With a rest value, C - rest
    /// n / |n| takes the place of C.
    Hinge {
        /// C along n at rest, in m; 0 for a flat hinge. Its sign is the sign of the fold angle.
        rest: f32,
        /// Area of the first triangle / area of the second.
        area_ratio: f32,
    },
}

impl BendShape {
    /// Returns its number in the messages of a node: 0 line, 1 cell, 2 hinge.
    pub const fn number(self) -> u32 {
        match self {
            Self::Line => 0,
            Self::Cell => 1,
            Self::Hinge { .. } => 2,
        }
    }

    /// Returns the rest value in m. Other than 0 only for a hinge that is folded at rest.
    pub const fn rest(self) -> f32 {
        match self {
            Self::Line | Self::Cell => 0.0,
            Self::Hinge { rest, .. } => rest,
        }
    }
}

/// Shape in which hinges are at rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RestShape {
    /// Both triangles in a plane.
    Flat,
    /// The shape at load.
    Loaded,
}

/// Coefficients of a second difference.
pub const SECOND_DIFFERENCE: [f32; 4] = [1.0, -2.0, 1.0, 0.0];
/// Coefficients of the twist of a cell. Its first and last corner are opposite.
pub const TWIST: [f32; 4] = [1.0, -1.0, -1.0, 1.0];

impl Bend {
    /// Bend of three particles on a line, with the rigidity EI. With the lengths `l_1` and `l_2` of its
    /// parts and their mean s, C = s (`x_a` - `x_b`) / `l_1` + s (`x_c` - `x_b`) / `l_2`, whose size is
    /// s^2 times the curvature. With equal parts it is the second difference.
    pub(crate) fn on_line(particles: [u32; 3], positions: [[f32; 3]; 3], rigidity: f32) -> Self {
        let [a, b, c] = positions.map(|one| Vec3::from_array(one).as_dvec3());
        let (first, second) = (a.distance(b), b.distance(c));
        let mean = f64::midpoint(first, second);
        let sum = round(mean / first + mean / second);
        // The greater one is at least half of the sum, so the difference has no rounding: the sum of all
        // coefficients is exactly 0, and so is the sum of the forces.
        let greater = round(mean / first.min(second));
        let (c_a, c_c) =
            if first < second { (greater, sum - greater) } else { (sum - greater, greater) };
        let [a, b, c] = particles;
        Self {
            particles: [a, b, c, b],
            coefficients: [c_a, -sum, c_c, 0.0],
            geometry: round(mean * mean * mean),
            rigidity,
            shape: BendShape::Line,
            block: None,
        }
    }

    /// Twist of a cell with the rigidity B. The second and third corner are next to the first.
    pub(crate) fn of_cell(particles: [u32; 4], positions: [[f32; 3]; 4], rigidity: f32) -> Self {
        let [a, b, c, _] = positions.map(|one| Vec3::from_array(one).as_dvec3());
        let area = (b - a).cross(c - a).length();
        let geometry = round(area / 2.0);
        let shape = BendShape::Cell;
        Self { particles, coefficients: TWIST, geometry, rigidity, shape, block: None }
    }

    /// The sides that form the path of a bend: neighbours on a line, the sides of a cell, or the sides of two
    /// triangles.
    pub(crate) fn path(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let sides: &[[usize; 2]] = match self.shape {
            BendShape::Line => &[[0, 1], [1, 2]],
            BendShape::Cell => &[[0, 1], [0, 2], [1, 3], [2, 3]],
            BendShape::Hinge { .. } => &[[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]],
        };
        let particles = self.particles;
        sides.iter().map(move |ends| ends.map(|end| particles[end]))
    }

    /// Compliance over h^2 in 1/kg. Infinite for a bend without effect.
    pub fn scaled_compliance(&self, rigidity: f32, h: f32) -> f32 {
        let (geometry, h) = (f64::from(self.geometry), f64::from(h));
        let scaled = round(geometry / f64::from(rigidity) / (h * h));
        // 0 / 0: a bend without length and without rigidity.
        if scaled.is_nan() { f32::INFINITY } else { scaled }
    }
}

/// Rounds to the solver's f32.
#[allow(clippy::cast_possible_truncation, reason = "the one rounding to the solver's f32")]
fn round(value: f64) -> f32 {
    value as f32
}
