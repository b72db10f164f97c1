//! Tables of a report, in the layout of the paper's tables.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::TaskId;

use crate::metrics::{Difference, Interval, Metric, RunResult, Score, Scores, resolution};
use crate::report::labels::{Labels, title};
use crate::report::text_table::TextTable;

/// Text of an undefined value, as in the paper.
const UNDEFINED: &str = "/";
/// Mark of a number that includes failed episode runs, which count as zero.
pub(super) const FAILED: &str = "*";
/// Mark of a number that lacks episode runs; replaces the number if all are missing.
pub(super) const MISSING: &str = "?";
/// Minimum number of environments for an interval; with fewer, it covers the whole range of a rate.
pub const MIN_ENVIRONMENTS: usize = 3;
/// Number of tasks per table, as in the paper.
const TASKS_PER_TABLE: usize = 4;

/// A column of a table of scores.
struct Column {
    name: &'static str,
    in_task: fn(TaskId) -> bool,
    cell: Cell,
}

/// Source of the text of a cell.
enum Cell {
    Metric(&'static Metric),
    Text(fn(&Score) -> String),
}

impl Column {
    fn from_key(key: &str) -> Column {
        let metric = Metric::from_key(key);
        Column { name: metric.name, in_task: metric.in_task, cell: Cell::Metric(metric) }
    }

    fn text(&self, score: &Score) -> String {
        match &self.cell {
            Cell::Metric(metric) => {
                let shown = metric.value(score).map(|v| fixed(v, metric.decimals));
                shown.unwrap_or_else(|| UNDEFINED.to_owned())
            }
            Cell::Text(text) => text(score),
        }
    }
}

/// Builds the paper's main table: TR(EI), IA, and ER for shopping.
pub fn main_result(scores: &Scores, labels: Labels<'_>) -> Vec<TextTable> {
    let columns = [
        Column { name: "TR(EI)", in_task: |_| true, cell: Cell::Text(rate_and_improvement) },
        Column::from_key("ia"),
        Column::from_key("er"),
    ];
    let name = "Transport rate (efficiency improvement), goal inference accuracy";
    score_tables(scores, labels, name, &columns)
}

/// Builds the paper's additional table: CR and the standard error of TR.
pub fn additional(scores: &Scores, labels: Labels<'_>) -> Vec<TextTable> {
    let columns = ["cr", "tr_se"].map(Column::from_key);
    score_tables(scores, labels, "Completion ratio of the helper, standard error of TR", &columns)
}

/// Builds the table of the fraction of frames in which partner or helper were stuck; empty if no
/// result has it.
pub fn stuck(scores: &Scores, labels: Labels<'_>) -> Vec<TextTable> {
    let columns = [Column::from_key("stuck")];
    let is_known = scores.tasks.values().flat_map(|row| row.values()).any(|s| s.stuck.is_some());
    let name = capitalized(Metric::from_key("stuck").title);
    if is_known { score_tables(scores, labels, &name, &columns) } else { Vec::new() }
}

/// Builds one table per diagnostic metric of [`METRICS`](crate::metrics::METRICS), without those
/// that no result has.
pub fn diagnostics(scores: &Scores, labels: Labels<'_>) -> Vec<TextTable> {
    let tasks = scores.tasks();
    let table = |metric: &'static Metric| {
        let value = |task: TaskId, helper: &str| metric.value(scores.get(task, helper)?);
        let row = |helper: &String| {
            let cell = |task: &TaskId| {
                let shown = |value: f64| fixed(value, metric.decimals);
                value(*task, helper).map_or(UNDEFINED.to_owned(), shown)
            };
            std::iter::once(labels.lines(helper)).chain(tasks.iter().map(cell)).collect()
        };
        let header = std::iter::once("Helper".to_owned());
        let helpers = scores.helpers();
        let is_known = helpers.iter().any(|h| tasks.iter().any(|t| value(*t, h).is_some()));
        is_known.then(|| TextTable {
            title: metric.title.to_owned(),
            header: header.chain(tasks.iter().map(|t| t.info().title.to_owned())).collect(),
            rows: helpers.iter().map(row).collect(),
        })
    };
    Metric::diagnostics().filter_map(table).collect()
}

