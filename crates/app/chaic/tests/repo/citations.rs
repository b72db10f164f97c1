//! Promise: each comment with "facts" and a section number refers to a section of
//! `docs/reference/original-facts.md`. It has caught numbers that were sections of two documents.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The page that is cited.
const PAGE: &str = "docs/reference/original-facts.md";
/// Folders to search for citations.
const FOLDERS: [&str; 4] = ["benches", "crates", "docs", "examples"];
/// Words that may stand between "facts" and the number.
const BETWEEN: [&str; 7] = ["of", "the", "original", "original's", "agents", "section", "sections"];
/// Words, besides commas, that join the numbers of one citation.
const JOINS: [&str; 3] = ["and", "against", "or"];

/// A section number after "facts", with its line.
#[derive(Debug, PartialEq)]
struct Citation {
    line: usize,
    section: String,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).expect("the root")
}

/// Returns the section numbers of a page with the anchors of their headings.
fn sections(page: &str) -> BTreeMap<&str, String> {
    let mut sections = BTreeMap::new();
    for heading in page.lines().filter(|l| l.starts_with("##")) {
        let title = heading.trim_start_matches('#').trim();
        let number = title.split(' ').next().unwrap_or_default();
        if is_number(number) {
            let twice = sections.insert(number, anchor(title));
            assert_eq!(twice, None, "{PAGE} has two sections {number}");
        }
    }
    sections
}

/// Returns the anchor that Markdown viewers give to a heading.
fn anchor(title: &str) -> String {
    let kept = title.chars().filter(|c| c.is_alphanumeric() || [' ', '-'].contains(c));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

/// Returns whether a word looks like the number of a section, with or without its letter.
fn is_number(word: &str) -> bool {
    word.strip_prefix(['S', 'A']).unwrap_or(word).starts_with(|c: char| c.is_ascii_digit())
}

/// Returns every citation of a text, also if it continues on the next line.
fn citations(text: &str) -> Vec<Citation> {
    let lines = text.lines().enumerate();
    let words: Vec<(usize, &str)> = lines
        .flat_map(|(i, line)| {
            let content = line.trim_start().trim_start_matches(['/', '!', '#']);
            content.split_whitespace().map(move |word| (i + 1, word))
        })
        .collect();
    let is_marker = |word: &str| {
        let word = word.trim_start_matches(|c: char| !c.is_alphanumeric());
        ["facts", "Facts"].contains(&word.trim_end_matches(','))
    };
    let starts = words.iter().enumerate().filter(|(_, (_, word))| is_marker(word));
    starts.flat_map(|(i, _)| numbers(words.get(i + 1..).unwrap_or_default())).collect()
}

/// Returns the section numbers at the start of these words.
fn numbers(words: &[(usize, &str)]) -> Vec<Citation> {
    let bare = |word: &str| word.trim_matches(|c: char| !c.is_alphanumeric()).to_owned();
    let skipped = words.iter().take_while(|(_, w)| BETWEEN.contains(&bare(w).as_str())).count();
    let mut found = Vec::new();
    for (line, word) in words.iter().skip(skipped) {
        let section = bare(word);
        if is_number(&section) {
            let continues = word.ends_with(&section) || *word == format!("{section},");
            found.push(Citation { line: *line, section });
            if !continues {
                break;
            }
        } else if found.is_empty() || !JOINS.contains(word) {
            break;
        }
    }
    found
}

/// Returns every text file in the folders and the root, sorted by path.
fn texts() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open: Vec<PathBuf> = FOLDERS.map(|f| root().join(f)).into();
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).expect("it can be listed") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| {
                ["rs", "md", "py", "toml"].contains(&e.to_str().unwrap_or_default())
            }) {
                found.push(path);
            }
        }
    }
    found.extend(["ARCHITECTURE.md", "CHANGELOG.md", "README.md"].map(|f| root().join(f)));
    // The examples of this file are invalid on purpose.
    found.retain(|path| !path.ends_with(file!()));
    found.sort();
    found
}

#[test]
fn every_citation_has_its_section() {
    let page = fs::read_to_string(root().join(PAGE)).expect("the page");
    let sections = sections(&page);
    let (mut n_found, mut wrong) = (0, Vec::new());
    for path in texts() {
        let text = fs::read_to_string(&path).expect("a text");
        for Citation { line, section } in citations(&text) {
            n_found += 1;
            if !sections.contains_key(section.as_str()) {
                let path = path.strip_prefix(root()).expect("under the root");
                wrong.push(format!("{}:{line}: facts {section}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{PAGE} has no such sections:\n{}", wrong.join("\n"));
    assert!(n_found > 100, "only {n_found} citations were found; has their syntax changed?");
}

#[test]
fn links_within_the_page_have_targets() {
    let page = fs::read_to_string(root().join(PAGE)).expect("the page");
    let sections = sections(&page);
    let links = page.split('[').filter_map(|rest| rest.split_once("](#"));
    let links = links.filter_map(|(name, rest)| Some((name, rest.split_once(')')?.0)));
    let mut n_links = 0;
    for (name, to) in links {
        assert_eq!(sections.get(name).map(String::as_str), Some(to), "the link [{name}]");
        n_links += 1;
    }
    assert!(n_links > 0, "no links were found");
}

#[test]
fn citations_are_found_in_all_spellings() {
    let found = |text: &str| -> Vec<(usize, String)> {
        citations(text).into_iter().map(|c| (c.line, c.section)).collect()
    };
    let cites = |text: &str, expected: &[(usize, &str)]| {
        let expected: Vec<_> = expected.iter().map(|(l, s)| (*l, (*s).to_owned())).collect();
        assert_eq!(found(text), expected, "{text}");
    };
    cites("/// Chance of lifting (facts S1.3).", &[(1, "S1.3")]);
    cites(
        "a();\n    /// the spot (facts\n    /// A1.5, A1.6 and\n    /// A2.1): here",
        &[(3, "A1.5"), (3, "A1.6"), (4, "A2.1")],
    );
    cites("// Facts S1.4: it drops, 2 and 3.", &[(1, "S1.4")]);
    cites("(facts S13, number 12)", &[(1, "S13")]);
    cites("facts S8.1 against S9.1), see S5", &[(1, "S8.1"), (1, "S9.1")]);
    // Numbers without a letter are found too, so that the test refuses them.
    cites("(original facts 9.4)", &[(1, "9.4")]);
    cites("(facts of the original, section 8: alone)", &[(1, "8")]);
    cites("let facts = Facts::of(3);", &[]);
    assert!(!sections("## S9 Moving\n### S9.4 Together").contains_key("9.4"));
}
