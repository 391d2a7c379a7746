//! The camera of the page: projects points of the scene to pixels.

use serde_json::Value;

/// The projection of a page.
#[derive(Debug)]
pub(crate) struct Camera {
    /// From the scene to clip space, column-major.
    matrix: [f64; 16],
    /// Upper left corner and size of the picture in the window, in CSS pixels.
    corner: [f64; 2],
    size: [f64; 2],
}

impl Camera {
    pub(crate) fn new(camera: &Value) -> Self {
        let field = |name: &str| camera[name].clone();
        Self {
            matrix: serde_json::from_value(field("matrix")).unwrap(),
            corner: serde_json::from_value(field("corner")).unwrap(),
            size: serde_json::from_value(field("size")).unwrap(),
        }
    }

    /// Returns the pixel of the window at which a point is drawn; y points down.
    pub(crate) fn project(&self, point: [f32; 3]) -> [f64; 2] {
        let [x, y, z] = point.map(f64::from);
        let row = |r: usize| {
            let m = &self.matrix;
            m[r] * x + m[4 + r] * y + m[8 + r] * z + m[12 + r]
        };
        let [right, up] = [row(0) / row(3), row(1) / row(3)];
        let fraction = [f64::midpoint(right, 1.0), 1.0 - f64::midpoint(up, 1.0)];
        [0, 1].map(|axis| self.corner[axis] + fraction[axis] * self.size[axis])
    }

    /// Returns the area of the whole picture.
    pub(crate) fn area(&self) -> super::Area {
        super::Area {
            x: self.corner[0],
            y: self.corner[1],
            width: self.size[0],
            height: self.size[1],
        }
    }
}

/// Distance between two pixels.
pub(crate) fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
