//! Tables of numbers: aligned text for people, rows in JSON for programs.

use std::fmt;

use serde::{Serialize, Serializer};

/// Width of a note, in characters.
const NOTE_WIDTH: usize = 96;

/// Source of a column's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Origin {
    /// A chosen value that identifies the row.
    Given,
    /// A loop of plain arithmetic in this crate.
    Loop,
    /// A scene in the solver.
    Solver,
    /// A closed form.
    Law,
    /// Numbers that a tutorial prints. They are never computed here.
    Document,
}

impl Origin {
    /// Returns the name in the legend and in JSON.
    fn name(self) -> &'static str {
        match self {
            Self::Given => "given",
            Self::Loop => "loop",
            Self::Solver => "solver",
            Self::Law => "law",
            Self::Document => "document",
        }
    }
}

/// One entry of a column.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Cell {
    /// A measurement, printed with the decimals of its column.
    Number(f64),
    /// A count.
    Whole(u32),
    /// A name.
    Word(&'static str),
    /// No value in this row; null in JSON.
    Empty,
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<u32> for Cell {
    fn from(count: u32) -> Self {
        Self::Whole(count)
    }
}

impl From<&'static str> for Cell {
    fn from(word: &'static str) -> Self {
        Self::Word(word)
    }
}

impl From<Option<f64>> for Cell {
    fn from(number: Option<f64>) -> Self {
        number.map_or(Self::Empty, Self::Number)
    }
}

impl Cell {
    /// Returns the form in CSV: all digits, and nothing for no value. No word has a comma or a quote.
    fn csv(self) -> String {
        match self {
            Self::Number(number) => format!("{number:?}"),
            Self::Whole(_) | Self::Word(_) => self.text(0),
            Self::Empty => String::new(),
        }
    }

    /// Returns the printed form.
    fn text(self, decimals: usize) -> String {
        match self {
            Self::Number(number) => {
                let text = format!("{number:.decimals$}");
                // A number that rounds to 0 is printed without a sign.
                let is_zero = text.chars().all(|one| matches!(one, '-' | '0' | '.'));
                if is_zero { text.trim_start_matches('-').to_owned() } else { text }
            }
            Self::Whole(count) => count.to_string(),
            Self::Word(word) => word.to_owned(),
            Self::Empty => "-".to_owned(),
        }
    }
}

/// One column, from its heading to its last entry.
#[derive(Debug, Serialize)]
pub(crate) struct Column {
    /// Heading, and key in JSON.
    name: &'static str,
    origin: Origin,
    /// Meaning of the numbers, with formula and unit.
    text: &'static str,
    #[serde(skip)]
    decimals: usize,
    #[serde(skip)]
    cells: Vec<Cell>,
}

impl Column {
    /// Creates a column without entries and without decimals.
    pub(crate) fn new(origin: Origin, name: &'static str, text: &'static str) -> Self {
        Self { name, origin, text, decimals: 0, cells: Vec::new() }
    }

    /// Sets the number of printed decimals. JSON has all digits.
    pub(crate) fn decimals(self, decimals: usize) -> Self {
        Self { decimals, ..self }
    }

    /// Sets the entries, one per row.
    pub(crate) fn cells<T: Into<Cell>>(self, cells: impl IntoIterator<Item = T>) -> Self {
        Self { cells: cells.into_iter().map(Into::into).collect(), ..self }
    }

    fn texts(&self) -> impl Iterator<Item = String> + '_ {
        self.cells.iter().map(|cell| cell.text(self.decimals))
    }

    fn width(&self) -> usize {
        self.texts().map(|text| text.len()).fold(self.name.len(), usize::max)
    }
}

/// A table with a legend and notes.
///
/// [`Display`](fmt::Display) prints aligned text. JSON has the columns with their sources and each
/// row as an object.
#[derive(Debug)]
pub struct Table {
    name: &'static str,
    title: &'static str,
    columns: Vec<Column>,
    notes: Vec<String>,
}

impl Table {
    /// Creates a table without columns. The name is one word; the title says what all rows share.
    pub(crate) fn new(name: &'static str, title: &'static str) -> Self {
        Self { name, title, columns: Vec::new(), notes: Vec::new() }
    }

    /// Adds a column at the right. All columns of a table have the same number of entries.
    pub(crate) fn column(mut self, column: Column) -> Self {
        self.columns.push(column);
        assert_eq!(self.row_count(), self.columns[self.columns.len() - 1].cells.len());
        self
    }

