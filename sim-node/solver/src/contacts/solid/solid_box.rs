//! Solid boxes: where a path leaves one, and by which face.

use glam::Vec3;

/// A face of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Face {
    axis: usize,
    /// 1 or -1: the side.
    sign: f32,
}

impl Face {
    /// Unit normal in the axes of the box.
    pub(crate) fn normal(self) -> Vec3 {
        let mut normal = Vec3::ZERO;
        normal[self.axis] = self.sign;
        normal
    }
}

/// The faces of a box. On ties, the first one wins.
const FACES: [Face; 6] = [
    Face { axis: 0, sign: 1.0 },
    Face { axis: 1, sign: 1.0 },
    Face { axis: 2, sign: 1.0 },
    Face { axis: 0, sign: -1.0 },
    Face { axis: 1, sign: -1.0 },
    Face { axis: 2, sign: -1.0 },
];

/// The face by which a path leaves a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FaceHit {
    pub(crate) face: Face,
    /// Distance from the end of the path to the face, > 0.
    pub(crate) depth: f32,
}

/// A box in its own axes. In a 2-D scene it has two.
#[derive(Debug, Clone)]
pub(crate) struct SolidBox {
    pub(crate) extents: [f32; 3],
    pub(crate) axis_count: usize,
    /// Magnitude of its coordinates.
    pub(crate) reach: f32,
}

impl SolidBox {
    pub(crate) fn new(extents: [f32; 3], axis_count: usize, center: Vec3) -> Self {
        let reach = Vec3::from_array(extents).element_sum() + center.abs().element_sum();
        Self { extents, axis_count, reach }
    }

    /// Finds where a path leaves the box: by the face through which it entered, or by the nearest
    /// face if it began inside. A path that has already left on another side counts, so nothing
    /// passes through a thin box.
    pub(crate) fn hit(&self, start: [f32; 3], end: [f32; 3]) -> Option<FaceHit> {
        let start = self.snap_to_surface(start);
        let face = if !self.is_inside(start) {
            self.entered_face(start, end)?
        } else if self.is_inside(end) {
            self.nearest_face(end)?
        } else {
            return None;
        };
        let depth = self.depth(face, end);
        (depth > 0.0).then_some(FaceHit { face, depth })
    }

    fn faces(&self) -> impl Iterator<Item = Face> {
        FACES.into_iter().filter(|face| face.axis < self.axis_count)
    }

    fn depth(&self, face: Face, point: [f32; 3]) -> f32 {
        self.extents[face.axis] - face.sign * point[face.axis]
    }

    fn is_inside(&self, point: [f32; 3]) -> bool {
        (0..self.axis_count).all(|axis| point[axis].abs() < self.extents[axis])
    }

    fn nearest_face(&self, point: [f32; 3]) -> Option<Face> {
        let depth = |face| self.depth(face, point);
        self.faces().reduce(|best, face| if depth(face) < depth(best) { face } else { best })
    }

    /// Moves a point just below the surface onto it. Otherwise a particle at rest on a thin box could
    /// be pulled through it from the inside.
    fn snap_to_surface(&self, mut point: [f32; 3]) -> [f32; 3] {
        let skin = 2.0 * f32::EPSILON * self.reach;
        if self.is_inside(point)
            && let Some(face) = self.nearest_face(point)
            && self.depth(face, point) < skin
        {
            point[face.axis] = face.sign * self.extents[face.axis];
        }
        point
    }

    /// The face through which a path from outside enters (slab method: Kay, Kajiya 1986).
    fn entered_face(&self, start: [f32; 3], end: [f32; 3]) -> Option<Face> {
        let exit = self.exit_time(start, end)?;
        let mut entry: Option<(Face, f32)> = None;
        for face in self.faces() {
            let inwards = -face.sign * (end[face.axis] - start[face.axis]);
            let outside = -self.depth(face, start);
            // A path enters only through a face that it starts in front of and moves towards.
            if inwards > 0.0 && outside >= 0.0 {
                let time = outside / inwards;
                if entry.is_none_or(|(_, latest)| time > latest) {
                    entry = Some((face, time));
                }
            }
        }
        entry.filter(|(_, time)| *time < exit).map(|(face, _)| face)
    }

    /// Fraction of a path after which it is beyond the first far side. None if the path runs along
    /// or beside the box.
    fn exit_time(&self, start: [f32; 3], end: [f32; 3]) -> Option<f32> {
        let mut exit = 1.0;
        for axis in 0..self.axis_count {
            let change = end[axis] - start[axis];
            if change == 0.0 {
                let is_between = start[axis].abs() < self.extents[axis];
                is_between.then_some(())?;
                continue;
            }
            let far = if change > 0.0 { self.extents[axis] } else { -self.extents[axis] };
            let time = (far - start[axis]) / change;
            if time < exit {
                exit = time;
            }
        }
        Some(exit)
    }
}
