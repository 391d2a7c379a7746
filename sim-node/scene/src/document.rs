//! The document of a scene: tables, lists and values with their places in the text.
//!
//! The parser needs all tokens of the text that it parses at once. A long text is therefore parsed in batches, which end
//! between two statements, or behind a comma of a long list.

use std::borrow::Cow;
use std::mem::take;

use toml_parser::decoder::{Encoding, ScalarKind};
use toml_parser::lexer::{Token, TokenKind};
use toml_parser::parser::{
    EventReceiver, RecursionGuard, ValidateWhitespace, parse_document, parse_value,
};
use toml_parser::{ErrorSink, ParseError, Raw, Source, Span};

use super::error::Problems;

/// Number of tokens from which on a batch ends at the next opportunity.
const BATCH_TOKENS: usize = 1 << 16;
/// Most memory of the document and of the tokens of a batch. The longest complete texts of scenes need two thirds of it.
const MEMORY_MAX_MIB: usize = 160;
/// The brackets where a list is cut.
const BRACKETS: &str = "[]";
/// The place at which a list is cut. No list of a text ends there, because a key precedes it.
const CUT: usize = 1;
/// Deepest nesting, as in other TOML parsers.
const DEPTH_MAX: u32 = 80;
/// Most keys of a table. No table of a scene has half as many, and a key is searched one by one.
const KEYS_MAX: usize = 100;

/// A value with its place in the text, which is shorter than 4 GiB.
#[derive(Debug)]
pub(crate) struct ValueNode<'t> {
    pub(crate) start: u32,
    pub(crate) end: u32,
    pub(crate) value: Value<'t>,
}

impl ValueNode<'_> {
    /// Returns the value of a key, if this is a table.
    pub(crate) fn get(&self, key: &str) -> Option<&Self> {
        match &self.value {
            Value::Table(table) => table.get(key),
            _ => None,
        }
    }
}

// There are millions of nodes.
#[cfg(target_pointer_width = "64")]
const _: () = assert!(size_of::<ValueNode<'_>>() == 32);

/// A value. The text has the digits of numbers.
#[derive(Debug)]
pub(crate) enum Value<'t> {
    Boolean(bool),
    Integer,
    Float,
    Date,
    Text(Box<str>),
    List(Vec<ValueNode<'t>>),
    Table(Box<Table<'t>>),
}

/// A table with its keys in the order of the text.
#[derive(Debug)]
pub(crate) struct Table<'t> {
    pub(crate) entries: Vec<Entry<'t>>,
    origin: Origin,
}

/// A key with its value.
#[derive(Debug)]
pub(crate) struct Entry<'t> {
    pub(crate) key: Cow<'t, str>,
    /// Place of the key.
    pub(crate) start: u32,
    pub(crate) node: ValueNode<'t>,
}

/// The form in which a table is written, which decides what can be added to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Origin {
    /// `[key]` or `[[key]]`.
    Header,
    /// A part of a longer header.
    HeaderPath,
    /// A part of a dotted key.
    DottedKey,
    /// `{ ... }`.
    Inline,
}

impl<'t> Table<'t> {
    fn new(origin: Origin) -> Self {
        Self { entries: Vec::new(), origin }
    }

