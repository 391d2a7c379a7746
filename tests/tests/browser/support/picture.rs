//! Pictures as colours of pixels: what is looked for in them are classes of colours, never bytes of
//! a file, so that another version of the browser gives the same answers.

use serde_json::Value;

use super::distance;

/// A part of the window, in CSS pixels, which are those of the screen here.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Area {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

impl Area {
    /// The square with that middle.
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
    /// Where its first pixel is in the window.
    corner: [f64; 2],
    columns: usize,
    colors: Vec<Color>,
}

impl Picture {
    /// `answer`: of `Page.captureScreenshot`.
    pub(crate) fn of_screenshot(answer: &Value) -> Self {
        let bytes = bytes_of(answer);
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut pixels).unwrap();
        let channels = frame.color_type.samples();
        Self::new([0.0; 2], frame.width as usize, &pixels[..frame.buffer_size()], channels)
    }

    /// `pixels`: as the page's `viewer.pixels` gives them.
    pub(crate) fn of_pixels(pixels: &Value, [x, y]: [f64; 2]) -> Self {
        let columns: usize = serde_json::from_value(pixels["width"].clone()).unwrap();
        let bytes: Vec<u8> = serde_json::from_value(pixels["data"].clone()).unwrap();
        Self::new([x.round(), y.round()], columns, &bytes, 4)
    }

    fn new(corner: [f64; 2], columns: usize, bytes: &[u8], channels: usize) -> Self {
        let colors = bytes.chunks_exact(channels).map(|one| [one[0], one[1], one[2]]).collect();
        Self { corner, columns, colors }
    }

    /// The middles of the pixels of a class of colours.
    fn places(&self, is_meant: impl Fn(Color) -> bool) -> impl Iterator<Item = [f64; 2]> {
        let [left, top] = self.corner;
        let found = self.colors.iter().enumerate().filter(move |(_, color)| is_meant(**color));
        found.map(move |(index, _)| {
            let (row, column) = (index / self.columns, index % self.columns);
            [left + column as f64 + 0.5, top + row as f64 + 0.5]
        })
    }

    /// How many pixels of an area are of a class of colours.
    pub(crate) fn count(&self, area: &Area, is_meant: impl Fn(Color) -> bool) -> usize {
        self.places(is_meant).filter(|place| area.contains(*place)).count()
    }

    /// The middle of the pixels of a class of colours, of those within `radius` of a place.
    pub(crate) fn middle_of(
        &self,
        near: [f64; 2],
        radius: f64,
        is_meant: impl Fn(Color) -> bool,
    ) -> Option<[f64; 2]> {
        let mut sum = [0.0; 2];
        let mut count = 0.0;
        for place in self.places(is_meant).filter(|place| distance(*place, near) <= radius) {
            sum = [sum[0] + place[0], sum[1] + place[1]];
            count += 1.0;
        }
        (count > 0.0).then(|| sum.map(|one| one / count))
    }
}

/// The surface's front, in any light: red.
pub(crate) fn is_cloth([red, green, blue]: Color) -> bool {
    let [red, green, blue] = [red, green, blue].map(u32::from);
    red > 70 && red > 2 * green && red > 2 * blue
}

/// A free particle: dark, and rather blue.
pub(crate) fn is_particle([red, green, blue]: Color) -> bool {
    blue > red && green < 120 && blue < 140
}

/// A particle that a hand holds: orange.
pub(crate) fn is_held([red, green, blue]: Color) -> bool {
    red > 200 && (90..190).contains(&green) && blue < 100
}

/// The mark of a pinned particle: blue.
pub(crate) fn is_pin([red, green, blue]: Color) -> bool {
    blue > 170 && red < 120 && green < 160
}

/// The bytes in the field `data` of an answer, which are in base 64.
pub(crate) fn bytes_of(answer: &Value) -> Vec<u8> {
    let text = answer["data"].as_str().unwrap_or_default().trim_end_matches('=');
    let mut bytes = Vec::with_capacity(text.len() * 3 / 4);
    let (mut bits, mut held) = (0_u32, 0);
    for character in text.bytes() {
        let value = match character {
            b'A'..=b'Z' => character - b'A',
            b'a'..=b'z' => character - b'a' + 26,
            b'0'..=b'9' => character - b'0' + 52,
            b'+' => 62,
            _ => 63,
        };
        bits = bits << 6 | u32::from(value);
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held & 0xff) as u8);
        }
    }
    bytes
}
