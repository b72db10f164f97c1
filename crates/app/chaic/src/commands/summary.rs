//! Short report of a run for a terminal: one table, the grants of each helper, and paths.

use std::path::{Path, PathBuf};

use anyhow::Result;
use chaic_core::TaskId;
use chaic_env::helper_registry::NONE;
use chaic_env::{CHAIC_VERSION, Track};
use chaic_eval::metrics::{FormulaSet, Score, Scores};
use chaic_eval::report::{Format, Labels, Report, rounded, shown_interval};
use chaic_eval::run::{Run, RunFolder};
use serde_json::{Value, json};

use crate::output::{OutputFormat, counted, json_path, print_result, quoted_path};

/// Largest number of lines of the short report.
const MAX_LINES: usize = 40;
/// Maximum width of a line, characters. Only lines with paths or commands may be longer.
const MAX_COLUMNS: usize = 100;
/// Width of the column of helpers.
const HELPER_COLUMNS: usize = 11;
/// Width of the columns of tasks; an interval has 9 characters.
const TASK_COLUMNS: usize = 9;
/// Tasks in one block of the table.
const TASKS_PER_BLOCK: usize = (MAX_COLUMNS - HELPER_COLUMNS) / (TASK_COLUMNS + 2);

/// Returns the report of a run by the paper's formulas.
pub fn report_of(run: &Run) -> Report<'_> {
    let (options, planned) = (run.options(), run.planned());
    let (results, granted, formulas) = (run.results(), Some(run.granted()), FormulaSet::Paper);
    // A run of another version cannot be opened, so this is the run's version.
    Report { version: CHAIC_VERSION, options, results, planned, granted, formulas }
}

/// Returns the scores of a run as in its `scores.json`.
///
/// # Errors
/// If they are not JSON, which would be a bug.
pub fn scores_json(report: &Report<'_>) -> Result<Value> {
    Ok(serde_json::from_str(&report.text(Format::Json))?)
}

/// Value of an additional line of the short report.
pub enum LineValue {
    /// A path, which the text quotes for a shell.
    Path(PathBuf),
    /// Any other text.
    Text(String),
}

impl LineValue {
    fn json(&self) -> String {
        match self {
            LineValue::Path(path) => json_path(path),
            LineValue::Text(text) => text.clone(),
        }
    }

    fn text(&self) -> String {
        match self {
            LineValue::Path(path) => quoted_path(path),
            LineValue::Text(text) => text.clone(),
        }
    }
}

/// Prints the scores of a run with the paths of its report and folder. `more` are further lines, as label and value.
///
/// # Errors
/// If the output cannot be written.
pub fn print_scores(
    format: OutputFormat,
    report: &Report<'_>,
    folder: &RunFolder,
    more: &[(&str, LineValue)],
) -> Result<()> {
    let path = folder.join("report.md");
    let mut json = json!({ "run": json_path(folder.path()), "report": json_path(&path) });
    for (label, value) in more {
        json[label.to_lowercase()] = Value::from(value.json());
    }
    json["scores"] = scores_json(report)?;
    print_result(format, &json, &scores_text(report, folder.path(), more))
}

/// Formats the short report: at most [`MAX_LINES`] lines of [`MAX_COLUMNS`] characters.
pub fn scores_text(report: &Report<'_>, folder: &Path, more: &[(&str, LineValue)]) -> String {
    let scores = report.scores();
    let helpers = scores.helpers();
    let mut footer = notes(report, &scores);
    let paths = [
        ("Report", LineValue::Path(folder.join("report.md"))),
        ("Run", LineValue::Path(folder.to_owned())),
    ];
    let labeled = paths.iter().chain(more);
    let line =
        |(label, value): &(&str, LineValue)| format!("{:8} {}", format!("{label}:"), value.text());
    footer.extend(labeled.map(line));
    let lines_of = |n_helpers: usize| {
        let shown = &helpers[..n_helpers];
        let mut lines = table(&scores, report.labels(), shown);
        lines.push(String::new());
        lines.extend(grants(report, shown));
        if n_helpers < helpers.len() {
            let rest = counted(helpers.len() - n_helpers, "more helper");
            lines.push(format!("{rest}: see report.md"));
        }
        lines.push(String::new());
        lines
    };
    // Leaves out helpers until the rest fits.
    let room = MAX_LINES.saturating_sub(footer.len());
    let fits = |n: &usize| lines_of(*n).len() <= room;
    let n_helpers = (1..=helpers.len()).rev().find(fits).unwrap_or(helpers.len().min(1));
    let mut lines = lines_of(n_helpers);
    lines.extend(footer);
    lines.join("\n") + "\n"
}