/// Builds the table of transport rates with their 95 % intervals.
pub fn intervals(scores: &Scores, labels: Labels<'_>) -> TextTable {
    let tasks = scores.tasks();
    let cell = |helper: &String, task: &TaskId| {
        let Some(score) = scores.get(*task, helper) else { return UNDEFINED.to_owned() };
        let ends = shown_interval(score)
            .map(|[low, high]| format!(" [{}, {}]", rounded(low), rounded(high)));
        rounded(score.tr) + &ends.unwrap_or_default()
    };
    let row = |helper: &String| {
        let cells = tasks.iter().map(|t| cell(helper, t));
        std::iter::once(labels.lines(helper)).chain(cells).collect()
    };
    let header = std::iter::once("TR".to_owned());
    TextTable {
        title: "Transport rate with 95 % intervals over environments".to_owned(),
        header: header.chain(tasks.iter().map(|t| t.info().title.to_owned())).collect(),
        rows: scores.helpers().iter().map(row).collect(),
    }
}

/// Builds the table of the smallest distinguishable differences by task; `None` if no pair of
/// helpers has an interval.
pub fn resolutions(differences: &[Difference], tasks: &[TaskId]) -> Option<TextTable> {
    let by_task = tasks.iter().map(|t| (t.info().title, Some(*t)));
    let rows = by_task.chain(std::iter::once(("all tasks", None))).filter_map(|(name, task)| {
        let r = resolution(differences, task)?;
        let values = [r.environments.to_string(), rounded(r.median), rounded(r.largest)];
        Some(std::iter::once(name.to_owned()).chain(values).collect())
    });
    let rows: Vec<Vec<String>> = rows.collect();
    let header = ["Task", "environments", "median pair of helpers", "widest pair"];
    (!rows.is_empty()).then(|| TextTable {
        title:
            "Smallest difference of TR that can be told from zero (half the 95 % interval of the \
                paired difference)"
                .to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows,
    })
}

/// Builds the table of TR differences between helpers, with 95 % intervals; `granted` describes the
/// grants of the helpers.
pub fn pairs(
    differences: &[Difference],
    tasks: &[TaskId],
    labels: Labels<'_>,
    granted: Option<&str>,
) -> TextTable {
    let header = ["TR difference".to_owned(), "all".to_owned()].into_iter();
    let header = header.chain(tasks.iter().map(|t| t.info().title.to_owned()));
    let row = |d: &Difference| {
        let name = format!("{} - {}", labels.name(&d.helper), labels.name(&d.baseline));
        let cells = tasks.iter().map(|t| interval(d.tasks.get(t)));
        [name, interval(d.all.as_ref())].into_iter().chain(cells).collect()
    };
    TextTable {
        title: format!(
            "Differences of TR on the same episodes, with 95 % intervals over environments{}",
            granted.map_or(String::new(), |text| format!(". {text}"))
        ),
        header: header.collect(),
        rows: differences.iter().map(row).collect(),
    }
}

/// Builds the table of TR differences between this run and another, with 95 % intervals.
pub fn run_pairs(differences: &[Difference], tasks: &[TaskId], baseline: &str) -> TextTable {
    let header = ["TR difference".to_owned(), "all".to_owned()].into_iter();
    let row = |d: &Difference| {
        let cells = tasks.iter().map(|task| interval(d.tasks.get(task)));
        [title(&d.helper), interval(d.all.as_ref())].into_iter().chain(cells).collect()
    };
    TextTable {
        title: format!(
            "TR minus that in {baseline} on the same episodes, with 95 % intervals over environments"
        ),
        header: header.chain(tasks.iter().map(|t| t.info().title.to_owned())).collect(),
        rows: differences.iter().map(row).collect(),
    }
}

