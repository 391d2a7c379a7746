//! Division of a long text into pieces that are parsed one after another.
//!
//! The parser needs up to a few hundred times the memory of its text. A long text needs that for one
//! piece at a time. It is divided before the headers of tables, and long lists between their elements.

use std::iter::once;
use std::ops::Range;

use toml_parser::Source;
use toml_parser::lexer::{Token, TokenKind};

use crate::scene::read::anchor::FileAnchor;
use crate::scene::read::collider::FileCollider;
use crate::scene::read::generator::file::FileGenerator;

/// Size from which on a piece ends at the next opportunity, in bytes. A shorter text is one piece.
const PIECE_SIZE_BYTES: usize = 256 << 10;
/// Least size of the first part of a divided list, in bytes. It limits the number of divided lists.
const LIST_SIZE_BYTES: usize = 64 << 10;

/// A part of a text that is a TOML document by itself.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Piece<'t> {
    /// The ranges of the text that form the document, ascending.
    pub(super) ranges: Vec<Range<usize>>,
    /// A list of tables, if its first table here has further elements for the lists of the last one in
    /// the pieces before.
    pub(super) continued: Option<&'t str>,
}

/// Divides a text. The first of several pieces ends before the first header.
///
/// A text with a header such as `[anchor.path]` behind other tables than its own is one piece.
pub(super) fn pieces(text: &str) -> Vec<Piece<'_>> {
    let whole = || vec![Piece { ranges: once(0..text.len()).collect(), continued: None }];
    if text.len() <= PIECE_SIZE_BYTES {
        return whole();
    }
    let mut divider = Divider { text, is_line_start: true, ..Divider::default() };
    for token in Source::new(text).lex() {
        divider.receive(token);
    }
    divider.finish().unwrap_or_else(whole)
}

/// Divides a text token by token. Brackets that do not match are left to the parser: a piece that
/// contains one is no TOML document either.
#[derive(Default)]
struct Divider<'t> {
    text: &'t str,
    /// The complete pieces.
    pieces: Vec<Piece<'t>>,
    /// The current piece: its complete ranges, and the start of the last one.
    ranges: Vec<Range<usize>>,
    start: usize,
    continued: Option<&'t str>,
    /// The pieces with the rest of the long lists of the current table. It is the last one of the
    /// current piece, which is full when it divides a list.
    rests: Vec<Piece<'t>>,
    /// The last header with a single key.
    table: Option<Header<'t>>,
    /// The lists that the current table can have, if they can be divided.
    lists: &'static [&'static str],
    /// Start of the key of such a list, from the key to the bracket.
    key: Option<usize>,
    list: Option<List>,
    has_path: bool,
    /// Number of open brackets and braces.
    depth: usize,
    is_line_start: bool,
    has_stray_header: bool,
}

/// A list that can be divided.
struct List {
    /// The key, up to and including the bracket.
    opening: Range<usize>,
    /// The places behind commas at which the list is divided.
    cuts: Vec<usize>,
}

impl<'t> Divider<'t> {
    fn receive(&mut self, token: Token) {
        let (start, end) = (token.span().start(), token.span().end());
        match token.kind() {
            TokenKind::LeftSquareBracket if self.depth == 0 && self.is_line_start => {
                self.begin_table(start);
                self.depth = 1;
            }
            TokenKind::LeftSquareBracket | TokenKind::LeftCurlyBracket => {
                if self.depth == 0 {
                    let opening = self.key.take().map(|key| key..end);
                    self.list = opening.map(|opening| List { opening, cuts: Vec::new() });
                }
                self.depth += 1;
            }
            TokenKind::RightSquareBracket | TokenKind::RightCurlyBracket => {
                self.depth = self.depth.saturating_sub(1);
                if self.depth == 0 {
                    self.end_list(start..end);
                }
            }
            TokenKind::Comma if self.depth == 1 => self.divide_list(end),
            TokenKind::Atom if self.depth == 0 && self.is_line_start => {
                self.key = self.lists.contains(&&self.text[start..end]).then_some(start);
            }
            // A dotted key is not the key of a list, nor is a key on a line before it.
            TokenKind::Dot | TokenKind::Newline if self.depth == 0 => self.key = None,
            _ => {}
        }
        self.is_line_start = match token.kind() {
            TokenKind::Newline => true,
            TokenKind::Whitespace => self.is_line_start,
            _ => false,
        };
    }

