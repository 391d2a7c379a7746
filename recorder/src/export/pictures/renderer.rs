//! Draws one state of a recording as a picture.

use glam::DVec2;

use super::camera::Camera;
use super::extent::Extent;
use super::mesh::{Bend, MeshDrawing};
use super::shape::{Color, Picture, Shape, Size, Text};
use super::solids;
use crate::export::scene_state::SceneState;

const CAPTION: Color = Color([0x30, 0x30, 0x30]);
/// Distance that planes extend beyond the extent of the picture, relative to its longest side.
const PLANE_MARGIN: f64 = 0.08;

/// The properties that all pictures of a recording share.
#[derive(Debug, Clone)]
pub(crate) struct Renderer {
    pub(crate) camera: Camera,
    /// The box that the camera shows.
    pub(crate) extent: Extent,
    pub(crate) size: Size,
    pub(crate) bend: Bend,
    pub(crate) scene_name: String,
}

impl Renderer {
    /// Draws a state. `time_s` is the simulated time since the first snapshot of the recording.
    pub(crate) fn draw(&self, state: &SceneState, time_s: f64) -> Picture {
        let room = self.extent.grown(PLANE_MARGIN);
        let mut shapes = solids::shapes(state, &self.camera, &room);
        shapes.extend(MeshDrawing { state, camera: &self.camera, bend: self.bend }.shapes());
        shapes.push(Shape::Text(self.caption(state, time_s)));
        shapes.retain(Shape::is_drawable);
        Picture { size: self.size, shapes }
    }

    fn caption(&self, state: &SceneState, time_s: f64) -> Text {
        let cell = (self.size.width.min(self.size.height) / 360).max(1);
        let (name, step, torn) = (&self.scene_name, state.row.step, state.row.torn_count);
        Text {
            corner: DVec2::splat(f64::from(6 * cell)),
            cell,
            color: CAPTION,
            line: format!("{name}  step {step}  {time_s:.3} s  torn {torn}"),
        }
    }
}
