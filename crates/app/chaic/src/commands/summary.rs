//! Short report of a run for a terminal: one table, the grants of each helper, and paths.

use std::path::Path;

use anyhow::Result;
use chaic_core::TaskId;
use chaic_env::helper_registry::NONE;
use chaic_env::{CHAIC_VERSION, Track};
use chaic_eval::metrics::{FormulaSet, Score, Scores};
use chaic_eval::report::{Format, Labels, Report, rounded, shown_interval};
use chaic_eval::run::{Run, RunFolder};
use serde_json::{Value, json};

use crate::output::{OutputFormat, counted, print_result, quoted_path};

/// Largest number of lines of the short report.
const MAX_LINES: usize = 40;
/// Largest width of its lines, characters. Only paths and commands of the user may be longer.
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
    // A run of another version can't be opened.
    Report { version: CHAIC_VERSION, options, results, planned, granted, formulas }
}

/// Returns the scores of a run as in its `scores.json`.
///
/// # Errors
/// If they are not JSON, which would be a bug.
pub fn scores_json(report: &Report<'_>) -> Result<Value> {
    Ok(serde_json::from_str(&report.text(Format::Json))?)
}

/// Prints the scores of a run with the paths of its report and folder. `more` are further lines, as label and value.
///
/// # Errors
/// If the output cannot be written.
pub fn print_scores(
    format: OutputFormat,
    report: &Report<'_>,
    folder: &RunFolder,
    more: &[(&str, String)],
) -> Result<()> {
    let path = folder.join("report.md");
    let mut json = json!({ "run": folder.path(), "report": path });
    for (label, value) in more {
        json[label.to_lowercase()] = Value::from(value.as_str());
    }
    json["scores"] = scores_json(report)?;
    print_result(format, &json, &scores_text(report, folder.path(), more))
}

/// Formats the short report: at most [`MAX_LINES`] lines of [`MAX_COLUMNS`] characters.
pub fn scores_text(report: &Report<'_>, folder: &Path, more: &[(&str, String)]) -> String {
    let scores = report.scores();
    let helpers = scores.helpers();
    let mut footer = notes(report, &scores);
    let paths = [("Report", quoted_path(&folder.join("report.md"))), ("Run", quoted_path(folder))];
    let labeled = paths.iter().chain(more);
    footer.extend(labeled.map(|(label, value)| format!("{:8} {value}", format!("{label}:"))));
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

/// Splits a long name into two lines of the column of helpers, and shortens a longer one.
fn wrapped_name(name: &str) -> [String; 2] {
    let chars: Vec<char> = shortened(name, 2 * HELPER_COLUMNS).chars().collect();
    let (first, rest) = chars.split_at(chars.len().min(HELPER_COLUMNS));
    [first.iter().collect(), rest.iter().collect()]
}

/// Shortens a text to this number of characters.
fn shortened(text: &str, max: usize) -> String {
    if text.chars().count() <= max {
        return text.to_owned();
    }
    text.chars().take(max - 1).chain(['\u{2026}']).collect()
}

/// Returns a line with the grants of each helper, and one for the partner if it has more than the default.
fn grants(report: &Report<'_>, helpers: &[String]) -> Vec<String> {
    let labels = report.labels();
    let helpers = helpers.iter().filter(|helper| *helper != NONE);
    let each = helpers.map(|helper| format!("Granted: {}", labels.title(helper)));
    each.chain(labels.sentence(&[])).map(|line| shortened(&line, MAX_COLUMNS)).collect()
}

/// Returns the lines that qualify the scores, such as the number of failed episode runs.
fn notes(report: &Report<'_>, scores: &Scores) -> Vec<String> {
    let rows = || scores.tasks.values().flat_map(|row| row.values());
    let n_failed: usize = rows().map(|score| score.failed).sum();
    let mut notes = Vec::new();
    if n_failed > 0 {
        let runs = counted(n_failed, "episode run");
        notes.push(format!("* {runs} failed and count as zero; report.md has the reasons."));
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
        let [first, rest] = wrapped_name(&"x".repeat(40));
        assert_eq!((first.len(), rest.chars().count()), (11, 11));
        assert!(rest.ends_with('\u{2026}'), "{rest}");
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
