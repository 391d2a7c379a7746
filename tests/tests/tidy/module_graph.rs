//! The graph of `use` between the source files of a crate, and its circles.
//!
//! A file uses another if it names an item by a path that leads into it: `crate::a::b`, `super::b`,
//! `self::b`, or `b` for a child module of its own. Comments, strings and test modules do not count,
//! and neither does the declaration `mod b;`. Paths through re-exports lead to the file that
//! re-exports.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::read_to_string;
use std::path::{Path, PathBuf};

/// A module path from the root of a crate; empty for the root.
type ModulePath = Vec<String>;

/// Returns the groups of files under a `src` folder that use each other in a circle. Each group is
/// ascending.
pub(crate) fn circles(src: &Path) -> Vec<Vec<String>> {
    let modules = modules(src);
    let mut graph = BTreeMap::new();
    for (module, file) in &modules {
        let text = read_to_string(file).unwrap();
        let used = Scanner::new(&text, module, &modules).used();
        graph.insert(module.clone(), used);
    }
    let name = |module: &ModulePath| {
        modules[module].strip_prefix(src).unwrap().to_string_lossy().into_owned()
    };
    components(&graph)
        .into_iter()
        .map(|group| {
            let mut names: Vec<_> = group.iter().map(name).collect();
            names.sort();
            names
        })
        .collect()
}

/// Every module that has a file. `lib.rs`, or `main.rs` in a crate without a library, is the root.
fn modules(src: &Path) -> BTreeMap<ModulePath, PathBuf> {
    let mut found = BTreeMap::new();
    let mut folders = vec![src.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in folder.read_dir().unwrap().map(|entry| entry.unwrap().path()) {
            if entry.is_dir() {
                folders.push(entry);
                continue;
            }
            let is_test = entry.file_stem().is_some_and(|stem| stem == "tests");
            if is_test || entry.extension().is_none_or(|extension| extension != "rs") {
                continue;
            }
            let relative = entry.strip_prefix(src).unwrap().with_extension("");
            let mut module: ModulePath =
                relative.iter().map(|part| part.to_string_lossy().into_owned()).collect();
            let is_root = module == ["lib"] || (module == ["main"] && !src.join("lib.rs").exists());
            if is_root {
                module.clear();
            }
            found.insert(module, entry);
        }
    }
    found
}

/// Finds the paths in one file.
struct Scanner<'a> {
    tokens: Vec<String>,
    /// The module of the file, then inline modules around the current token.
    scope: ModulePath,
    modules: &'a BTreeMap<ModulePath, PathBuf>,
    file: &'a ModulePath,
    used: BTreeSet<ModulePath>,
}

impl<'a> Scanner<'a> {
    fn new(text: &str, file: &'a ModulePath, modules: &'a BTreeMap<ModulePath, PathBuf>) -> Self {
        let tokens = without_tests(&tokens(text));
        Self { tokens, scope: file.clone(), modules, file, used: BTreeSet::new() }
    }

    /// Returns the modules of the other files that this one uses.
    fn used(mut self) -> BTreeSet<ModulePath> {
        // The brace depths of the inline modules in `scope`.
        let (mut inline, mut depth, mut at) = (Vec::new(), 0, 0);
        while at < self.tokens.len() {
            match self.token(at) {
                "mod" if self.token(at + 2) == "{" => {
                    self.scope.push(self.tokens[at + 1].clone());
                    inline.push(depth);
                    depth += 1;
                    at += 3;
                    continue;
                }
                "{" => depth += 1,
                "}" => {
                    depth -= 1;
                    if inline.last() == Some(&depth) {
                        inline.pop();
                        self.scope.pop();
                    }
                }
                _ if self.begins_path(at) => {
                    at = self.tree(at, self.scope.clone());
                    continue;
                }
                _ => {}
            }
            at += 1;
        }
        self.used
    }

    fn token(&self, at: usize) -> &str {
        self.tokens.get(at).map_or("", String::as_str)
    }