    /// Returns the value of a key.
    pub(crate) fn get(&self, key: &str) -> Option<&ValueNode<'t>> {
        self.entries.iter().find(|entry| entry.key == key).map(|entry| &entry.node)
    }

    /// Returns the elements of the list with this key; none if it is no list.
    pub(crate) fn list(&self, key: &str) -> &[ValueNode<'t>] {
        match self.get(key).map(|node| &node.value) {
            Some(Value::List(list)) => list,
            _ => &[],
        }
    }

    /// Returns the entry of a table below this one for a part of a longer key, and makes it if there is none. `None`: the key has
    /// a value to which nothing can be added, which is reported.
    fn descend(&mut self, key: &Key<'t>, origin: Origin, problems: &Problems<'_>) -> Option<usize> {
        let Some(index) = self.entries.iter().position(|entry| entry.key == key.name) else {
            let table = Value::Table(Box::new(Table::new(origin)));
            let node = ValueNode { start: key.start, end: key.start, value: table };
            return self.push(key.clone(), node, problems).then(|| self.entries.len() - 1);
        };
        let can_grow = match &self.entries[index].node.value {
            Value::Table(table) => match table.origin {
                Origin::Inline => false,
                Origin::Header => origin == Origin::HeaderPath,
                Origin::HeaderPath | Origin::DottedKey => true,
            },
            Value::List(list) => origin == Origin::HeaderPath && is_list_of_headers(list),
            _ => false,
        };
        if !can_grow {
            problems.add_duplicate(key.start, &key.name);
        }
        can_grow.then_some(index)
    }

    /// Returns the table of an entry, or the last one of a list of tables.
    fn below(&mut self, index: usize) -> Option<&mut Self> {
        match &mut self.entries[index].node.value {
            Value::Table(table) => Some(table),
            Value::List(list) => match &mut list.last_mut()?.value {
                Value::Table(table) => Some(table),
                _ => None,
            },
            _ => None,
        }
    }

    /// Adds a key. Returns `false`, and reports it, if the table is full.
    fn push(&mut self, key: Key<'t>, node: ValueNode<'t>, problems: &Problems<'_>) -> bool {
        let has_room = self.entries.len() < KEYS_MAX;
        if has_room {
            // Most tables are small, and of some there are millions.
            if self.entries.len() == self.entries.capacity() {
                self.entries.reserve_exact(self.entries.len().max(1));
            }
            self.entries.push(Entry { key: key.name, start: key.start, node });
        } else {
            let problem =
                format!("is one of more than {KEYS_MAX} keys of a table (allowed: {KEYS_MAX})");
            problems.add(key.start as usize, &key.name, problem);
        }
        has_room
    }
}

/// Returns `true` for tables below the header `[[key]]`, as opposed to a list in brackets.
fn is_list_of_headers(list: &[ValueNode<'_>]) -> bool {
    let last = list.last().map(|node| &node.value);
    matches!(last, Some(Value::Table(table)) if table.origin == Origin::Header)
}

/// A part of a key.
#[derive(Clone)]
struct Key<'t> {
    name: Cow<'t, str>,
    start: u32,
}

/// Parses a text. With errors of the syntax, the document is incomplete.
pub(super) fn parse<'t>(text: &'t str, problems: &Problems<'_>) -> Table<'t> {
    let mut builder = Builder::new(text, problems);
    let mut brackets = Source::new(BRACKETS).lex();
    let (Some(mut open), Some(close)) = (brackets.next(), brackets.next()) else {
        return builder.root;
    };
    let mut tokens = Vec::new();
    let (mut depth, mut is_value, mut is_list, mut is_continued) = (0_usize, false, false, false);
    for token in Source::new(text).lex() {
        let kind = token.kind();
        match kind {
            TokenKind::LeftSquareBracket | TokenKind::LeftCurlyBracket => {
                if depth == 0 {
                    is_list = is_value && kind == TokenKind::LeftSquareBracket;
                    open = token;
                }
                depth += 1;
            }
            TokenKind::RightSquareBracket | TokenKind::RightCurlyBracket => {
                depth = depth.saturating_sub(1);
            }
            _ => {}
        }
        if kind != TokenKind::Whitespace {
            is_value = kind == TokenKind::Equals;
        }
        push(&mut tokens, token);
        let is_full = tokens.len() >= BATCH_TOKENS;
        if is_continued && depth == 0 {
            builder.parse(&mut tokens, is_continued);
            is_continued = false;
        } else if is_full && depth == 0 && kind == TokenKind::Newline {
            builder.parse(&mut tokens, is_continued);
        } else if is_full && depth == 1 && is_list && kind == TokenKind::Comma {
            tokens.push(close);
            builder.parse(&mut tokens, is_continued);
            tokens.push(open);
            is_continued = true;
        }
        if tokens.len() % BATCH_TOKENS <= 1 && builder.needs_too_much(&tokens) {
            return builder.root;
        }
    }
    builder.parse(&mut tokens, is_continued);
    builder.needs_too_much(&tokens);
    builder.root
}

/// Appends to a list that can be long, with less spare room than by doubling.
fn push<T>(list: &mut Vec<T>, element: T) {
    if list.len() == list.capacity() && list.len() >= BATCH_TOKENS {
        list.reserve_exact(list.len() / 8);
    }
    list.push(element);
}

/// Makes the document of the events of the parser. After the first error, only further errors matter.
struct Builder<'t, 'p> {
    text: &'t str,
    problems: &'p Problems<'p>,
    root: Table<'t>,
    /// Entries on the way from the root to the current table.
    current: Vec<usize>,
    header_start: usize,
    /// The lists and inline tables that are open.
    frames: Vec<OpenValue<'t>>,
    /// The key of the next value or header.
    keys: Vec<Key<'t>>,
    /// The next list began in an earlier batch.
    is_continued: bool,
    size_bytes: usize,
}

