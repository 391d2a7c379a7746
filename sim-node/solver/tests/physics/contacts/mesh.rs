//! Meshes for colliders.

/// Vertices and faces.
pub(super) struct Mesh {
    pub(super) vertices: Vec<[f64; 3]>,
    pub(super) faces: Vec<Vec<usize>>,
}

impl Mesh {
    /// A square of `count` by `count` cells around the origin, each of two triangles, in the plane y = 0.
    pub(super) fn grid(count: usize, side: f64) -> Self {
        let at = |index: usize| (index as f64 / count as f64 - 0.5) * side;
        let places = 0..(count + 1) * (count + 1);
        let vertices = places.map(|one| [at(one % (count + 1)), 0.0, at(one / (count + 1))]);
        let mut faces = Vec::new();
        for cell in 0..count * count {
            let a = cell / count * (count + 1) + cell % count;
            let [b, c, d] = [a + 1, a + count + 1, a + count + 2];
            faces.extend([vec![a, c, b], vec![b, c, d]]);
        }
        Self { vertices: vertices.collect(), faces }
    }

    /// A closed box around the origin.
    pub(super) fn cuboid(half: [f64; 3]) -> Self {
        let corner = |bits: usize| {
            [0, 1, 2].map(|axis| if bits >> axis & 1 == 1 { half[axis] } else { -half[axis] })
        };
        let faces =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        Self { vertices: (0..8).map(corner).collect(), faces: faces.map(Vec::from).into() }
    }

    /// A closed ball.
    pub(super) fn ball(radius: f64, rings: usize) -> Self {
        let sectors = 2 * rings;
        let angle = |part: usize, of: usize| std::f64::consts::PI * part as f64 / of as f64;
        let mut vertices = vec![[0.0, radius, 0.0], [0.0, -radius, 0.0]];
        for ring in 1..rings {
            for sector in 0..sectors {
                let (latitude, longitude) = (angle(ring, rings), angle(2 * sector, sectors));
                let (sine, height) = latitude.sin_cos();
                let around = [sine * longitude.cos(), height, sine * longitude.sin()];
                vertices.push(around.map(|axis| radius * axis));
            }
        }
        let at = |ring: usize, sector: usize| 2 + ring * sectors + sector % sectors;
        let mut faces = Vec::new();
        for sector in 0..sectors {
            faces.push(vec![0, at(0, sector + 1), at(0, sector)]);
            faces.push(vec![1, at(rings - 2, sector), at(rings - 2, sector + 1)]);
            for ring in 0..rings - 2 {
                let next = sector + 1;
                faces.push(vec![
                    at(ring, sector),
                    at(ring, next),
                    at(ring + 1, next),
                    at(ring + 1, sector),
                ]);
            }
        }
        Self { vertices, faces }
    }

    /// Turns it about z, by an angle in radians.
    pub(super) fn turned(mut self, angle: f64) -> Self {
        for vertex in &mut self.vertices {
            *vertex = turned(*vertex, angle);
        }
        self
    }

    pub(super) fn text(&self) -> String {
        let Self { vertices, faces } = self;
        format!("[[collider]]\nshape = \"mesh\"\nvertices = {vertices:?}\nfaces = {faces:?}\n")
    }
}

pub(super) fn turned([x, y, z]: [f64; 3], angle: f64) -> [f64; 3] {
    let (sine, cosine) = angle.sin_cos();
    [x * cosine - y * sine, x * sine + y * cosine, z]
}
