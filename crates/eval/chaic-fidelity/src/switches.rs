//! Effect of a single rule: the original's rules compared with the same rules after one is set to
//! the paper's value.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::TaskId;
use chaic_env::RunKey;
use chaic_env::rules::rule_values;

use crate::experiment_folder::PartState;
use chaic_eval::Result;
use chaic_eval::metrics::{Interval, PlayedEpisodes, RunResult, differences};
use chaic_eval::report::{TextTable, interval, title};

/// Number of rules listed per task.
const MAX_NAMED: usize = 3;

/// Change of a helper's transport rate by a switch, on the same episodes and seeds.
#[derive(Clone, Debug, PartialEq)]
pub struct SwitchEffect {
    /// Name of the rule.
    pub rule: String,
    /// Name of the helper.
    pub helper: String,
    /// Rate with the switch minus rate without, by task.
    pub tasks: BTreeMap<TaskId, Interval>,
    /// Change over the episodes of all tasks.
    pub all: Option<Interval>,
}

/// Returns the change of a helper's rates from `base` to `switched`, over the episode runs that
/// both completed.
pub fn switch_effect(
    rule: &str,
    base: PlayedEpisodes<'_>,
    switched: &[RunResult],
    helper: &str,
) -> SwitchEffect {
    const NAMES: [&str; 2] = ["base", "switched"];
    let keys = |results: &[RunResult]| -> BTreeSet<RunKey> {
        let scored = results.iter().filter(|r| r.key.helper == helper && r.summary().is_some());
        scored.map(|r| r.key.clone()).collect()
    };
    let both: BTreeSet<RunKey> =
        keys(base.results).intersection(&keys(switched)).cloned().collect();
    let mut named = Vec::new();
    for (name, results) in NAMES.iter().zip([base.results, switched]) {
        for result in results.iter().filter(|r| both.contains(&r.key)) {
            let mut result = result.clone();
            result.key.helper = (*name).to_owned();
            named.push(result);
        }
    }
    let named = PlayedEpisodes { results: &named, planned: &[], ..base };
    let found = differences(named, &NAMES.map(str::to_owned)).pop();
    let (tasks, all) = found.map_or((BTreeMap::new(), None), |d| (d.tasks, d.all));
    SwitchEffect { rule: rule.to_owned(), helper: helper.to_owned(), tasks, all }
}

fn excludes_zero(i: &Interval) -> bool {
    i.low > 0.0 || i.high < 0.0
}

/// Returns the section about switches; `base` is the run with the original's rules.
pub(super) fn section(
    base: &PartState,
    switches: &[&PartState],
    tasks: &[TaskId],
) -> Result<String> {
    let Some(first) = switches.first() else { return Ok(String::new()) };
    let (helpers, seeds) = (&first.part.helpers, first.part.seeds);
    let seeds = if seeds == 1 { "the first seed".to_owned() } else { format!("{seeds} seeds") };
    let mut text = format!(
        "## One rule at a time\n\nChange of TR when one rule of `compat` is set to the value of `paper`, on \
         the same episodes with {seeds}, with the 95 % interval of the paired change over \
         environments. Sorted by the magnitude of the change over all tasks. **Bold**: the interval \
         excludes zero. `0`: no episode's rate changed.\n\n"
    );
    let mut changes: BTreeMap<&str, Vec<SwitchEffect>> = BTreeMap::new();
    for helper in helpers {
        let compare = |s: &&PartState| {
            let rule = s.part.switch.as_deref().unwrap_or("");
            switch_effect(rule, base.played(), &s.results, helper)
        };
        let mut list: Vec<SwitchEffect> = switches.iter().map(compare).collect();
        list.sort_by(|a, b| magnitude(b.all.as_ref()).total_cmp(&magnitude(a.all.as_ref())));
        text += &table(helper, &list, tasks)?.to_markdown();
        text.push('\n');
        changes.insert(helper, list);
    }
    text += &chance(&changes);
    text += &largest_changes(helpers, &changes, tasks).to_markdown();
    text.push('\n');
    Ok(text)
}

fn magnitude(interval: Option<&Interval>) -> f64 {
    interval.map_or(0.0, |i| i.mean.abs())
}

fn table(helper: &str, changes: &[SwitchEffect], tasks: &[TaskId]) -> Result<TextTable> {
    let header = ["Rule".to_owned(), "compat to paper".to_owned(), "all".to_owned()].into_iter();
    let mut rows = Vec::new();
    for c in changes {
        let (paper, compat) = rule_values(&c.rule)?;
        let mut row = vec![format!("`{}`", c.rule), format!("{compat} to {paper}")];
        row.push(cell(c.all.as_ref()));
        row.extend(tasks.iter().map(|t| cell(c.tasks.get(t))));
        rows.push(row);
    }
    Ok(TextTable {
        title: format!("Change of TR, {}", title(helper)),
        header: header.chain(tasks.iter().map(|t| t.info().title.to_owned())).collect(),
        rows,
    })
}

fn cell(change: Option<&Interval>) -> String {
    match change {
        Some(i) if i.mean == 0.0 && i.low == i.high => "0".to_owned(),
        Some(i) if excludes_zero(i) => format!("**{}**", interval(change)),
        _ => interval(change),
    }
}

/// Reports how many marked cells chance alone would give.
fn chance(changes: &BTreeMap<&str, Vec<SwitchEffect>>) -> String {
    let is_nonzero = |i: &&Interval| i.low < i.high;
    let cells = || changes.values().flatten().flat_map(|c| c.tasks.values()).filter(is_nonzero);
    let (n, marked) = (cells().count(), cells().filter(|i| excludes_zero(i)).count());
    format!(
        "Of {n} nonzero changes in single tasks, {marked} are marked; chance alone would mark \
         about {:.0}. A rule without effect may still matter in combination with others.\n\n",
        n as f64 * 0.05
    )
}

fn largest_changes(
    helpers: &[String],
    changes: &BTreeMap<&str, Vec<SwitchEffect>>,
    tasks: &[TaskId],
) -> TextTable {
    let row = |task: &TaskId| {
        let largest = |helper: &String| {
            let list = changes.get(helper.as_str()).into_iter().flatten();
            let mut significant: Vec<(&str, &Interval)> =
                list.filter_map(|c| Some((c.rule.as_str(), c.tasks.get(task)?))).collect();
            significant.retain(|(_, i)| excludes_zero(i));
            significant.sort_by(|a, b| b.1.mean.abs().total_cmp(&a.1.mean.abs()));
            let named =
                significant.iter().take(MAX_NAMED).map(|(r, i)| format!("`{r}` {:+.2}", i.mean));
            let named: Vec<String> = named.collect();
            if named.is_empty() { "none".to_owned() } else { named.join(", ") }
        };
        std::iter::once(task.info().title.to_owned()).chain(helpers.iter().map(largest)).collect()
    };
    let header = std::iter::once("Task".to_owned()).chain(helpers.iter().map(|h| title(h)));
    TextTable {
        title: format!("The {MAX_NAMED} largest changes of each task whose intervals exclude zero"),
        header: header.collect(),
        rows: tasks.iter().map(row).collect(),
    }
}
