//! The paper's tables.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::TaskId;

use crate::metrics::{
    Difference, Interval, MEASURES, Measure, Metric, RunResult, Score, Scores, resolution,
};
use crate::report::labels::{Labels, title};
use crate::report::text_table::TextTable;

/// What stands where there is nothing to say, as in the paper.
const UNDEFINED: &str = "/";
/// Behind a number of which some episode runs broke down and count as zero.
pub(super) const BROKEN: &str = "*";
/// Behind a number of which some episode runs are missing, or in place of it if all are.
pub(super) const MISSING: &str = "?";
/// An interval from fewer environments is wider than all that a rate can be.
const MIN_ENVIRONMENTS: usize = 3;
/// Tasks side by side in one table, as in the paper.
const TASKS_ABREAST: usize = 4;

/// A column of a score: its name, whether a task has it, and its text.
struct Column {
    name: &'static str,
    in_task: fn(TaskId) -> bool,
    cell: Cell,
}

/// How the text of a cell is made.
enum Cell {
    Metric(&'static Metric),
    Text(fn(&Score) -> String),
}

impl Column {
    fn of(key: &str) -> Column {
        let metric = Metric::of(key);
        Column { name: metric.name, in_task: metric.in_task, cell: Cell::Metric(metric) }
    }

    fn text(&self, score: &Score) -> String {
        match &self.cell {
            Cell::Metric(metric) => {
                let shown = (metric.value)(score).map(|v| fixed(v, metric.decimals));
                shown.unwrap_or_else(|| UNDEFINED.to_owned())
            }
            Cell::Text(text) => text(score),
        }
    }
}

/// The paper's main table: TR(EI), IA, and ER while shopping.
pub fn main_result(scores: &Scores, labels: Labels<'_>) -> Vec<TextTable> {
    let columns = [
        Column { name: "TR(EI)", in_task: |_| true, cell: Cell::Text(rate_and_improvement) },
        Column::of("ia"),
        Column::of("er"),
    ];
    let name = "Transport rate (efficiency improvement), goal inference accuracy";
    blocks(scores, labels, name, &columns)
}

/// The paper's additional table: CR, and how uncertain TR is.
pub fn additional(scores: &Scores, labels: Labels<'_>) -> Vec<TextTable> {
    let columns = ["cr", "tr_se"].map(Column::of);
    blocks(scores, labels, "Completion ratio of the helper, standard error of TR", &columns)
}

/// For how much of their time partner or helper were stuck; nothing where no result tells.
pub fn stuck(scores: &Scores, labels: Labels<'_>) -> Vec<TextTable> {
    let columns = [Column::of("stuck")];
    let is_known = scores.tasks.values().flat_map(|row| row.values()).any(|s| s.stuck.is_some());
    let name = capitalized(Metric::of("stuck").title);
    if is_known { blocks(scores, labels, &name, &columns) } else { Vec::new() }
}

/// What else was measured, a table for each of the [`MEASURES`]; nothing where no result has it.
pub fn measures(scores: &Scores, labels: Labels<'_>) -> Vec<TextTable> {
    let tasks = scores.tasks();
    let grid = |measure: &Measure| {
        let of = |task: TaskId, helper: &str| {
            scores.get(task, helper)?.measures.get(measure.key).copied()
        };
        let row = |helper: &String| {
            let cell = |task: &TaskId| {
                let shown = |value: f64| fixed(value, measure.decimals);
                of(*task, helper).map_or(UNDEFINED.to_owned(), shown)
            };
            std::iter::once(labels.lines(helper)).chain(tasks.iter().map(cell)).collect()
        };
        let header = std::iter::once("Helper".to_owned());
        let helpers = scores.helpers();
        let is_known = helpers.iter().any(|h| tasks.iter().any(|t| of(*t, h).is_some()));
        is_known.then(|| TextTable {
            title: measure.title.to_owned(),
            header: header.chain(tasks.iter().map(|t| t.info().title.to_owned())).collect(),
            rows: helpers.iter().map(row).collect(),
        })
    };
    MEASURES.iter().filter_map(grid).collect()
}

/// The transport rates with their 95 % intervals.
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

/// What the episodes can tell apart, task by task; `None` where no pair of helpers has an interval.
pub fn resolutions(differences: &[Difference], tasks: &[TaskId]) -> Option<TextTable> {
    let of_task = tasks.iter().map(|t| (t.info().title, Some(*t)));
    let rows = of_task.chain(std::iter::once(("all tasks", None))).filter_map(|(name, task)| {
        let r = resolution(differences, task)?;
        let numbers = [r.environments.to_string(), rounded(r.median), rounded(r.largest)];
        Some(std::iter::once(name.to_owned()).chain(numbers).collect())
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

/// Differences of TR between helpers, with 95 % intervals; `granted` says what these are granted.
pub fn pairs(differences: &[Difference], tasks: &[TaskId], granted: Option<&str>) -> TextTable {
    let header = ["TR difference".to_owned(), "all".to_owned()].into_iter();
    let header = header.chain(tasks.iter().map(|t| t.info().title.to_owned()));
    let row = |d: &Difference| {
        let name = format!("{} - {}", title(&d.helper), title(&d.baseline));
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

/// What minds counted of their own doings, summed over all episodes; `None` if nobody counted.
pub fn counts(results: &[RunResult], labels: Labels<'_>) -> Option<TextTable> {
    let mut sums: BTreeMap<&str, BTreeMap<&str, u64>> = BTreeMap::new();
    for result in results {
        for (name, n) in result.summary().into_iter().flat_map(|s| &s.counts) {
            *sums.entry(name).or_default().entry(&result.key.helper).or_default() += n;
        }
    }
    let helpers: BTreeSet<&str> = sums.values().flat_map(|by| by.keys().copied()).collect();
    let row = |(name, by): (&&str, &BTreeMap<&str, u64>)| {
        let cells = helpers.iter().map(|h| by.get(h).copied().unwrap_or(0).to_string());
        std::iter::once(name.replace('_', " ").replace('.', ": ")).chain(cells).collect()
    };
    let header = std::iter::once("Count".to_owned()).chain(helpers.iter().map(|h| labels.lines(h)));
    (!sums.is_empty()).then(|| TextTable {
        title: "What minds counted of their own doings, all episodes".to_owned(),
        header: header.collect(),
        rows: sums.iter().map(row).collect(),
    })
}

fn blocks(scores: &Scores, labels: Labels<'_>, name: &str, columns: &[Column]) -> Vec<TextTable> {
    let tasks = scores.tasks();
    let helpers = scores.helpers();
    let grid = |tasks: &[TaskId]| {
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
                // One mark a task and row is enough.
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
    tasks.chunks(TASKS_ABREAST).map(grid).collect()
}

/// The interval of TR where it says more than that a rate is between 0 and 1.
pub fn shown_interval(score: &Score) -> Option<[f64; 2]> {
    score.tr_ci.filter(|_| score.environments >= MIN_ENVIRONMENTS)
}

/// Behind the first number of a row that doesn't rest on what it should.
fn marks(score: &Score) -> &'static str {
    match (score.broken > 0, score.incomplete) {
        (false, false) => "",
        (true, false) => BROKEN,
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

/// Two decimals, or a sign that there is nothing to say.
pub fn number(value: Option<f64>) -> String {
    value.map_or(UNDEFINED.to_owned(), rounded)
}

/// With a capital letter at its head.
pub fn capitalized(text: &str) -> String {
    let head = text.chars().next().map_or(0, char::len_utf8);
    text[..head].to_uppercase() + &text[head..]
}

/// So many decimals; what rounds to zero has no sign.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = text.chars().all(|c| "-0.".contains(c));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

/// Two decimals; what rounds to zero has no sign.
pub fn rounded(value: f64) -> String {
    fixed(value, 2)
}

/// A mean with its interval, or a sign that there is nothing to say.
pub fn interval(interval: Option<&Interval>) -> String {
    match interval {
        None => UNDEFINED.to_owned(),
        Some(i) if i.environments < MIN_ENVIRONMENTS => rounded(i.mean),
        Some(i) => format!("{} [{}, {}]", rounded(i.mean), rounded(i.low), rounded(i.high)),
    }
}
