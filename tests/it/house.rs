//! The rules of the house, checked on the sources as text (see ARCHITECTURE.md).

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use texforge::ErrorKind;

/// The rooms, lowest first. A room uses those before it and itself.
const ROOMS: [&str; 10] =
    ["base", "image", "signal", "search", "analyze", "method", "export", "verb", "cli", "python"];

/// Longest file that can still be read in one go.
const LONGEST: usize = 500;

/// A source file.
struct Source {
    /// Path below `src/`, with `/`.
    name: String,
    /// The text as it is.
    text: String,
    /// The text without comments and, from `#[cfg(test)]` at the left edge on, without tests.
    code: String,
    /// What the file tests.
    tests: String,
}

impl Source {
    fn read(root: &Path, path: &Path) -> Self {
        let text = std::fs::read_to_string(path).expect("readable source");
        let name =
            path.strip_prefix(root).expect("below root").to_string_lossy().replace('\\', "/");
        let whole = name.ends_with("tests.rs") || name.contains("/tests/");
        let split = if whole { 0 } else { text.find("\n#[cfg(test)]\nmod ").unwrap_or(text.len()) };
        let code = text[..split].lines().map(without_comment).collect::<Vec<_>>().join("\n");
        Self { name, tests: text[split..].to_owned(), code, text }
    }

    fn room(&self) -> Option<&str> {
        self.name.split_once('/').map(|(room, _)| room)
    }
}

/// Cuts a comment off a line; two slashes after a colon (an address) are none.
fn without_comment(line: &str) -> &str {
    let mut from = 0;
    while let Some(at) = line[from..].find("//").map(|at| at + from) {
        if !line[..at].ends_with(':') {
            return &line[..at];
        }
        from = at + 2;
    }
    line
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("folder") {
        let path = entry.expect("entry").path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn sources(folder: &str) -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    files(&root).iter().map(|path| Source::read(&root, path)).collect()
}

/// The first-level modules named after `crate::` (or a chain of `super::` that leaves the room).
fn used_modules(code: &str) -> Vec<String> {
    let mut used = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        // The end of another name, as in `png_crate::`.
        if code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_') {
            continue;
        }
        let rest = &code[at + "crate::".len()..];
        match rest.strip_prefix('{') {
            None => used.push(word(rest)),
            Some(list) => used.extend(first_words(list)),
        }
    }
    for room in ROOMS {
        if code.contains(&format!("super::super::{room}::")) {
            used.push(room.to_owned());
        }
    }
    used
}

/// What the top of the crate offers, and the room that each name comes from.
fn exported() -> Vec<(String, String)> {
    let lib = sources("src").into_iter().find(|s| s.name == "lib.rs").expect("lib.rs");
    let mut names = vec![("with_samples".to_owned(), "image".to_owned())];
    for item in lib.code.split(';').filter_map(|item| item.trim().strip_prefix("pub use ")) {
        let list = item.split_once('{').map_or(item.rsplit("::").next(), |(_, list)| Some(list));
        for name in first_words(list.unwrap_or_default()) {
            names.push((name, word(item)));
        }
    }
    names
}

fn word(text: &str) -> String {
    text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

/// The first word of each item of `a::b, c::{d, e}, f}`.
fn first_words(list: &str) -> Vec<String> {
    let (mut words, mut depth, mut start) = (Vec::new(), 0, true);
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => start = true,
            c if start && !c.is_whitespace() => {
                words.push(word(&list[at..]));
                start = false;
            }
            _ => {}
        }
    }
    words
}

/// Whether `needle` stands in `code` as words of its own.
fn has_words(code: &str, needle: &str) -> bool {
    let inside = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    code.match_indices(needle).any(|(at, _)| {
        let after = &code[at + needle.len()..];
        let runs_on = inside(needle.chars().next_back()) && inside(after.chars().next());
        !(inside(code[..at].chars().next_back()) || runs_on)
    })
}

