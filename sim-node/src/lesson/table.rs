//! A table of numbers: aligned text for people, rows as JSON for programs.

use std::fmt;

use serde::{Serialize, Serializer};

/// Width of a note, in characters.
const NOTE_WIDTH: usize = 96;

/// Where the numbers of a column come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Origin {
    /// Chosen: the row is about it.
    Given,
    /// A loop of plain arithmetic in this program.
    Loop,
    /// A scene in the solver.
    Solver,
    /// A closed form.
    Law,
    /// Printed in a tutorial; never computed here.
    Document,
}

impl Origin {
    /// The name in the legend, and in JSON.
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

/// One entry.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub(super) enum Cell {
    /// A measure, printed with the decimals of its column.
    Number(f64),
    /// A count.
    Whole(u32),
    /// A name.
    Word(&'static str),
    /// The document prints nothing for this row; null in JSON.
    Nothing,
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
        number.map_or(Self::Nothing, Self::Number)
    }
}

impl Cell {
    /// As it is printed.
    fn text(self, decimals: usize) -> String {
        match self {
            Self::Number(number) => {
                let text = format!("{number:.decimals$}");
                // What rounds to nothing has no sign.
                let is_zero = text.chars().all(|one| matches!(one, '-' | '0' | '.'));
                if is_zero { text.trim_start_matches('-').to_owned() } else { text }
            }
            Self::Whole(count) => count.to_string(),
            Self::Word(word) => word.to_owned(),
            Self::Nothing => "-".to_owned(),
        }
    }
}

/// One column, from its heading to its last entry.
#[derive(Debug, Serialize)]
pub(super) struct Column {
    /// The heading, and the key in JSON.
    name: &'static str,
    origin: Origin,
    /// What the numbers are, with formula and unit.
    text: &'static str,
    #[serde(skip)]
    decimals: usize,
    #[serde(skip)]
    cells: Vec<Cell>,
}

impl Column {
    /// A column without entries and decimals.
    pub(super) fn new(origin: Origin, name: &'static str, text: &'static str) -> Self {
        Self { name, origin, text, decimals: 0, cells: Vec::new() }
    }

    /// How many decimals are printed; JSON has all of them.
    pub(super) fn decimals(self, decimals: usize) -> Self {
        Self { decimals, ..self }
    }

    /// The entries, one for each row.
    pub(super) fn cells<T: Into<Cell>>(self, cells: impl IntoIterator<Item = T>) -> Self {
        Self { cells: cells.into_iter().map(Into::into).collect(), ..self }
    }

    fn texts(&self) -> impl Iterator<Item = String> + '_ {
        self.cells.iter().map(|cell| cell.text(self.decimals))
    }

    fn width(&self) -> usize {
        self.texts().map(|text| text.len()).fold(self.name.len(), usize::max)
    }
}

/// A table with what there is to say about it.
#[derive(Debug)]
pub(super) struct Table {
    name: &'static str,
    title: &'static str,
    columns: Vec<Column>,
    notes: Vec<String>,
}

impl Table {
    /// A table without columns; the name is a word, the title says what the rows have in common.
    pub(super) fn new(name: &'static str, title: &'static str) -> Self {
        Self { name, title, columns: Vec::new(), notes: Vec::new() }
    }

    /// Adds a column at the right; all of a table's columns have the same number of entries.
    pub(super) fn column(mut self, column: Column) -> Self {
        self.columns.push(column);
        assert_eq!(self.row_count(), self.columns[self.columns.len() - 1].cells.len());
        self
    }

    /// Adds a paragraph below.
    pub(super) fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    fn row_count(&self) -> usize {
        self.columns.first().map_or(0, |column| column.cells.len())
    }

    /// The numbers of a column; a missing one is NaN.
    #[cfg(test)]
    pub(super) fn numbers(&self, name: &str) -> Vec<f64> {
        let column = self.columns.iter().find(|column| column.name == name).unwrap();
        let number = |cell: &Cell| match *cell {
            Cell::Number(number) => number,
            Cell::Whole(count) => f64::from(count),
            Cell::Word(_) | Cell::Nothing => f64::NAN,
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
            writeln!(formatter, "\n{}", wrapped(note))?;
        }
        Ok(())
    }
}

/// A text in lines of at most `NOTE_WIDTH`.
fn wrapped(text: &str) -> String {
    let mut lines = String::new();
    let mut length = 0;
    for word in text.split_whitespace() {
        let gap = if length == 0 { "" } else { " " };
        let is_full = length + gap.len() + word.len() > NOTE_WIDTH;
        lines += if is_full { "\n" } else { gap };
        length = if is_full { 0 } else { length + gap.len() } + word.len();
        lines += word;
    }
    lines
}

/// One row as an object, its keys in the order of the columns.
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
        Table::new("way", "two rows")
            .column(Column::new(Origin::Given, "t", "time, s").cells([1_u32, 10]))
            .column(Column::new(Origin::Law, "x", "way, m").decimals(2).cells([-0.001, 12.345]))
            .column(
                Column::new(Origin::Document, "printed", "m").decimals(1).cells([Some(2.5), None]),
            )
            .note("A note.")
    }

    #[test]
    fn columns_are_aligned_at_the_right_below_their_headings() {
        insta::assert_snapshot!(example());
    }

    #[test]
    fn json_has_each_row_as_an_object_with_every_digit() {
        let json = serde_json::to_value(example()).unwrap();
        let rows = r#"[{"t":1,"x":-0.001,"printed":2.5},{"t":10,"x":12.345,"printed":null}]"#;
        assert_eq!(json["rows"], serde_json::from_str::<serde_json::Value>(rows).unwrap());
        assert_eq!(json["columns"][2]["origin"], "document");
        assert_eq!(json["columns"][0]["text"], "time, s");
    }

    #[test]
    fn notes_are_wrapped_between_words() {
        let text = wrapped(&"word ".repeat(50));
        assert_eq!(text.lines().map(str::len).collect::<Vec<_>>(), [94, 94, 59]);
        assert_eq!(text.split_whitespace().count(), 50);
    }
}