/// An open list or inline table.
struct OpenValue<'t> {
    start: usize,
    /// The key of the value.
    keys: Vec<Key<'t>>,
    value: Value<'t>,
}

impl<'t, 'p> Builder<'t, 'p> {
    fn new(text: &'t str, problems: &'p Problems<'p>) -> Self {
        Self {
            text,
            problems,
            root: Table::new(Origin::Header),
            current: Vec::new(),
            header_start: 0,
            frames: Vec::new(),
            keys: Vec::new(),
            is_continued: false,
            size_bytes: 0,
        }
    }

    /// Parses a batch: statements, or the further elements of a list.
    fn parse(&mut self, tokens: &mut Vec<Token>, is_continued: bool) {
        let (source, problems) = (Source::new(self.text), self.problems);
        self.is_continued = is_continued;
        let mut guard = RecursionGuard::new(self, DEPTH_MAX);
        let mut receiver = ValidateWhitespace::new(&mut guard, source);
        let mut sink = |error: ParseError| problems.add_syntax(&error);
        let parse = if is_continued { parse_value } else { parse_document };
        parse(tokens, &mut receiver, &mut sink);
        tokens.clear();
    }

    /// Reports a text that needs too much memory.
    fn needs_too_much(&self, tokens: &[Token]) -> bool {
        let memory_mib = (self.size_bytes + size_of_val(tokens)) >> 20;
        if memory_mib <= MEMORY_MAX_MIB {
            return false;
        }
        let problem = format!(
            "needs more than {MEMORY_MAX_MIB} MiB to parse its tables and lists (allowed: fewer; the lists of a mesh can be an \
             OBJ file, or base64 as in the output of `sim-node show`)"
        );
        self.problems.add(0, "scene", problem);
        true
    }

    /// Puts a finished value into the open list or table.
    fn finish(&mut self, node: ValueNode<'t>) {
        let keys = take(&mut self.keys);
        self.size_bytes += size_of::<ValueNode<'_>>();
        match self.frames.last_mut().map(|frame| &mut frame.value) {
            Some(Value::List(list)) => return push(list, node),
            Some(Value::Table(table)) => {
                self.size_bytes += assign(table, keys, node, self.problems);
                return;
            }
            _ => {}
        }
        let mut table = &mut self.root;
        for &index in &self.current {
            let Some(below) = table.below(index) else { return };
            table = below;
        }
        self.size_bytes += assign(table, keys, node, self.problems);
    }

    fn open(&mut self, span: Span, value: Value<'t>) -> bool {
        if !take(&mut self.is_continued) && self.problems.is_empty() {
            self.frames.push(OpenValue { start: span.start(), keys: take(&mut self.keys), value });
        }
        true
    }

    fn close(&mut self, span: Span) {
        if span.start() == CUT || !self.problems.is_empty() {
            return;
        }
        let Some(OpenValue { start, keys, mut value }) = self.frames.pop() else { return };
        if let Value::List(list) = &mut value {
            list.shrink_to_fit();
        }
        self.keys = keys;
        self.finish(node(start, span.end(), value));
    }

    /// Begins the table of a header.
    fn begin_table(&mut self, span: Span, is_list: bool) {
        let mut keys = take(&mut self.keys);
        let Some(last) = keys.pop().filter(|_| self.problems.is_empty()) else { return };
        self.current.clear();
        let mut table = &mut self.root;
        for key in &keys {
            let Some(index) = table.descend(key, Origin::HeaderPath, self.problems) else { return };
            self.current.push(index);
            let Some(below) = table.below(index) else { return };
            table = below;
        }
        self.size_bytes += size_of::<Table<'_>>() + size_of::<ValueNode<'_>>();
        let new = || Value::Table(Box::new(Table::new(Origin::Header)));
        let (start, end) = (self.header_start, span.end());
        let index = table.entries.iter().position(|entry| entry.key == last.name);
        let existing = index.map(|index| &mut table.entries[index].node.value);
        match existing {
            None => {
                self.size_bytes += size_of::<Entry<'_>>();
                let header = node(start, end, new());
                let value =
                    if is_list { node(start, end, Value::List(vec![header])) } else { header };
                if !table.push(last, value, self.problems) {
                    return;
                }
            }
            Some(Value::List(list)) if is_list && is_list_of_headers(list) => {
                push(list, node(start, end, new()));
            }
            Some(Value::Table(table)) if !is_list && table.origin == Origin::HeaderPath => {
                table.origin = Origin::Header;
            }
            Some(_) => return self.problems.add_duplicate(last.start, &last.name),
        }
        self.current.push(index.unwrap_or(table.entries.len() - 1));
    }
}

