//! The paper's tables.

use std::collections::{BTreeMap, BTreeSet};

use chaic_protocol::TaskId;

use crate::helpers::NONE;
use crate::metrics::{Difference, Interval, RunResult, Score, Scores};
use crate::report::grid::Grid;

/// What stands where there is nothing to say, as in the paper.
const UNDEFINED: &str = "/";
/// Tasks side by side in one table, as in the paper.
const TASKS_ABREAST: usize = 4;

/// A column of a score: its name, whether a task has it, and its text.
struct Column {
    name: &'static str,
    in_task: fn(TaskId) -> bool,
    cell: fn(&Score) -> String,
}

/// The paper's main table: TR(EI), IA, and ER while shopping.
pub fn main_result(scores: &Scores) -> Vec<Grid> {
    let columns = [
        Column { name: "TR(EI)", in_task: |_| true, cell: rate_and_improvement },
        Column { name: "IA", in_task: |_| true, cell: |s| number(s.ia) },
        Column { name: "ER", in_task: |t| t.info().has_child, cell: |s| number(s.er) },
    ];
    blocks(scores, "Transport rate (efficiency improvement), goal inference accuracy", &columns)
}

/// The paper's additional table: CR, and how uncertain TR is.
pub fn additional(scores: &Scores) -> Vec<Grid> {
    let columns = [
        Column { name: "CR", in_task: |_| true, cell: |s| number(s.cr) },
        Column { name: "SE", in_task: |_| true, cell: |s| number(s.tr_se) },
    ];
    blocks(scores, "Completion ratio of the helper, standard error of TR", &columns)
}

/// Differences of TR between helpers, with 95 % intervals.
pub fn pairs(differences: &[Difference], tasks: &[TaskId]) -> Grid {
    let header = ["TR difference".to_owned(), "all".to_owned()].into_iter();
    let header = header.chain(tasks.iter().map(|t| t.info().title.to_owned()));
    let row = |d: &Difference| {
        let name = format!("{} - {}", title(&d.helper), title(&d.baseline));
        let cells = tasks.iter().map(|t| interval(d.tasks.get(t)));
        [name, interval(d.all.as_ref())].into_iter().chain(cells).collect()
    };
    Grid {
        title: "Differences of TR on the same episodes, with 95 % intervals".to_owned(),
        header: header.collect(),
        rows: differences.iter().map(row).collect(),
    }
}

/// What minds counted of their own doings, summed over all episodes; `None` if nobody counted.
pub fn counts(results: &[RunResult]) -> Option<Grid> {
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
    let header = std::iter::once("Count".to_owned()).chain(helpers.iter().map(|h| title(h)));
    (!sums.is_empty()).then(|| Grid {
        title: "What minds counted of their own doings, all episodes".to_owned(),
        header: header.collect(),
        rows: sums.iter().map(row).collect(),
    })
}

/// What a table calls a helper.
pub fn title(helper: &str) -> String {
    match helper {
        NONE => "w/o".to_owned(),
        "random" => "Random".to_owned(),
        "rhp" => "RHP".to_owned(),
        "oracle" => "Oracle".to_owned(),
        "follow" => "Follow".to_owned(),
        "llm" => "LLM+BM".to_owned(),
        "llm-told" => "LLM+BM, told".to_owned(),
        "vlm" => "VLM".to_owned(),
        "vlm-told" => "VLM, told".to_owned(),
        other => other.to_owned(),
    }
}

fn blocks(scores: &Scores, name: &str, columns: &[Column]) -> Vec<Grid> {
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
            let cell = |(task, column): &(TaskId, &Column)| {
                scores.get(*task, helper).map_or(UNDEFINED.to_owned(), column.cell)
            };
            std::iter::once(title(helper)).chain(shown.iter().map(cell)).collect()
        };
        let rows = helpers.iter().map(row).collect();
        Grid { title: name.to_owned(), header, rows }
    };
    tasks.chunks(TASKS_ABREAST).map(grid).collect()
}

fn rate_and_improvement(score: &Score) -> String {
    match score.ei {
        Some(ei) => format!("{:.2}({})", score.tr, rounded(ei)),
        None => format!("{:.2}", score.tr),
    }
}

/// Two decimals, or a sign that there is nothing to say.
pub(crate) fn number(value: Option<f64>) -> String {
    value.map_or(UNDEFINED.to_owned(), rounded)
}

/// Two decimals; what rounds to zero has no sign.
pub(crate) fn rounded(value: f64) -> String {
    let text = format!("{value:.2}");
    if text == "-0.00" { "0.00".to_owned() } else { text }
}

/// A mean with its interval, or a sign that there is nothing to say.
pub(crate) fn interval(interval: Option<&Interval>) -> String {
    /// An interval from fewer episodes is wider than all that a rate can be.
    const MIN_EPISODES: usize = 3;
    match interval {
        None => UNDEFINED.to_owned(),
        Some(i) if i.n < MIN_EPISODES => rounded(i.mean),
        Some(i) => format!("{} [{}, {}]", rounded(i.mean), rounded(i.low), rounded(i.high)),
    }
}
