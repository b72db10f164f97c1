//! Promise: doc comments and pages stay easy to read. The tests count three faults: first sentences without subject and
//! verb, private idioms, and long sentences. If a share exceeds its limit, the test lists the worst places.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use crate::root;

/// Largest share of comments and paragraphs that begin with a word of [`HEADLESS`], %.
const MAX_HEADLESS: f64 = 2.0;
/// Largest share of comments and paragraphs that contain one of [`IDIOMS`], %.
const MAX_IDIOMS: f64 = 0.5;
/// Largest share of doc comments with a sentence of more than [`LONG_WORDS`] words, %.
const MAX_LONG_IN_CRATES: f64 = 1.0;
/// Largest share of paragraphs of pages with a sentence of more than [`LONG_WORDS`] words, %.
const MAX_LONG_IN_PAGES: f64 = 6.5;
/// Largest number of words of a sentence.
const LONG_WORDS: usize = 30;
/// Number of places that a failure lists.
const N_LISTED: usize = 60;

/// First words of clauses without a subject.
const HEADLESS: [&str; 14] = [
    "What", "By what", "By which", "By how", "By whom", "How", "Where", "Who", "Whose", "When",
    "Those", "So", "Of", "Whether",
];
/// Idioms in lower case. They match whole words only.
const IDIOMS: [&str; 25] = [
    "somebody",
    "nobody",
    "anybody",
    "everybody",
    "whoever",
    "by whom",
    "oneself",
    "one's",
    "so many",
    "be it",
    "in vain",
    "what comes of",
    "came of",
    "comes of",
    "told",
    "tells",
    "is about to",
    "else's",
    "those who",
    "whom",
    "gone on with",
    "as usual",
    "the usual",
    "made anew",
    "anew",
];

/// A doc comment of a Rust file, or a paragraph of a Markdown file.
struct Passage {
    line: usize,
    text: String,
}

/// Faults of one passage.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Faults {
    headless: bool,
    idiom: bool,
    long: bool,
}

/// Counts over many passages.
#[derive(Default)]
struct Counts {
    passages: usize,
    headless: usize,
    idioms: usize,
    long: usize,
    /// Number of faults, place and first sentence of each passage with faults.
    places: Vec<(usize, String)>,
}

/// Returns the text of a line of a doc comment.
fn rust_text(line: &str) -> Option<&str> {
    let text = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"))?;
    Some(text.strip_prefix(' ').unwrap_or(text))
}

/// Returns whether a line of Markdown begins an item of a list.
fn is_item(line: &str) -> bool {
    let number = line.trim_start_matches(|c: char| c.is_ascii_digit());
    line.starts_with("- ")
        || line.starts_with("* ")
        || number.len() < line.len() && number.starts_with(". ")
}

/// Splits a file into passages, without code, headings, tables, images and the first lines of list items.
fn passages(content: &str, is_rust: bool) -> Vec<Passage> {
    let mut found = Vec::new();
    let mut is_code = false;
    let mut open: Option<Passage> = None;
    for (index, line) in content.lines().chain([""]).enumerate() {
        let line = line.trim();
        let text = if is_rust {
            rust_text(line)
        } else {
            is_code ^= line.starts_with("```");
            let is_other = line.is_empty() || line.starts_with(['`', '#', '|', '!', '<']);
            if is_code || is_other || is_item(line) { None } else { Some(line) }
        };
        match (text, &mut open) {
            (Some(""), _) => {}
            (Some(text), Some(passage)) => {
                passage.text.push(' ');
                passage.text.push_str(text);
            }
            (Some(text), None) => open = Some(Passage { line: index + 1, text: text.to_owned() }),
            (None, _) => found.extend(open.take()),
        }
    }
    found
}

/// Splits a text after each of these marks that is followed by a space.
fn sentences<'a>(text: &'a str, marks: &[char]) -> Vec<&'a str> {
    let (mut found, mut start) = (Vec::new(), 0);
    let mut before = ' ';
    for (index, c) in text.char_indices() {
        if c.is_whitespace() && marks.contains(&before) {
            found.push(&text[start..index]);
            start = index + c.len_utf8();
        }
        before = c;
    }
    found.push(&text[start..]);
    found
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Returns whether the text begins with this phrase as whole words.
fn begins_with(text: &str, phrase: &str) -> bool {
    text.strip_prefix(phrase).is_some_and(|rest| !rest.starts_with(is_word))
}

/// Returns whether the text contains this phrase as whole words.
fn contains(text: &str, phrase: &str) -> bool {
    text.match_indices(phrase)
        .any(|(index, _)| begins_with(&text[index..], phrase) && !text[..index].ends_with(is_word))
}

/// Returns the faults of a passage.
fn faults(text: &str) -> Faults {
    let first = sentences(text, &['.', '!', '?', ':'])[0];
    let lower = text.to_ascii_lowercase();
    let n_words = |sentence: &str| sentence.split_whitespace().count();
    Faults {
        headless: HEADLESS.iter().any(|p| begins_with(first, p)),
        idiom: IDIOMS.iter().any(|p| contains(&lower, p)),
        long: sentences(text, &['.', '!', '?', ';', ':']).iter().any(|s| n_words(s) > LONG_WORDS),
    }
}