    fn begins_path(&self, at: usize) -> bool {
        // `pub(in crate::a)` is a visibility.
        let is_inside = at > 0 && matches!(self.token(at - 1), "::" | "in");
        if is_inside || self.token(at + 1) != "::" {
            return false;
        }
        let token = self.token(at);
        matches!(token, "crate" | "self" | "super") || self.is_child(token)
    }

    /// True for a module in a file right below that of the scope.
    fn is_child(&self, name: &str) -> bool {
        let mut child = self.scope.clone();
        child.push(name.to_owned());
        self.modules.contains_key(&child)
    }

    /// Follows a path, or a tree of paths in braces, from a token on. Returns the next token.
    fn tree(&mut self, mut at: usize, mut path: ModulePath) -> usize {
        loop {
            match self.token(at) {
                "{" => {
                    at += 1;
                    while !matches!(self.token(at), "}" | "") {
                        at = self.tree(at, path.clone());
                        at = self.after_alias(at);
                    }
                    return at + 1;
                }
                "crate" => path.clear(),
                "super" => drop(path.pop()),
                "self" => {}
                name => path.push(name.to_owned()),
            }
            if self.token(at + 1) != "::" {
                self.uses(&path);
                return at + 1;
            }
            at += 2;
        }
    }

    /// Skips an alias, `as name`, and a comma. Returns the next token.
    fn after_alias(&self, mut at: usize) -> usize {
        while !matches!(self.token(at), "," | "}" | "") {
            at += 1;
        }
        at + usize::from(self.token(at) == ",")
    }

    /// Notes the innermost module of a path that has a file.
    fn uses(&mut self, path: &[String]) {
        let longest =
            (0..=path.len()).rev().find(|length| self.modules.contains_key(&path[..*length]));
        let module = path[..longest.unwrap_or(0)].to_vec();
        if module != *self.file {
            self.used.insert(module);
        }
    }
}

/// Splits a source text into words, `::` and single characters, without comments and literals.
fn tokens(text: &str) -> Vec<String> {
    let (chars, mut tokens): (Vec<char>, Vec<String>) = (text.chars().collect(), Vec::new());
    let starts = |at: usize, pattern: &str| {
        pattern.chars().enumerate().all(|(index, char)| chars.get(at + index) == Some(&char))
    };
    let is_word =
        |at: usize| chars.get(at).is_some_and(|char| char.is_alphanumeric() || *char == '_');
    let mut at = 0;
    while at < chars.len() {
        if starts(at, "//") {
            at += chars[at..].iter().take_while(|char| **char != '\n').count();
        } else if starts(at, "/*") {
            while at < chars.len() && !starts(at, "*/") {
                at += 1;
            }
            at += 2;
        } else if let Some(hashes) = raw_hashes(&chars[at..]) {
            let end = format!("\"{}", "#".repeat(hashes));
            at += 2 + hashes;
            while at < chars.len() && !starts(at, &end) {
                at += 1;
            }
            at += end.len();
        } else if chars[at] == '"' {
            at += 1;
            while at < chars.len() && chars[at] != '"' {
                at += if chars[at] == '\\' { 2 } else { 1 };
            }
            at += 1;
        } else if starts(at, "'\\") {
            at += 3;
            at += chars[at..].iter().take_while(|char| **char != '\'').count() + 1;
        } else if chars[at] == '\'' && chars.get(at + 2) == Some(&'\'') {
            at += 3;
        } else if is_word(at) {
            let start = at;
            while is_word(at) {
                at += 1;
            }
            tokens.push(chars[start..at].iter().collect());
        } else if starts(at, "::") {
            tokens.push("::".to_owned());
            at += 2;
        } else {
            if !chars[at].is_whitespace() {
                tokens.push(chars[at].to_string());
            }
            at += 1;
        }
    }
    tokens
}

/// Number of `#` of the raw string that begins the text. `r#type` is an identifier.
fn raw_hashes(text: &[char]) -> Option<usize> {
    let (first, rest) = text.split_first()?;
    let hashes = rest.iter().take_while(|char| **char == '#').count();
    (*first == 'r' && rest.get(hashes) == Some(&'"')).then_some(hashes)
}

