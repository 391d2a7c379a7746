//! Encodes a picture as SVG, with two decimal places.

use glam::DVec2;

use super::shape::{BACKGROUND, Color, Picture, Shape, Stroke, Text};

/// Returns the text of the file. Equal pictures give equal texts.
pub fn encode(picture: &Picture) -> String {
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
            let (corners, fill, outline) =
                (corners.join(" "), hex(*fill), stroke_attributes(*outline));
            format!("<polygon points=\"{corners}\" fill=\"{fill}\"{outline}/>")
        }
        Shape::Segment { ends: [from, to], stroke } => {
            let ([x1, y1], [x2, y2]) = (from.to_array().map(number), to.to_array().map(number));
            let stroke = stroke_attributes(Some(*stroke));
            format!("<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"{stroke}/>")
        }
        Shape::Circle { center, radius, fill, outline } => {
            let ([x, y], r) = (center.to_array().map(number), number(*radius));
            let (fill, outline) = (hex(*fill), stroke_attributes(*outline));
            format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\" fill=\"{fill}\"{outline}/>")
        }
        Shape::Text(text) => text_element(text),
    }
}

/// The width of a monospaced letter is 0.6 of the font size, which corresponds to 6 of 10 cells.
fn text_element(text: &Text) -> String {
    let [x, y] = (text.corner + DVec2::new(0.0, f64::from(7 * text.cell))).to_array().map(number);
    let (size, fill, line) = (10 * text.cell, hex(text.color), escaped(&text.line));
    format!(
        "<text x=\"{x}\" y=\"{y}\" font-family=\"monospace\" font-size=\"{size}\" \
         xml:space=\"preserve\" fill=\"{fill}\">{line}</text>"
    )
}

fn stroke_attributes(stroke: Option<Stroke>) -> String {
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

/// Formats a number with at most two decimal places and without a negative zero.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn hex(color: Color) -> String {
    let [red, green, blue] = color.0;
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Escapes text for XML. Characters that XML does not allow become `?`.
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
    fn numbers_have_at_most_two_decimal_places() {
        for (value, text) in
            [(1.0, "1"), (0.126, "0.13"), (-0.001, "0"), (120.0, "120"), (-2.5, "-2.5")]
        {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn special_characters_in_names_are_escaped() {
        assert_eq!(escaped("<a & b>\u{1}"), "&lt;a &amp; b&gt;?");
    }
}
