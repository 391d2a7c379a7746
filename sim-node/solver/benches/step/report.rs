//! Output: JSON after each case, or Markdown tables at the end.

use serde::Serialize;

/// The result of a case as a row of a table.
pub(crate) trait Row {
    /// Columns after the name of the case.
    const HEADINGS: &'static [&'static str];

    fn case(&self) -> &str;

    /// Returns one text for each heading.
    fn cells(&self) -> Vec<String>;
}

/// The results so far.
#[derive(Debug, Default)]
pub(crate) struct Report {
    as_json: bool,
    tables: Vec<Table>,
}

#[derive(Debug)]
struct Table {
    headings: &'static [&'static str],
    /// Lines, each starting with the name of its case.
    rows: Vec<Vec<String>>,
}

impl Report {
    pub(crate) fn new(as_json: bool) -> Self {
        Self { as_json, tables: Vec::new() }
    }

    /// Adds the result of a case.
    pub(crate) fn push<R: Row + Serialize>(&mut self, row: &R) {
        if self.as_json {
            println!("{}", serde_json::to_string(row).unwrap());
        }
        self.tabulate(row);
    }

    /// Adds a result to the tables only; the JSON of the case has it already.
    pub(crate) fn tabulate<R: Row>(&mut self, row: &R) {
        let cells = row.cells();
        // Flushed, so that the results so far are visible during the run.
        let parts: Vec<_> = (R::HEADINGS.iter().zip(&cells))
            .map(|(heading, cell)| format!("{heading} {cell}"))
            .collect();
        eprintln!("{}: {}", row.case(), parts.join(", "));
        let place = self.tables.iter().position(|table| table.headings == R::HEADINGS);
        let place = place.unwrap_or_else(|| {
            self.tables.push(Table { headings: R::HEADINGS, rows: Vec::new() });
            self.tables.len() - 1
        });
        let name = std::iter::once(row.case().to_owned());
        self.tables[place].rows.push(name.chain(cells).collect());
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.tables.is_empty()
    }

    /// Prints the tables as Markdown.
    pub(crate) fn finish(&self) {
        for table in self.tables.iter().filter(|_| !self.as_json) {
            table.print();
        }
    }
}

impl Table {
    fn print(&self) {
        let headings: Vec<_> =
            std::iter::once("case").chain(self.headings.iter().copied()).collect();
        let widths: Vec<_> = (0..headings.len())
            .map(|column| {
                let cells = self.rows.iter().map(|row| row[column].len());
                cells.chain([headings[column].len()]).max().unwrap_or(0)
            })
            .collect();
        println!();
        print_line(&headings, &widths);
        let rules: Vec<_> = (widths.iter().enumerate())
            .map(|(column, width)| match column {
                0 => "-".repeat(*width),
                _ => format!("{}:", "-".repeat(width - 1)),
            })
            .collect();
        print_line(&rules, &widths);
        for row in &self.rows {
            print_line(row, &widths);
        }
    }
}

/// Prints names left-aligned and numbers right-aligned.
fn print_line<T: AsRef<str>>(cells: &[T], widths: &[usize]) {
    let padded = cells.iter().zip(widths).enumerate().map(|(column, (cell, width))| match column {
        0 => format!("{:<width$}", cell.as_ref()),
        _ => format!("{:>width$}", cell.as_ref()),
    });
    println!("| {} |", padded.collect::<Vec<_>>().join(" | "));
}

/// Formats a number for a cell; a dash stands for none.
pub(crate) fn cell(number: Option<f64>, decimals: usize) -> String {
    number.map_or_else(|| "-".to_owned(), |number| format!("{number:.decimals$}"))
}