impl Counts {
    /// Counts the passages of one file.
    fn add(&mut self, name: &str, content: &str) {
        for Passage { line, text } in passages(content, name.ends_with(".rs")) {
            let Faults { headless, idiom, long } = faults(&text);
            self.passages += 1;
            self.headless += usize::from(headless);
            self.idioms += usize::from(idiom);
            self.long += usize::from(long);
            let n_faults = [headless, idiom, long].into_iter().filter(|f| *f).count();
            if n_faults > 0 {
                let first: String = text.chars().take(110).collect();
                self.places.push((n_faults, format!("{name}:{line}: {first}")));
            }
        }
    }

    /// Returns the shares of headless passages, idioms and long sentences, %.
    fn shares(&self) -> [f64; 3] {
        let share = |n: usize| 100.0 * n as f64 / self.passages.max(1) as f64;
        [share(self.headless), share(self.idioms), share(self.long)]
    }

    /// Returns the shares, the limits and the worst places if a share exceeds its limit.
    fn failure(&self, max_long: f64) -> Option<String> {
        let shares = self.shares();
        let limits = [MAX_HEADLESS, MAX_IDIOMS, max_long];
        if shares.iter().zip(limits).all(|(share, limit)| *share <= limit) {
            return None;
        }
        let [headless, idioms, long] = shares;
        let mut text = format!(
            "{} comments and paragraphs: {headless:.2} % begin headless (limit {MAX_HEADLESS}), \
             {idioms:.2} % have an idiom (limit {MAX_IDIOMS}), {long:.2} % have a sentence over \
             {LONG_WORDS} words (limit {max_long}); the worst:",
            self.passages
        );
        let mut places: Vec<_> = self.places.iter().collect();
        places.sort_by_key(|(n_faults, _)| std::cmp::Reverse(*n_faults));
        for (_, place) in places.into_iter().take(N_LISTED) {
            write!(text, "\n  {place}").expect("writing to a string succeeds");
        }
        Some(text)
    }
}

/// Adds the Rust and Markdown files below a folder to `found`.
fn texts(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            if !path.ends_with("target") {
                texts(&path, found);
            }
        } else if path.extension().is_some_and(|e| e == "rs" || e == "md") {
            found.push(path);
        }
    }
}

fn count(files: &[PathBuf]) -> Counts {
    let mut counts = Counts::default();
    for path in files {
        let name = path.strip_prefix(root()).expect("below the root").to_string_lossy();
        counts.add(&name, &fs::read_to_string(path).expect("a text"));
    }
    counts
}

#[test]
fn crates_are_easy_to_read() {
    let mut files = Vec::new();
    texts(&root().join("crates"), &mut files);
    let counts = count(&files);
    assert!(counts.passages > 5_000, "only {} comments were found", counts.passages);
    println!("{} comments, shares {:.2?} %", counts.passages, counts.shares());
    if let Some(failure) = counts.failure(MAX_LONG_IN_CRATES) {
        panic!("{failure}");
    }
}

#[test]
fn pages_are_easy_to_read() {
    let pages = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "SECURITY.md", "TESTING.md"];
    let mut files: Vec<PathBuf> = pages.map(|page| root().join(page)).into();
    files.retain(|page| page.exists());
    texts(&root().join("docs"), &mut files);
    let counts = count(&files);
    assert!(counts.passages > 300, "only {} paragraphs were found", counts.passages);
    println!("{} paragraphs, shares {:.2?} %", counts.passages, counts.shares());
    if let Some(failure) = counts.failure(MAX_LONG_IN_PAGES) {
        panic!("{failure}");
    }
}

#[test]
fn each_fault_is_found() {
    let found = |text: &str| {
        let Faults { headless, idiom, long } = faults(text);
        (headless, idiom, long)
    };
    assert_eq!(found("Returns the mass of an object, kg."), (false, false, false));
    assert_eq!(found("What an object weighs."), (true, false, false));
    assert_eq!(found("By whom it is held: an agent."), (true, true, false));
    assert_eq!(found("Whatever it holds. So it falls."), (false, false, false));
    assert_eq!(found("Whoever is Told it."), (false, true, false));
    assert_eq!(found("Untold, retells."), (false, false, false));
    assert_eq!(found(&"word ".repeat(31)), (false, false, true));
    assert!(!found(&format!("{}; {}", "word ".repeat(30).trim(), "word ".repeat(30))).2);
}

#[test]
fn a_bad_text_fails() {
    let mut counts = Counts::default();
    counts.add("good.rs", "/// Returns the mass, kg.\nfn mass() {}\n// What it is.\n");
    assert_eq!((counts.passages, counts.failure(1.0)), (1, None));
    counts.add("bad.rs", "/// What somebody is told,\n///\n/// in vain.\nfn f() {}\n");
    assert_eq!((counts.passages, counts.shares()), (2, [50.0, 50.0, 0.0]));
    let failure = counts.failure(1.0).expect("a failure");
    assert!(failure.ends_with("\n  bad.rs:1: What somebody is told, in vain."), "{failure}");
    let page = "# What\n\nText of\none paragraph.\n\n- So\n\n```sh\nHow\n```\n1. Who\n   is told\n";
    let mut counts = Counts::default();
    counts.add("page.md", page);
    assert_eq!((counts.passages, counts.headless, counts.idioms), (2, 0, 1));
}