#[test]
fn the_reader_of_sources_reads_right() {
    assert_eq!(without_comment("let a = 1; // crate::cli"), "let a = 1; ");
    assert_eq!(without_comment("\"https://a.b\""), "\"https://a.b\"");
    let code = "use crate::image::mask; use crate::{base::ctx::{Ctx, Job}, verb};";
    assert_eq!(used_modules(code), ["image", "base", "verb"]);
    assert!(has_words("std::fs::read", "std::fs") && !has_words("std::fsync", "std::fs"));
    assert!(has_words("eprintln!(\"\")", "eprintln!") && !has_words("eprintln!()", "println!"));
    assert!(!sources("src").is_empty());
}

#[test]
fn rooms_import_downward_only() {
    let rank = |room: &str| ROOMS.iter().position(|r| *r == room);
    let exported = exported();
    let mut broken = String::new();
    for source in sources("src") {
        let Some(own) = source.room() else { continue };
        let Some(own_rank) = rank(own) else {
            let _ = writeln!(broken, "{}: `{own}` is not a room", source.name);
            continue;
        };
        for used in used_modules(&source.code) {
            let room = exported.iter().find(|(name, _)| *name == used).map_or(&used, |(_, r)| r);
            match rank(room) {
                Some(rank) if rank <= own_rank => {}
                _ => {
                    let _ = writeln!(broken, "{}: room `{own}` uses crate::{used}", source.name);
                }
            }
        }
    }
    assert!(broken.is_empty(), "\n{broken}");
}

#[test]
fn methods_do_not_import_each_other() {
    for source in sources("src").iter().filter(|s| s.room() == Some("method")) {
        let own = source.name["method/".len()..].split(['/', '.']).next().unwrap_or_default();
        for (at, found) in source.code.match_indices("crate::method::") {
            let other = word(&source.code[at + found.len()..]);
            assert!(own == "mod" || other == own, "{} uses method {other}", source.name);
        }
    }
}

#[test]
fn words_stay_in_their_rooms() {
    let only_in: &[(&[&str], &[&str])] = &[
        (&["pyo3", "numpy"], &["python/"]),
        (
            &["clap", "println!", "eprintln!", "print!", "eprint!", "std::env", "process::exit"],
            &["cli/", "main.rs"],
        ),
        (&["std::fs"], &["image/io/", "image/material.rs", "cli/"]),
        (&["unsafe"], &["search/patch/simd.rs"]),
        (&["thread_rng", "build_global", "SystemTime"], &[]),
    ];
    let mut broken = String::new();
    for source in sources("src") {
        for (words, rooms) in only_in {
            if rooms.iter().any(|room| source.name.starts_with(room)) {
                continue;
            }
            for word in words.iter().filter(|word| has_words(&source.code, word)) {
                let _ = writeln!(broken, "{}: `{word}` belongs to {rooms:?}", source.name);
            }
        }
    }
    assert!(broken.is_empty(), "\n{broken}");
}

#[test]
fn files_are_short() {
    for source in sources("src") {
        let lines = source.text.lines().count();
        assert!(lines < LONGEST, "{} has {lines} lines; split it", source.name);
    }
}

#[test]
fn every_kind_of_error_is_tested() {
    // This file names all kinds and so proves nothing.
    let tests = sources("tests").into_iter().filter(|s| s.name != "it/house.rs").map(|s| s.text);
    let tests: String = tests.chain(sources("src").into_iter().map(|s| s.tests)).collect();
    // `Error::X`, `ErrorKind::X` under whatever name it was imported, or the slug.
    let named = |pattern: &str| {
        let ends = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric());
        tests.match_indices(pattern).any(|(at, _)| ends(&tests[at + pattern.len()..]))
    };
    let untested: Vec<_> = ErrorKind::ALL
        .iter()
        .filter(|kind| {
            let patterns = [format!("Error::{kind:?}"), format!("Kind::{kind:?}")];
            !patterns.iter().any(|p| named(p)) && !named(&format!("\"{}\"", kind.slug()))
        })
        .collect();
    assert!(untested.is_empty(), "no test provokes {untested:?}");
}
