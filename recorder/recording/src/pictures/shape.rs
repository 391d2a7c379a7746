//! The shapes of a picture, in pixels. Both file formats are written from this list.

use glam::DVec2;

/// Width and height of a picture, in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
}

/// A picture as shapes from back to front.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Width and height.
    pub size: Size,
    /// The shapes, from back to front.
    pub shapes: Vec<Shape>,
}

/// A color in sRGB.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Color(
    /// Red, green and blue.
    pub [u8; 3],
);

/// The background color.
pub const BACKGROUND: Color = Color([0xf8, 0xf8, 0xf5]);

/// The style of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Color of the line.
    pub color: Color,
    /// Width in pixels.
    pub width: f64,
    /// Dash pattern.
    pub dash: Dash,
}

/// The dash pattern of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dash {
    /// A line without gaps.
    Solid,
    /// Dashes as long as the gaps between them.
    Dashed,
    /// Dots.
    Dotted,
}

/// One element of a picture. x points to the right and y down. Line ends and corners are round.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A filled polygon.
    Polygon {
        /// Corners in their order along the boundary.
        corners: Vec<DVec2>,
        /// Color of the inside.
        fill: Color,
        /// Line along the boundary, if there is one.
        outline: Option<Stroke>,
    },
    /// A straight line.
    Segment {
        /// End points.
        ends: [DVec2; 2],
        /// Style of the line.
        stroke: Stroke,
    },
    /// A filled circle.
    Circle {
        /// Center.
        center: DVec2,
        /// Radius in pixels.
        radius: f64,
        /// Color of the inside.
        fill: Color,
        /// Line along the boundary, if there is one.
        outline: Option<Stroke>,
    },
    /// A line of text.
    Text(Text),
}

/// One line of text in letters of 5 x 7 cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Text {
    /// Upper left corner.
    pub corner: DVec2,
    /// Side of a cell in pixels.
    pub cell: u32,
    /// Color of the letters.
    pub color: Color,
    /// The text.
    pub line: String,
}

/// Largest drawable coordinate, in pixels. The encoders keep enough digits up to this limit.
const COORDINATE_MAX: f64 = 1e6;

impl Stroke {
    /// Returns a solid line.
    pub fn solid(color: Color, width: f64) -> Self {
        Self { color, width, dash: Dash::Solid }
    }

    /// Returns the lengths of a dash and of the gap after it, in pixels. Returns `None` for a solid
    /// line.
    pub fn dashes(&self) -> Option<[f64; 2]> {
        match self.dash {
            Dash::Solid => None,
            Dash::Dashed => Some([4.0 * self.width, 4.0 * self.width]),
            // The round ends turn a very short dash into a dot.
            Dash::Dotted => Some([0.01, 2.5 * self.width]),
        }
    }
}

impl Shape {
    /// Returns `true` if all coordinates are finite and below `COORDINATE_MAX`.
    pub fn is_drawable(&self) -> bool {
        let is_near =
            |point: &DVec2| point.is_finite() && point.abs().max_element() < COORDINATE_MAX;
        match self {
            Self::Polygon { corners, .. } => corners.len() >= 3 && corners.iter().all(is_near),
            Self::Segment { ends, stroke } => {
                ends.iter().all(is_near) && stroke.width < COORDINATE_MAX
            }
            Self::Circle { center, radius, .. } => is_near(center) && *radius < COORDINATE_MAX,
            Self::Text(text) => is_near(&text.corner),
        }
    }
}

impl Color {
    /// Returns the color darkened by the factor `share`, 0..=1.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a fraction of a byte, rounded, is a byte"
    )]
    #[must_use]
    pub fn times(self, share: f64) -> Self {
        Self(self.0.map(|part| (f64::from(part) * share).round() as u8))
    }
}
