//! Draws states as pictures: `recorder export` writes them into files, and `info` its graphs.

mod camera;
mod extent;
mod font;
mod mesh;
mod png;
mod renderer;
mod shape;
mod solids;
mod svg;

pub use camera::{Basis, Camera, View};
pub use extent::{Extent, ExtentTracker};
pub use mesh::{Bend, Style};
pub use png::{PictureError, encode as encode_png, rasterize};
pub use renderer::{PictureOptions, Renderer};
pub use shape::{BACKGROUND, Color, Dash, Picture, Shape, Size, Stroke, Text};
pub use svg::encode as encode_svg;
