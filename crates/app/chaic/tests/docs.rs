//! Promise: every page of `docs/` is listed in `docs/SUMMARY.md`, once, and every link between the
//! pages of the repository leads to a file, and to a heading if it names one. docs/people.md has a row
//! for each impairment.

use std::fs;
use std::path::{Path, PathBuf};

use chaic_core::capability::IMPAIRMENTS;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).expect("the root")
}

/// The Markdown files of a folder, and of those below it if `deep`.
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

/// The targets of inline links and pictures, outside of blocks of code.
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

/// The anchors that viewers of Markdown give the headings of a page.
fn anchors(text: &str) -> Vec<String> {
    let kept = |c: &char| c.is_alphanumeric() || [' ', '-', '_'].contains(c);
    let headings = text.lines().filter(|l| l.starts_with('#'));
    let anchor =
        |l: &str| l.trim_start_matches('#').trim().chars().filter(kept).collect::<String>();
    headings.map(|l| anchor(l).to_lowercase().replace(' ', "-")).collect()
}

#[test]
fn every_page_is_in_the_summary_once() {
    let docs = root().join("docs");
    let summary = fs::read_to_string(docs.join("SUMMARY.md")).expect("a summary");
    let mut chapters = links(&summary);
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
fn links_between_pages_lead_somewhere() {
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
            // In the book, links to pages out of it would be dead; those to sources are not.
            let docs = root().join("docs");
            let leaves_book = page.starts_with(&docs)
                && !target.canonicalize().is_ok_and(|t| t.starts_with(&docs));
            assert!(!(leaves_book && file.ends_with(".md")), "{}: {link}", page.display());
            if !anchor.is_empty() && target.extension().is_some_and(|e| e == "md") {
                let there = anchors(&fs::read_to_string(&target).expect("readable"));
                assert!(there.iter().any(|a| a == anchor), "{}: {link}", page.display());
            }
        }
    }
    assert!(n_links > 100, "{n_links} links");
}

#[test]
fn every_impairment_has_its_row() {
    let page = fs::read_to_string(root().join("docs/people.md")).expect("it is text");
    let named: Vec<&str> = page
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once('`'))
        .map(|(name, _)| name)
        .collect();
    assert_eq!(named, IMPAIRMENTS.map(|row| row.name));
}