/// Removes the items behind `#[cfg(test)]`.
fn without_tests(tokens: &[String]) -> Vec<String> {
    const MARK: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    let (mut kept, mut at) = (Vec::new(), 0);
    while at < tokens.len() {
        let is_mark = tokens[at..].iter().take(MARK.len()).eq(MARK.iter());
        if !is_mark {
            kept.push(tokens[at].clone());
            at += 1;
            continue;
        }
        let mut depth = 0;
        while at < tokens.len() {
            let token = tokens[at].as_str();
            at += 1;
            match token {
                "{" => depth += 1,
                "}" => depth -= 1,
                _ => {}
            }
            if depth == 0 && matches!(token, "}" | ";") {
                break;
            }
        }
    }
    kept
}

/// Returns the strongly connected components of more than one module.
fn components(graph: &BTreeMap<ModulePath, BTreeSet<ModulePath>>) -> Vec<Vec<ModulePath>> {
    let reachable: BTreeMap<_, _> =
        graph.keys().map(|module| (module, reachable_from(graph, module))).collect();
    let mut assigned = BTreeSet::new();
    let mut components = Vec::new();
    for module in graph.keys() {
        let is_mutual = |other: &&ModulePath| {
            reachable[module].contains(*other) && reachable[*other].contains(module)
        };
        let component: Vec<_> = graph.keys().filter(is_mutual).cloned().collect();
        if component.len() > 1 && assigned.insert(component.clone()) {
            components.push(component);
        }
    }
    components
}

fn reachable_from(
    graph: &BTreeMap<ModulePath, BTreeSet<ModulePath>>,
    start: &ModulePath,
) -> BTreeSet<ModulePath> {
    let (mut reached, mut open) = (BTreeSet::new(), vec![start]);
    while let Some(module) = open.pop() {
        for used in graph.get(module).into_iter().flatten() {
            if reached.insert(used.clone()) {
                open.push(used);
            }
        }
    }
    reached
}

#[cfg(test)]
mod tests {
    //! The finder of circles against small crates.
    use super::*;

    fn circles_of(name: &str, files: &[(&str, &str)]) -> Vec<Vec<String>> {
        let folder = std::env::temp_dir().join(format!("tidy-{}-{name}", std::process::id()));
        for (file, text) in files {
            let path = folder.join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        let found = circles(&folder);
        std::fs::remove_dir_all(&folder).unwrap();
        found
    }

    #[test]
    fn files_that_use_each_other_form_a_circle() {
        let files = [
            ("lib.rs", "mod a; mod b; mod c;"),
            ("a.rs", "use crate::{c, b::{B as Other, self}}; pub struct A;"),
            ("b.rs", "pub struct B; fn f(r#type: u8, _: crate::a::A) {}"),
            ("c.rs", "pub struct C;"),
        ];
        assert_eq!(circles_of("pair", &files), [["a.rs", "b.rs"]]);
    }

    #[test]
    fn a_child_that_uses_an_item_of_its_parent_forms_a_circle() {
        let files = [
            ("lib.rs", "mod a;"),
            ("a.rs", "mod b; pub struct A; fn f() { b::g() }"),
            ("a/b.rs", "pub(in crate::a) fn g() { let _ = super::A; }"),
        ];
        assert_eq!(circles_of("child", &files), [["a.rs", "a/b.rs"]]);
    }

    #[test]
    fn siblings_comments_strings_tests_and_inline_modules_form_none() {
        let files = [
            ("lib.rs", "mod a; pub use a::b::B;"),
            ("a.rs", "pub mod b; mod c; fn f() { c::g() }"),
            (
                "a/b.rs",
                "/// [`crate::a::c::g`]\npub struct B; // crate::B\nconst S: &str = \"super::f\";",
            ),
            (
                "a/c.rs",
                "use super::b::B;\nmod inner { use super::B; }\npub(in crate::a) fn g(_: B) {}\n\
                 #[cfg(test)]\nmod tests { use crate::B; }",
            ),
        ];
        assert_eq!(circles_of("none", &files), Vec::<Vec<String>>::new());
    }
}
