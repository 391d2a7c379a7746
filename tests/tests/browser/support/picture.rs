//! Pictures as pixel colours. Tests look for classes of colours, never for bytes of a file, so that they
//! pass with other versions of the browser.

use std::collections::BTreeSet;

use serde_json::Value;

use super::distance;

/// A rectangle of the window in CSS pixels, which equal device pixels in these tests.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Area {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

impl Area {
    /// Returns a square around a point.
    pub(crate) fn around([x, y]: [f64; 2], radius: f64) -> Self {
        Self { x: x - radius, y: y - radius, width: 2.0 * radius, height: 2.0 * radius }
    }

    fn contains(&self, [x, y]: [f64; 2]) -> bool {
        (self.x..self.x + self.width).contains(&x) && (self.y..self.y + self.height).contains(&y)
    }
}

/// Red, green and blue.
pub(crate) type Color = [u8; 3];

/// A rectangle of pixels of the window.
#[derive(Debug)]
pub(crate) struct Picture {
    /// Position of the first pixel in the window.
    corner: [f64; 2],
    columns: usize,
    colors: Vec<Color>,
}

impl Picture {
    /// Decodes the answer of `Page.captureScreenshot`.
    pub(crate) fn from_screenshot(answer: &Value) -> Self {
        let bytes = data_bytes(answer);
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut pixels).unwrap();
        let channels = frame.color_type.samples();
        Self::new([0.0; 2], frame.width as usize, &pixels[..frame.buffer_size()], channels)
    }

    /// Converts the result of the page's `viewer.pixels`.
    pub(crate) fn from_pixels(pixels: &Value, [x, y]: [f64; 2]) -> Self {
        let columns: usize = serde_json::from_value(pixels["width"].clone()).unwrap();
        let bytes: Vec<u8> = serde_json::from_value(pixels["data"].clone()).unwrap();
        Self::new([x.round(), y.round()], columns, &bytes, 4)
    }

    fn new(corner: [f64; 2], columns: usize, bytes: &[u8], channels: usize) -> Self {
        let colors = bytes.chunks_exact(channels).map(|one| [one[0], one[1], one[2]]).collect();
        Self { corner, columns, colors }
    }

    /// Returns the centres of the pixels of a class of colours.
    fn centers(&self, matches: impl Fn(Color) -> bool) -> impl Iterator<Item = [f64; 2]> {
        let [left, top] = self.corner;
        let pixels = self.colors.iter().enumerate().filter(move |(_, color)| matches(**color));
        pixels.map(move |(index, _)| {
            let (row, column) = (index / self.columns, index % self.columns);
            [left + column as f64 + 0.5, top + row as f64 + 0.5]
        })
    }

    /// Counts the pixels of a class of colours in an area.
    pub(crate) fn count(&self, area: &Area, matches: impl Fn(Color) -> bool) -> usize {
        self.centers(matches).filter(|center| area.contains(*center)).count()
    }

    /// Returns the brightness of each pixel, 0 to 255.
    pub(crate) fn brightness(&self) -> Vec<f64> {
        let mean = |color: &Color| color.iter().map(|one| f64::from(*one)).sum::<f64>() / 3.0;
        self.colors.iter().map(mean).collect()
    }

    /// Returns the different colours in an area.
    pub(crate) fn colors(&self, area: &Area) -> BTreeSet<Color> {
        let pixels = self.colors.iter().enumerate();
        let inside = pixels.filter(|(index, _)| {
            let (row, column) = (index / self.columns, index % self.columns);
            area.contains([self.corner[0] + column as f64 + 0.5, self.corner[1] + row as f64 + 0.5])
        });
        inside.map(|(_, color)| *color).collect()
    }

    /// Returns the centroid of the pixels of a class of colours within `radius` of a point.
    pub(crate) fn middle_of(
        &self,
        near: [f64; 2],
        radius: f64,
        matches: impl Fn(Color) -> bool,
    ) -> Option<[f64; 2]> {
        let mut sum = [0.0; 2];
        let mut count = 0.0;
        for center in self.centers(matches).filter(|center| distance(*center, near) <= radius) {
            sum = [sum[0] + center[0], sum[1] + center[1]];
            count += 1.0;
        }
        (count > 0.0).then(|| sum.map(|one| one / count))
    }
}

/// The front of the cloth in any light: red.
pub(crate) fn is_cloth([red, green, blue]: Color) -> bool {
    let [red, green, blue] = [red, green, blue].map(u32::from);
    red > 70 && red > 2 * green && red > 2 * blue
}

/// A free particle: dark and bluish.
pub(crate) fn is_particle([red, green, blue]: Color) -> bool {
    blue > red && green < 120 && blue < 140
}

/// The mark of a grabbed particle: orange.
pub(crate) fn is_grab_mark([red, green, blue]: Color) -> bool {
    red > 200 && (90..190).contains(&green) && blue < 100
}

/// The arrow of a force: green.
pub(crate) fn is_force([red, green, blue]: Color) -> bool {
    red < 60 && green > 120 && (100..170).contains(&blue)
}

/// The ghost of a replay in the light scheme: a medium blue.
pub(crate) fn is_ghost([red, green, blue]: Color) -> bool {
    blue > 150 && red < 100 && (80..170).contains(&green)
}

/// The mark of a pinned particle: blue.
pub(crate) fn is_pin([red, green, blue]: Color) -> bool {
    blue > 170 && red < 120 && green < 160
}

/// Decodes the field `data` of an answer from base64.
pub(crate) fn data_bytes(answer: &Value) -> Vec<u8> {
    let text = answer["data"].as_str().unwrap_or_default().trim_end_matches('=');
    let mut bytes = Vec::with_capacity(text.len() * 3 / 4);
    let (mut bits, mut bit_count) = (0_u32, 0);
    for character in text.bytes() {
        let value = match character {
            b'A'..=b'Z' => character - b'A',
            b'a'..=b'z' => character - b'a' + 26,
            b'0'..=b'9' => character - b'0' + 52,
            b'+' => 62,
            _ => 63,
        };
        bits = bits << 6 | u32::from(value);
        bit_count += 6;
        if bit_count >= 8 {
            bit_count -= 8;
            bytes.push((bits >> bit_count & 0xff) as u8);
        }
    }
    bytes
}
