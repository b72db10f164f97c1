//! Promise: docs/SUMMARY.md lists every page of `docs/` once, and docs/index.md links to them in the same order. Every
//! relative link of the repository's pages leads to a file, and to a heading if it names one. docs/people.md has a row for
//! each impairment. The Rust of README.md and of docs/tutorial-rust.md is that of examples/minimal_helper.

use std::fs;
use std::path::{Path, PathBuf};

use chaic_agents::partners::PARTNER_VARIANTS;
use chaic_core::capability::IMPAIRMENTS;

use crate::root;

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Adds the Markdown files of a folder, and of its subfolders if `deep`.
fn pages(folder: &Path, deep: bool, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() && deep && !path.ends_with("target") {
            pages(&path, deep, found);
        } else if path.extension().is_some_and(|e| e == "md") {
            found.push(path);
        }
    }
}

/// Returns the targets of inline links and images outside of code blocks.
fn links(text: &str) -> Vec<String> {
    let mut in_code = false;
    let mut found = Vec::new();
    for line in text.lines() {
        in_code ^= line.trim_start().starts_with("```");
        let parts = line.split("](").skip(1).filter(|_| !in_code);
        found.extend(parts.filter_map(|rest| Some(rest.split_once(')')?.0.to_owned())));
    }
    found
}

/// Returns the anchors that Markdown viewers give to the headings of a page.
fn anchors(text: &str) -> Vec<String> {
    let kept = |c: &char| c.is_alphanumeric() || [' ', '-', '_'].contains(c);
    let headings = text.lines().filter(|l| l.starts_with('#'));
    let anchor =
        |l: &str| l.trim_start_matches('#').trim().chars().filter(kept).collect::<String>();
    headings.map(|l| anchor(l).to_lowercase().replace(' ', "-")).collect()
}

/// Returns the code blocks of a language.
fn blocks<'a>(text: &'a str, language: &str) -> Vec<&'a str> {
    let fence = format!("```{language}\n");
    let rest = text.split(fence.as_str()).skip(1);
    rest.map(|rest| rest.split("```").next().expect("the block ends")).collect()
}

#[test]
fn the_summary_lists_every_page_once() {
    let docs = root().join("docs");
    let mut chapters = links(&read("docs/SUMMARY.md"));
    chapters.sort();
    let mut found = Vec::new();
    pages(&docs, true, &mut found);
    let path_in_docs = |p: &PathBuf| {
        p.strip_prefix(&docs).expect("a page of docs").to_string_lossy().replace('\\', "/")
    };
    let mut names: Vec<String> =
        found.iter().map(path_in_docs).filter(|n| n != "SUMMARY.md").collect();
    names.sort();
    assert_eq!(chapters, names);
}

#[test]
fn the_index_has_the_order_of_the_summary() {
    let mut chapters = links(&read("docs/SUMMARY.md"));
    chapters.retain(|page| page != "index.md");
    assert_eq!(links(&read("docs/index.md")), chapters);
}

#[test]
fn links_between_pages_have_targets() {
    let mut found = Vec::new();
    pages(root(), false, &mut found);
    for folder in ["docs", "crates", "examples", "benches"] {
        pages(&root().join(folder), true, &mut found);
    }
    let mut n_links = 0;
    for page in found {
        let text = fs::read_to_string(&page).expect("readable");
        for link in links(&text).into_iter().filter(|l| !l.contains("://")) {
            n_links += 1;
            let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let target = match file {
                "" => page.clone(),
                file => page.parent().expect("a folder").join(file),
            };
            assert!(target.exists(), "{}: {link}", page.display());
            // The book has no pages outside of docs, but links to sources work.
            let docs = root().join("docs");
            let leaves_book = page.starts_with(&docs)
                && !target.canonicalize().is_ok_and(|t| t.starts_with(&docs));
            assert!(!(leaves_book && file.ends_with(".md")), "{}: {link}", page.display());
            if !anchor.is_empty() && target.extension().is_some_and(|e| e == "md") {
                let targets = anchors(&fs::read_to_string(&target).expect("readable"));
                assert!(targets.iter().any(|a| a == anchor), "{}: {link}", page.display());
            }
        }
    }
    assert!(n_links > 100, "{n_links} links");
}

#[test]
fn every_impairment_and_every_partner_has_its_row() {
    let page = read("docs/people.md");
    let named: Vec<&str> = page
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once('`'))
        .map(|(name, _)| name)
        .collect();
    let impairments = IMPAIRMENTS.iter().map(|row| row.name);
    let partners = PARTNER_VARIANTS.iter().map(|row| row.name);
    assert_eq!(named, impairments.chain(partners).collect::<Vec<_>>());
}

#[test]
fn the_rust_tutorial_quotes_the_example() {
    let sources =
        ["main.rs", "walker.rs"].map(|f| read(&format!("examples/minimal_helper/src/{f}")));
    for (page, n_blocks) in [("docs/tutorial-rust.md", 5), ("README.md", 1)] {
        let text = read(page);
        let quoted = blocks(&text, "rust");
        assert_eq!(quoted.len(), n_blocks, "{page}");
        for block in quoted {
            let is_quoted = sources.iter().any(|source| source.contains(block));
            assert!(is_quoted, "{page}: examples/minimal_helper has no such lines:\n{block}");
        }
    }
}
