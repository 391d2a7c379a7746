//! Paints a picture, and encodes it as PNG.

use glam::DVec2;
use tiny_skia::{
    FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Rect, StrokeDash, Transform,
};

use super::font;
use super::shape::{BACKGROUND, Color, Picture, Shape, Size, Stroke, Text};

/// The reason why a picture cannot be painted.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// It has no pixels, or too many.
    #[error("a picture of {}x{} pixels cannot be painted", .0.width, .0.height)]
    Size(Size),
    /// The encoder failed.
    #[error("cannot encode the picture: {0}")]
    Encoding(String),
}

/// Returns the bytes of the file. Equal pictures give equal bytes.
///
/// # Errors
/// The picture has no pixels, or more than fit into memory.
pub fn encode(picture: &Picture) -> Result<Vec<u8>, PictureError> {
    let pixmap = paint_all(picture)?;
    pixmap.encode_png().map_err(|error| PictureError::Encoding(error.to_string()))
}

/// Returns the pixels of a picture, row by row from the top: red, green and blue.
///
/// # Errors
/// Same as [`encode`].
pub fn rasterize(picture: &Picture) -> Result<Vec<u8>, PictureError> {
    let pixmap = paint_all(picture)?;
    // No pixel is transparent.
    let pixels = pixmap.pixels().iter();
    Ok(pixels.flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]).collect())
}

fn paint_all(picture: &Picture) -> Result<Pixmap, PictureError> {
    let size = picture.size;
    let mut pixmap = Pixmap::new(size.width, size.height).ok_or(PictureError::Size(size))?;
    let [red, green, blue] = BACKGROUND.0;
    pixmap.fill(tiny_skia::Color::from_rgba8(red, green, blue, u8::MAX));
    for shape in &picture.shapes {
        paint(&mut pixmap, shape);
    }
    Ok(pixmap)
}

fn paint(pixmap: &mut Pixmap, shape: &Shape) {
    match shape {
        Shape::Polygon { corners, fill, outline } => {
            paint_path(pixmap, polygon(corners), Some(*fill), *outline);
        }
        Shape::Segment { ends, stroke } => paint_path(pixmap, polyline(ends), None, Some(*stroke)),
        Shape::Circle { center, radius, fill, outline } => {
            let circle = PathBuilder::from_circle(f32(center.x), f32(center.y), f32(*radius));
            paint_path(pixmap, circle, Some(*fill), *outline);
        }
        Shape::Text(text) => paint_text(pixmap, text),
    }
}

fn polygon(corners: &[DVec2]) -> Option<Path> {
    let mut path = builder(corners)?;
    path.close();
    path.finish()
}

fn polyline(points: &[DVec2]) -> Option<Path> {
    builder(points)?.finish()
}

fn builder(points: &[DVec2]) -> Option<PathBuilder> {
    let (first, others) = points.split_first()?;
    let mut path = PathBuilder::new();
    path.move_to(f32(first.x), f32(first.y));
    for point in others {
        path.line_to(f32(point.x), f32(point.y));
    }
    Some(path)
}

/// Paints a path. It is `None` for an invisible shape, such as a circle of radius 0.
fn paint_path(pixmap: &mut Pixmap, path: Option<Path>, fill: Option<Color>, line: Option<Stroke>) {
    let Some(path) = path else { return };
    let identity = Transform::identity();
    if let Some(fill) = fill {
        pixmap.fill_path(&path, &color_paint(fill), FillRule::Winding, identity, None);
    }
    if let Some(line) = line {
        let stroke = tiny_skia::Stroke {
            width: f32(line.width),
            line_cap: LineCap::Round,
            line_join: LineJoin::Round,
            dash: line.dashes().and_then(|lengths| StrokeDash::new(lengths.map(f32).into(), 0.0)),
            ..tiny_skia::Stroke::default()
        };
        pixmap.stroke_path(&path, &color_paint(line.color), &stroke, identity, None);
    }
}

fn paint_text(pixmap: &mut Pixmap, text: &Text) {
    let (paint, cell) = (color_paint(text.color), f64::from(text.cell));
    for (place, letter) in (0_u32..).zip(text.line.chars()) {
        let corner = text.corner + DVec2::new(f64::from(place * font::ADVANCE) * cell, 0.0);
        for (column, row) in font::cells(letter) {
            let at = corner + DVec2::new(f64::from(column), f64::from(row)) * cell;
            let square = Rect::from_xywh(f32(at.x), f32(at.y), f32(cell), f32(cell));
            if let Some(square) = square {
                pixmap.fill_rect(square, &paint, Transform::identity(), None);
            }
        }
    }
}

fn color_paint(color: Color) -> Paint<'static> {
    let [red, green, blue] = color.0;
    let mut paint = Paint::default();
    paint.set_color_rgba8(red, green, blue, u8::MAX);
    paint.anti_alias = true;
    paint
}

/// Converts to the precision of the rasterizer.
#[allow(clippy::cast_possible_truncation, reason = "pixels are rounded to f32 here and only here")]
fn f32(value: f64) -> f32 {
    value as f32
}
