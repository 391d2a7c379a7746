//! A picture as SVG: plain text, two digits behind the point.

use glam::DVec2;

use super::shape::{BACKGROUND, Color, Picture, Shape, Stroke, Text};

/// The text of the file. Equal pictures give equal texts.
pub(crate) fn text(picture: &Picture) -> String {
    let (width, height) = (picture.size.width, picture.size.height);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" stroke-linecap=\"round\" stroke-linejoin=\"round\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"{}\"/>\n",
        hex(BACKGROUND)
    );
    for shape in &picture.shapes {
        svg += &element(shape);
        svg.push('\n');
    }
    svg + "</svg>\n"
}

fn element(shape: &Shape) -> String {
    match shape {
        Shape::Polygon { corners, fill, outline } => {
            let corners: Vec<_> = corners.iter().map(|corner| point(*corner)).collect();
            let (corners, fill, outline) = (corners.join(" "), hex(*fill), stroke_of(*outline));
            format!("<polygon points=\"{corners}\" fill=\"{fill}\"{outline}/>")
        }
        Shape::Segment { ends: [from, to], stroke } => {
            let ([x1, y1], [x2, y2]) = (from.to_array().map(number), to.to_array().map(number));
            let stroke = stroke_of(Some(*stroke));
            format!("<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"{stroke}/>")
        }
        Shape::Circle { center, radius, fill, outline } => {
            let ([x, y], r) = (center.to_array().map(number), number(*radius));
            let (fill, outline) = (hex(*fill), stroke_of(*outline));
            format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\" fill=\"{fill}\"{outline}/>")
        }
        Shape::Text(text) => line_of_text(text),
    }
}

/// A letter of a monospaced font is 0.6 of its size wide, as 6 of 10 cells.
fn line_of_text(text: &Text) -> String {
    let [x, y] = (text.corner + DVec2::new(0.0, f64::from(7 * text.cell))).to_array().map(number);
    let (size, fill, line) = (10 * text.cell, hex(text.color), escaped(&text.line));
    format!(
        "<text x=\"{x}\" y=\"{y}\" font-family=\"monospace\" font-size=\"{size}\" \
         xml:space=\"preserve\" fill=\"{fill}\">{line}</text>"
    )
}

fn stroke_of(stroke: Option<Stroke>) -> String {
    let Some(stroke) = stroke else { return String::new() };
    let dashes = stroke.dashes().map_or_else(String::new, |dashes| {
        let [dash, gap] = dashes.map(number);
        format!(" stroke-dasharray=\"{dash} {gap}\"")
    });
    let (color, width) = (hex(stroke.color), number(stroke.width));
    format!(" stroke=\"{color}\" stroke-width=\"{width}\"{dashes}")
}

fn point(point: DVec2) -> String {
    format!("{},{}", number(point.x), number(point.y))
}

/// Two digits behind the point at most, and no minus before a zero.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn hex(color: Color) -> String {
    let [red, green, blue] = color.0;
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// What XML reads as the text; characters that it cannot hold become `?`.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            letter if letter.is_control() || matches!(letter, '\u{fffe}' | '\u{ffff}') => {
                escaped.push('?');
            }
            letter => escaped.push(letter),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_short_as_two_digits_allow() {
        for (value, text) in
            [(1.0, "1"), (0.126, "0.13"), (-0.001, "0"), (120.0, "120"), (-2.5, "-2.5")]
        {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn names_cannot_break_out_of_the_text() {
        assert_eq!(escaped("<a & b>\u{1}"), "&lt;a &amp; b&gt;?");
    }
}