/// Formats the table: a row per helper, with the mean over its interval, and a column per task.
fn table(scores: &Scores, labels: Labels<'_>, helpers: &[String]) -> Vec<String> {
    let tasks = scores.tasks();
    let mut lines =
        vec!["Transport rate: mean, and 95 % interval over environments".to_owned(), String::new()];
    for (k, tasks) in tasks.chunks(TASKS_PER_BLOCK).enumerate() {
        if k > 0 {
            lines.push(String::new());
        }
        lines.extend(block(scores, labels, helpers, tasks));
    }
    lines
}

/// Formats the columns of some tasks.
fn block(scores: &Scores, labels: Labels<'_>, helpers: &[String], tasks: &[TaskId]) -> Vec<String> {
    let heads: Vec<[String; 2]> = tasks.iter().map(|task| split_title(task.info().title)).collect();
    let widths: Vec<usize> = heads
        .iter()
        .map(|head| head.iter().map(|word| word.chars().count()).max().unwrap_or(0))
        .map(|width| width.max(TASK_COLUMNS))
        .collect();
    let line = |first: &str, cells: &[String]| {
        let mut line = format!("{first:HELPER_COLUMNS$}");
        for (cell, width) in cells.iter().zip(&widths) {
            line += &format!("  {cell:>width$}");
        }
        line.trim_end().to_owned()
    };
    let head = |k: usize| heads.iter().map(|words| words[k].clone()).collect::<Vec<_>>();
    let mut lines = vec![line("", &head(0)), line("Helper", &head(1))];
    lines.retain(|line| !line.is_empty());
    let has_intervals = tasks
        .iter()
        .flat_map(|task| helpers.iter().filter_map(|helper| scores.get(*task, helper)))
        .any(|score| shown_interval(score).is_some());
    for helper in helpers {
        let [name, rest] = wrapped_name(&labels.name(helper));
        let cells: Vec<[String; 2]> =
            tasks.iter().map(|task| cell(scores, *task, helper)).collect();
        let column = |k: usize| cells.iter().map(|cell| cell[k].clone()).collect::<Vec<_>>();
        lines.push(line(&name, &column(0)));
        if has_intervals || !rest.is_empty() {
            lines.push(line(&rest, &column(1)));
        }
    }
    lines
}

/// Returns the mean with its mark, and the interval.
fn cell(scores: &Scores, task: TaskId, helper: &str) -> [String; 2] {
    let Some(score) = scores.get(task, helper) else {
        let is_missing = scores.is_unplayed(task, helper);
        return [if is_missing { "?" } else { "/" }.to_owned(), String::new()];
    };
    let Score { failed, incomplete, .. } = score;
    let failed = if *failed > 0 { "*" } else { "" };
    let incomplete = if *incomplete { "?" } else { "" };
    let interval = shown_interval(score)
        .map(|[low, high]| format!("{}\u{2013}{}", rounded(low), rounded(high)));
    [format!("{}{failed}{incomplete}", rounded(score.tr)), interval.unwrap_or_default()]
}

/// Splits a title into two lines at its first space; a single word is in the second line.
fn split_title(title: &str) -> [String; 2] {
    let (first, second) = title.split_once(' ').unwrap_or(("", title));
    [first.to_owned(), second.to_owned()]
}

/// Splits a long name into two lines of the column of helpers, at a space if both parts fit. Shortens a
/// name that does not fit into two lines.
fn wrapped_name(name: &str) -> [String; 2] {
    let fits = |text: &str| text.chars().count() <= HELPER_COLUMNS;
    if fits(name) {
        return [name.to_owned(), String::new()];
    }
    let splits = name.match_indices(' ').map(|(at, _)| (&name[..at], &name[at + 1..]));
    if let Some((first, rest)) = splits.rev().find(|(first, rest)| fits(first) && fits(rest)) {
        return [first.to_owned(), rest.to_owned()];
    }
    let chars: Vec<char> = shortened(name, 2 * HELPER_COLUMNS).chars().collect();
    let (first, rest) = chars.split_at(chars.len().min(HELPER_COLUMNS));
    [first.iter().collect(), rest.iter().collect()]
}

