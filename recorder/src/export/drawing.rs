//! One moment of a recording as a picture.

use glam::DVec2;

use super::camera::Camera;
use super::extent::Extent;
use super::mesh::{Bend, Sheet};
use super::moment::Moment;
use super::shape::{Color, Picture, Shape, Size, Text};
use super::solids;

const CAPTION: Color = Color([0x30, 0x30, 0x30]);
/// How far planes go beyond what the picture shows, in longest sides of its box.
const PLANE_MARGIN: f64 = 0.08;

/// What all pictures of a recording have in common.
#[derive(Debug, Clone)]
pub(crate) struct Easel {
    pub(crate) camera: Camera,
    /// What the camera looks at.
    pub(crate) extent: Extent,
    pub(crate) size: Size,
    pub(crate) bend: Bend,
    pub(crate) scene_name: String,
}

impl Easel {
    /// The picture of a moment, so much simulated time after the first one of the recording.
    pub(crate) fn draw(&self, moment: &Moment, time_s: f64) -> Picture {
        let room = self.extent.grown(PLANE_MARGIN);
        let mut shapes = solids::shapes(&moment.colliders, &self.camera, &room);
        shapes.extend(Sheet { moment, camera: &self.camera, bend: self.bend }.shapes());
        shapes.push(Shape::Text(self.caption(moment, time_s)));
        shapes.retain(Shape::is_drawable);
        Picture { size: self.size, shapes }
    }

    fn caption(&self, moment: &Moment, time_s: f64) -> Text {
        let cell = (self.size.width.min(self.size.height) / 360).max(1);
        let (name, step, torn) = (&self.scene_name, moment.row.step, moment.row.torn_count);
        Text {
            corner: DVec2::splat(f64::from(6 * cell)),
            cell,
            color: CAPTION,
            line: format!("{name}  step {step}  {time_s:.3} s  torn {torn}"),
        }
    }
}