/// Builds the table of the agents' own counters, summed over all episodes; `None` without counters.
pub fn counts(results: &[RunResult], labels: Labels<'_>) -> Option<TextTable> {
    let mut sums: BTreeMap<&str, BTreeMap<&str, u64>> = BTreeMap::new();
    for result in results {
        for (name, n) in result.summary().into_iter().flat_map(|s| &s.counts) {
            *sums.entry(name).or_default().entry(&result.key.helper).or_default() += n;
        }
    }
    let helpers: BTreeSet<&str> =
        sums.values().flat_map(|by_helper| by_helper.keys().copied()).collect();
    let row = |(name, by_helper): (&&str, &BTreeMap<&str, u64>)| {
        let cells = helpers.iter().map(|h| by_helper.get(h).copied().unwrap_or(0).to_string());
        std::iter::once(name.replace('_', " ").replace('.', ": ")).chain(cells).collect()
    };
    let header = std::iter::once("Count".to_owned()).chain(helpers.iter().map(|h| labels.lines(h)));
    (!sums.is_empty()).then(|| TextTable {
        title: "Counters of the agents, summed over all episodes".to_owned(),
        header: header.collect(),
        rows: sums.iter().map(row).collect(),
    })
}

fn score_tables(
    scores: &Scores,
    labels: Labels<'_>,
    name: &str,
    columns: &[Column],
) -> Vec<TextTable> {
    let tasks = scores.tasks();
    let helpers = scores.helpers();
    let table = |tasks: &[TaskId]| {
        let shown: Vec<(TaskId, &Column)> = tasks
            .iter()
            .flat_map(|t| columns.iter().filter(|c| (c.in_task)(*t)).map(|c| (*t, c)))
            .collect();
        let mut header = vec!["Helper".to_owned()];
        let mut last = None;
        for (task, column) in &shown {
            let title = if last == Some(*task) { "" } else { task.info().title };
            header.push(format!("{title}\n{}", column.name));
            last = Some(*task);
        }
        let row = |helper: &String| {
            let cell = |(task, column): &(TaskId, &Column)| match scores.get(*task, helper) {
                // One mark per task and row is enough.
                Some(score) if column.name == columns[0].name => column.text(score) + marks(score),
                Some(score) => column.text(score),
                None if scores.is_unplayed(*task, helper) => MISSING.to_owned(),
                None => UNDEFINED.to_owned(),
            };
            std::iter::once(labels.lines(helper)).chain(shown.iter().map(cell)).collect()
        };
        let rows = helpers.iter().map(row).collect();
        TextTable { title: name.to_owned(), header, rows }
    };
    tasks.chunks(TASKS_PER_TABLE).map(table).collect()
}

/// Returns the 95 % interval of TR if it is narrower than the range of a rate.
pub fn shown_interval(score: &Score) -> Option<[f64; 2]> {
    score.tr_ci.filter(|_| score.environments >= MIN_ENVIRONMENTS)
}

/// Returns the marks of a row with failed or missing episode runs.
fn marks(score: &Score) -> &'static str {
    match (score.failed > 0, score.incomplete) {
        (false, false) => "",
        (true, false) => FAILED,
        (false, true) => MISSING,
        (true, true) => "*?",
    }
}

fn rate_and_improvement(score: &Score) -> String {
    match score.ei {
        Some(ei) => format!("{:.2}({})", score.tr, rounded(ei)),
        None => format!("{:.2}", score.tr),
    }
}

/// Formats a value with two decimals, or as undefined.
pub fn number(value: Option<f64>) -> String {
    value.map_or(UNDEFINED.to_owned(), rounded)
}

/// Returns the text with its first letter in upper case.
pub fn capitalized(text: &str) -> String {
    let head = text.chars().next().map_or(0, char::len_utf8);
    text[..head].to_uppercase() + &text[head..]
}

/// Formats a value with a fixed number of decimals; a value that rounds to zero has no sign.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = text.chars().all(|c| "-0.".contains(c));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

/// Formats a value with two decimals; a value that rounds to zero has no sign.
pub fn rounded(value: f64) -> String {
    fixed(value, 2)
}

/// Formats a mean with its interval, or as undefined.
pub fn interval(interval: Option<&Interval>) -> String {
    match interval {
        None => UNDEFINED.to_owned(),
        Some(i) if i.environments < MIN_ENVIRONMENTS => rounded(i.mean),
        Some(i) => format!("{} [{}, {}]", rounded(i.mean), rounded(i.low), rounded(i.high)),
    }
}