/// Splits a text at spaces into lines of at most [`MAX_COLUMNS`] characters. Further lines are indented, and
/// a longer word is shortened.
fn wrapped_text(text: &str) -> Vec<String> {
    const INDENT: &str = "  ";
    let mut lines = Vec::new();
    let mut line = String::new();
    for word in text.split(' ') {
        let is_first_word = line.trim_start().is_empty();
        if !is_first_word && line.chars().count() + 1 + word.chars().count() > MAX_COLUMNS {
            lines.push(std::mem::replace(&mut line, format!("{INDENT}{word}")));
        } else {
            line += if is_first_word { "" } else { " " };
            line += word;
        }
    }
    lines.push(line);
    lines.iter().map(|line| shortened(line, MAX_COLUMNS)).collect()
}

/// Shortens a text to this number of characters.
fn shortened(text: &str, max: usize) -> String {
    if text.chars().count() <= max {
        return text.to_owned();
    }
    text.chars().take(max - 1).chain(['\u{2026}']).collect()
}

/// Returns the grants of each helper, and those of the partner if it has more than the default. Each begins on
/// a line of its own.
fn grants(report: &Report<'_>, helpers: &[String]) -> Vec<String> {
    let labels = report.labels();
    let helpers = helpers.iter().filter(|helper| *helper != NONE);
    let each = helpers.map(|helper| format!("Granted: {}", labels.title(helper)));
    each.chain(labels.sentence(&[])).flat_map(|text| wrapped_text(&text)).collect()
}

/// Returns the lines that qualify the scores, such as the number of failed episode runs.
fn notes(report: &Report<'_>, scores: &Scores) -> Vec<String> {
    let rows = || scores.tasks.values().flat_map(|row| row.values());
    let n_failed: usize = rows().map(|score| score.failed).sum();
    let mut notes = Vec::new();
    if n_failed > 0 {
        let runs = counted(n_failed, "episode run");
        let count = if n_failed == 1 { "counts" } else { "count" };
        notes.push(format!("* {runs} failed and {count} as zero; report.md has the reasons."));
    }
    let (n_planned, n_results) = (report.planned.len(), report.results.len());
    if n_results < n_planned {
        notes.push(format!(
            "? {} of {} missing.",
            n_planned - n_results,
            counted(n_planned, "episode run")
        ));
    }
    if report.options.track != Track::default() {
        notes.push(format!(
            "Track {}, which limits the grants of all helpers.",
            report.options.track
        ));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_any_length_fit_into_their_column() {
        assert_eq!(wrapped_name("RHP"), ["RHP", ""]);
        assert_eq!(wrapped_name("my-trained-policy"), ["my-trained-", "policy"]);
        assert_eq!(wrapped_name("Infer, known goal"), ["Infer,", "known goal"]);
        assert_eq!(wrapped_name("Ideal observer"), ["Ideal", "observer"]);
        assert_eq!(wrapped_name("a b c d e f g h"), ["a b c d e f", "g h"]);
        let [first, rest] = wrapped_name(&"x".repeat(40));
        assert_eq!((first.len(), rest.chars().count()), (11, 11));
        assert!(rest.ends_with('\u{2026}'), "{rest}");
    }

    #[test]
    fn names_of_built_in_helpers_are_split_at_spaces() {
        for helper in &chaic_agents::HELPERS {
            let [first, rest] = wrapped_name(helper.title);
            assert_eq!(format!("{first} {rest}").trim_end(), helper.title);
        }
    }

    #[test]
    fn long_texts_are_split_and_keep_their_words() {
        let text = format!("Granted: Oracle ({})", ["goal place"; 20].join(", "));
        let lines = wrapped_text(&text);
        assert!(lines.len() == 3 && lines[1].starts_with("  goal"), "{lines:?}");
        assert!(lines.iter().all(|line| line.chars().count() <= MAX_COLUMNS), "{lines:?}");
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(words(&lines.join(" ")), words(&text));
        assert_eq!(wrapped_text("Granted: RHP"), ["Granted: RHP"]);
        let lines = wrapped_text(&"x".repeat(200));
        assert_eq!((lines.len(), lines[0].chars().count()), (1, MAX_COLUMNS));
    }

    #[test]
    fn eight_tasks_fit_side_by_side() {
        let widths = TaskId::paper().map(|task| {
            let [first, second] = split_title(task.info().title);
            first.len().max(second.len()).max(TASK_COLUMNS) + 2
        });
        assert!(TASKS_PER_BLOCK == 8 && HELPER_COLUMNS + widths.sum::<usize>() <= MAX_COLUMNS);
    }
}
