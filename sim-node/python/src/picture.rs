//! Pictures of states in arrays, as `recorder export --png` draws them.

use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use recording::SceneState;
use recording::pictures::{
    Bend, Extent, ExtentTracker, PictureOptions, Renderer, Size, Style, View, rasterize,
};
use sim_solver::Scene;
use sim_solver::scene::Up;

use crate::convert::Vector;

/// Width and height in pixels.
pub(crate) type PixelSize = (u32, u32);
/// Two corners of a box, in metres.
pub(crate) type Corners = (Vector, Vector);

/// Allowed sides of a picture, in pixels.
const SIDES: std::ops::RangeInclusive<u32> = 16..=8192;
const VIEWS: [(&str, View); 4] =
    [("front", View::Front), ("side", View::Side), ("top", View::Top), ("iso", View::Iso)];
const STYLES: [(&str, Style); 2] = [("wires", Style::Wires(Bend::Draw)), ("shaded", Style::Shaded)];

/// The contents and the appearance of a picture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PictureRequest {
    options: PictureOptions,
    extent: Option<Extent>,
}

/// The place of a state in its run.
#[derive(Debug, Clone)]
pub(crate) struct Caption {
    pub(crate) scene_name: String,
    /// Axis that points up.
    pub(crate) up: Up,
    /// Simulated time since the first state, in seconds.
    pub(crate) time_s: f64,
}

impl PictureRequest {
    /// Checks the arguments of `render`.
    pub(crate) fn new(
        (width, height): PixelSize,
        view: Option<&str>,
        style: &str,
        bounds: Option<Corners>,
    ) -> PyResult<Self> {
        if !(SIDES.contains(&width) && SIDES.contains(&height)) {
            let (start, end) = (SIDES.start(), SIDES.end());
            let message =
                format!("`size` is ({width}, {height}) (allowed: {start} to {end} pixels each)");
            return Err(PyValueError::new_err(message));
        }
        let view = view.map(|name| named(&VIEWS, "view", name)).transpose()?;
        let style = named(&STYLES, "style", style)?;
        let extent = bounds.map(|(one, other)| {
            let [one, other] = [one, other].map(|corner| corner.0.map(f64::from));
            Extent::between(one, other)
        });
        if extent.is_some_and(|extent| !extent.is_finite()) {
            return Err(PyValueError::new_err("`bounds` are not finite"));
        }
        let options = PictureOptions { size: Size { width, height }, view, style };
        Ok(Self { options, extent })
    }

    /// Draws a state. Shape: (height, width, 3).
    pub(crate) fn draw<'py>(
        self,
        py: Python<'py>,
        state: &SceneState,
        scene: Option<&Scene>,
        caption: Caption,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let Self { options, extent } = self;
        let is_2d = scene.is_some_and(|scene| scene.dimensions == 2);
        let options =
            PictureOptions { view: options.view.or(is_2d.then_some(View::Front)), ..options };
        let pixels = py.detach(|| {
            let extent = extent.unwrap_or_else(|| {
                let mut tracker = ExtentTracker::default();
                tracker.add(state);
                tracker.extent()
            });
            let Caption { scene_name, up, time_s } = caption;
            rasterize(&Renderer::new(options, extent, up, scene_name).draw(state, time_s))
        });
        let pixels = pixels.map_err(|error| PyValueError::new_err(error.to_string()))?;
        let Size { width, height } = options.size;
        PyArray1::from_vec(py, pixels).reshape([height as usize, width as usize, 3])
    }
}

fn named<T: Copy>(known: &[(&str, T)], argument: &str, name: &str) -> PyResult<T> {
    let found = known.iter().find(|(one, _)| *one == name);
    found.map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<_> = known.iter().map(|(one, _)| *one).collect();
        let names = names.join(", ");
        PyValueError::new_err(format!("`{argument}` is '{name}' (allowed: {names})"))
    })
}
