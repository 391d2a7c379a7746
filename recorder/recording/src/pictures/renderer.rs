//! Draws one state as a picture.

use glam::DVec2;
use sim_solver::scene::Up;

use super::camera::{Basis, Camera, View};
use super::extent::Extent;
use super::mesh::{MeshDrawing, Style};
use super::shape::{Color, Picture, Shape, Size, Text};
use super::solids;
use crate::scene_state::SceneState;

const CAPTION: Color = Color([0x30, 0x30, 0x30]);
/// Distance that planes extend beyond the extent of the picture, relative to its longest side.
const PLANE_MARGIN: f64 = 0.08;

/// The options of a picture.
#[derive(Debug, Clone, Copy)]
pub struct PictureOptions {
    /// Its size.
    pub size: Size,
    /// Direction of view. `None` is [`View::best_for`] the box.
    pub view: Option<View>,
    /// Drawn part of the state.
    pub style: Style,
}

/// The properties that all pictures of a recording share.
#[derive(Debug, Clone)]
pub struct Renderer {
    /// The camera.
    pub camera: Camera,
    /// The box that the camera shows.
    pub extent: Extent,
    /// Size of the pictures.
    pub size: Size,
    /// Drawn part of the state.
    pub style: Style,
    /// Name in the caption of the style wires.
    pub scene_name: String,
}

impl Renderer {
    /// Makes a camera that shows a box of a scene.
    pub fn new(options: PictureOptions, extent: Extent, up: Up, scene_name: String) -> Self {
        let PictureOptions { size, view, style } = options;
        let view = view.unwrap_or_else(|| View::best_for(&extent, up));
        let camera = Camera::fit(Basis::new(view, up), &extent, size);
        Self { camera, extent, size, style, scene_name }
    }

    /// Draws a state. `time_s` is the simulated time since the first snapshot of the recording.
    pub fn draw(&self, state: &SceneState, time_s: f64) -> Picture {
        let room = self.extent.grown(PLANE_MARGIN);
        let mut shapes = solids::shapes(state, &self.camera, &room);
        shapes.extend(MeshDrawing { state, camera: &self.camera, style: self.style }.shapes());
        if matches!(self.style, Style::Wires(_)) {
            shapes.push(Shape::Text(self.caption(state, time_s)));
        }
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