    /// Adds a paragraph below the table.
    pub(crate) fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// Returns the table as CSV with all digits, below a comment with its name and title.
    pub fn to_csv(&self) -> String {
        let names: Vec<_> = self.columns.iter().map(|column| column.name.to_owned()).collect();
        let rows = (0..self.row_count()).map(|row| {
            let cells = self.columns.iter().map(|column| column.cells[row].csv());
            cells.collect::<Vec<_>>().join(",")
        });
        let mut text = format!("# {}: {}\n{}\n", self.name, self.title, names.join(","));
        for row in rows {
            text += &row;
            text.push('\n');
        }
        text
    }

    fn row_count(&self) -> usize {
        self.columns.first().map_or(0, |column| column.cells.len())
    }

    /// Returns the numbers of a column. Words and empty entries are NaN.
    #[cfg(test)]
    pub(crate) fn numbers(&self, name: &str) -> Vec<f64> {
        let column = self.columns.iter().find(|column| column.name == name).unwrap();
        let number = |cell: &Cell| match *cell {
            Cell::Number(number) => number,
            Cell::Whole(count) => f64::from(count),
            Cell::Word(_) | Cell::Empty => f64::NAN,
        };
        column.cells.iter().map(number).collect()
    }
}

impl fmt::Display for Table {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "{}: {}\n", self.name, self.title)?;
        let mut lines = vec![String::new(); self.row_count() + 1];
        for column in &self.columns {
            let width = column.width();
            let texts = std::iter::once(column.name.to_owned()).chain(column.texts());
            for (line, text) in lines.iter_mut().zip(texts) {
                *line += &format!("  {text:>width$}");
            }
        }
        for line in lines {
            writeln!(formatter, "{line}")?;
        }
        writeln!(formatter)?;
        let width = self.columns.iter().map(|column| column.name.len()).max().unwrap_or_default();
        for Column { name, origin, text, .. } in &self.columns {
            writeln!(formatter, "  {name:<width$}  {:<8}  {text}", origin.name())?;
        }
        for note in &self.notes {
            writeln!(formatter, "\n{}", wrap(note))?;
        }
        Ok(())
    }
}

/// Wraps a text into lines of at most `NOTE_WIDTH` characters.
fn wrap(text: &str) -> String {
    let mut lines = String::new();
    let mut length = 0;
    for word in text.split_whitespace() {
        let space = if length == 0 { "" } else { " " };
        let is_full = length + space.len() + word.len() > NOTE_WIDTH;
        lines += if is_full { "\n" } else { space };
        length = if is_full { 0 } else { length + space.len() } + word.len();
        lines += word;
    }
    lines
}

/// One row, serialized as an object with its keys in the order of the columns.
struct Row<'a> {
    table: &'a Table,
    index: usize,
}

impl Serialize for Row<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let columns = self.table.columns.iter();
        serializer.collect_map(columns.map(|column| (column.name, column.cells[self.index])))
    }
}

impl Serialize for Table {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct ByRow<'a> {
            name: &'static str,
            title: &'static str,
            columns: &'a [Column],
            rows: Vec<Row<'a>>,
            notes: &'a [String],
        }
        let Self { name, title, columns, notes } = self;
        let rows = (0..self.row_count()).map(|index| Row { table: self, index }).collect();
        ByRow { name, title, columns, rows, notes }.serialize(serializer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Table {
        Table::new("fall", "two rows")
            .column(Column::new(Origin::Given, "t", "time, s").cells([1_u32, 10]))
            .column(
                Column::new(Origin::Law, "x", "distance, m").decimals(2).cells([-0.001, 12.345]),
            )
            .column(
                Column::new(Origin::Document, "printed", "m").decimals(1).cells([Some(2.5), None]),
            )
            .note("A note.")
    }

    #[test]
    fn columns_are_right_aligned_below_their_headings() {
        insta::assert_snapshot!(example());
    }

    #[test]
    fn json_has_each_row_as_an_object_with_all_digits() {
        let json = serde_json::to_value(example()).unwrap();
        let rows = r#"[{"t":1,"x":-0.001,"printed":2.5},{"t":10,"x":12.345,"printed":null}]"#;
        assert_eq!(json["rows"], serde_json::from_str::<serde_json::Value>(rows).unwrap());
        assert_eq!(json["columns"][2]["origin"], "document");
        assert_eq!(json["columns"][0]["text"], "time, s");
    }

    #[test]
    fn csv_has_a_comment_a_heading_and_all_digits() {
        let csv = example().to_csv();
        assert_eq!(csv, "# fall: two rows\nt,x,printed\n1,-0.001,2.5\n10,12.345,\n");
    }

    #[test]
    fn notes_are_wrapped_between_words() {
        let text = wrap(&"word ".repeat(50));
        assert_eq!(text.lines().map(str::len).collect::<Vec<_>>(), [94, 94, 59]);
        assert_eq!(text.split_whitespace().count(), 50);
    }
}