    fn begin_table(&mut self, start: usize) {
        let header = Header::new(self.text, start);
        let is_full = self.is_full(start);
        self.lists = header.lists();
        if header.has_single_key() {
            if self.table.is_none() || is_full {
                self.end_piece(start);
            }
            self.table = Some(header);
            self.has_path = false;
            return;
        }
        let Some(table) = self.table.as_ref().filter(|table| header.is_below(table)) else {
            self.has_stray_header = true;
            return;
        };
        if header.is_list && header.path == "anchor.path" {
            let (line, list) = (table.line.clone(), table.path);
            // The first one stays with the anchor, which must not have the key `path` as well.
            if self.has_path && is_full {
                self.end_piece(start);
                self.ranges.push(line);
                self.continued = Some(list);
            }
            self.has_path = true;
        }
    }

    /// Returns `true` if the current piece is long enough to end here.
    fn is_full(&self, end: usize) -> bool {
        self.ranges.iter().map(Range::len).sum::<usize>() + end - self.start >= PIECE_SIZE_BYTES
    }

    fn end_piece(&mut self, end: usize) {
        self.ranges.push(self.start..end);
        self.start = end;
        let ranges = std::mem::take(&mut self.ranges);
        self.pieces.push(Piece { ranges, continued: self.continued.take() });
        self.pieces.append(&mut self.rests);
    }

    /// Divides a long list behind a comma.
    fn divide_list(&mut self, end: usize) {
        let Some(mut list) = self.list.take() else { return };
        match list.cuts.last() {
            Some(cut) if end - cut >= PIECE_SIZE_BYTES => list.cuts.push(end),
            None if end - list.opening.end >= LIST_SIZE_BYTES && self.is_full(end) => {
                list.cuts.push(end);
                self.ranges.push(self.start..end);
            }
            _ => {}
        }
        self.list = Some(list);
    }

    /// Continues the current piece at the bracket of a list. What has been cut off becomes pieces of
    /// its own, each with the header of the table, the key and the bracket.
    fn end_list(&mut self, bracket: Range<usize>) {
        let (Some(List { opening, cuts }), Some(table)) = (self.list.take(), &self.table) else {
            return;
        };
        let ends = cuts.iter().skip(1).copied().chain([bracket.start]);
        for (cut, end) in cuts.iter().zip(ends) {
            let ranges = vec![table.line.clone(), opening.clone(), *cut..end, bracket.clone()];
            self.rests.push(Piece { ranges, continued: Some(table.path) });
        }
        if !cuts.is_empty() {
            self.start = bracket.start;
        }
    }

    /// Returns the pieces, unless the text cannot be divided.
    fn finish(mut self) -> Option<Vec<Piece<'t>>> {
        if let Some(cut) = self.list.as_ref().and_then(|list| list.cuts.last().copied()) {
            // The list has no end. The parser finds the reason behind the last cut, or else the missing
            // bracket at the end of the text.
            let end = self.text.floor_char_boundary(cut + PIECE_SIZE_BYTES + LIST_SIZE_BYTES);
            self.ranges.push(cut..end);
            self.start = self.text.len();
        }
        self.end_piece(self.text.len());
        (!self.has_stray_header).then_some(self.pieces)
    }
}

/// The header of a table.
struct Header<'t> {
    /// The keys, joined by dots.
    path: &'t str,
    /// `[[path]]` instead of `[path]`.
    is_list: bool,
    /// The line with its newline.
    line: Range<usize>,
}

impl<'t> Header<'t> {
    fn new(text: &'t str, start: usize) -> Self {
        let line = text[start..].split_inclusive('\n').next().unwrap_or_default();
        let path = line.trim_start_matches('[').split(']').next().unwrap_or_default().trim();
        Self { path, is_list: line.starts_with("[["), line: start..start + line.len() }
    }

    /// Returns `true` for a single key without quotes.
    fn has_single_key(&self) -> bool {
        let is_bare = |at: char| at.is_ascii_alphanumeric() || at == '_' || at == '-';
        !self.path.is_empty() && self.path.chars().all(is_bare)
    }

    fn is_below(&self, table: &Self) -> bool {
        self.path.strip_prefix(table.path).is_some_and(|rest| rest.starts_with('.'))
    }

    /// Returns the lists of any length in a table with this header.
    fn lists(&self) -> &'static [&'static str] {
        match self.path {
            "anchor" if self.is_list => &FileAnchor::LISTS,
            "collider" if self.is_list => &FileCollider::LISTS,
            "generate" if self.is_list => &FileGenerator::LISTS,
            _ => &[],
        }
    }
}