/// Sets the value of a key. Returns the memory of the keys.
fn assign<'t>(
    mut table: &mut Table<'t>,
    mut keys: Vec<Key<'t>>,
    node: ValueNode<'t>,
    problems: &Problems<'_>,
) -> usize {
    let Some(last) = keys.pop() else { return 0 };
    for key in &keys {
        let Some(index) = table.descend(key, Origin::DottedKey, problems) else { return 0 };
        let Some(below) = table.below(index) else { return 0 };
        table = below;
    }
    let capacity = table.entries.capacity();
    if table.get(&last.name).is_some() {
        problems.add_duplicate(last.start, &last.name);
    } else {
        table.push(last, node, problems);
    }
    (table.entries.capacity() - capacity) * size_of::<Entry<'_>>()
        + keys.len() * (size_of::<Entry<'_>>() + size_of::<Table<'_>>())
}

fn node(start: usize, end: usize, value: Value<'_>) -> ValueNode<'_> {
    ValueNode { start: place(start), end: place(end), value }
}

/// The text of a scene has at most 16 MiB.
fn place(offset: usize) -> u32 {
    u32::try_from(offset).unwrap_or(u32::MAX)
}

impl EventReceiver for Builder<'_, '_> {
    fn std_table_open(&mut self, span: Span, _: &mut dyn ErrorSink) {
        self.keys.clear();
        self.header_start = span.start();
    }

    fn std_table_close(&mut self, span: Span, _: &mut dyn ErrorSink) {
        self.begin_table(span, false);
    }

    fn array_table_open(&mut self, span: Span, _: &mut dyn ErrorSink) {
        self.keys.clear();
        self.header_start = span.start();
    }

    fn array_table_close(&mut self, span: Span, _: &mut dyn ErrorSink) {
        self.begin_table(span, true);
    }

    fn inline_table_open(&mut self, span: Span, _: &mut dyn ErrorSink) -> bool {
        self.size_bytes += size_of::<Table<'_>>();
        self.open(span, Value::Table(Box::new(Table::new(Origin::Inline))))
    }

    fn inline_table_close(&mut self, span: Span, _: &mut dyn ErrorSink) {
        self.close(span);
    }

    fn array_open(&mut self, span: Span, _: &mut dyn ErrorSink) -> bool {
        self.open(span, Value::List(Vec::new()))
    }

    fn array_close(&mut self, span: Span, _: &mut dyn ErrorSink) {
        self.close(span);
    }

    fn simple_key(&mut self, span: Span, encoding: Option<Encoding>, error: &mut dyn ErrorSink) {
        if self.keys.len() >= DEPTH_MAX as usize {
            self.problems.add(
                span.start(),
                "syntax",
                format!("a key of more than {DEPTH_MAX} parts (allowed: {DEPTH_MAX})"),
            );
        }
        if !self.problems.is_empty() {
            return;
        }
        let mut name = Cow::Borrowed("");
        raw(self.text, span, encoding).decode_key(&mut name, error);
        self.keys.push(Key { name, start: place(span.start()) });
    }

    fn scalar(&mut self, span: Span, encoding: Option<Encoding>, error: &mut dyn ErrorSink) {
        let mut decoded = Cow::Borrowed("");
        let value = match raw(self.text, span, encoding).decode_scalar(&mut decoded, error) {
            ScalarKind::String => Value::Text(decoded.into()),
            ScalarKind::Boolean(value) => Value::Boolean(value),
            ScalarKind::Integer(_) => Value::Integer,
            ScalarKind::Float => Value::Float,
            ScalarKind::DateTime => Value::Date,
        };
        if self.problems.is_empty() {
            self.finish(node(span.start(), span.end(), value));
        }
    }
}

fn raw(text: &str, span: Span, encoding: Option<Encoding>) -> Raw<'_> {
    Raw::new_unchecked(&text[span.start()..span.end()], encoding, span)
}
