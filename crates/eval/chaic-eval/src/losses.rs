//! Losses of each helper against the upper bound `oracle_plan`, split by cause.
//!
//! The reference helpers share one planner and differ in their grants. The difference of two
//! references is therefore the effect of a grant, and the difference between a helper and the
//! reference with its grants is the effect of its planning. `docs/metrics.md` defines the causes.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use chaic_core::TaskId;
use chaic_core::observation::Grants;
use chaic_env::helper_registry::NONE;
use serde::Serialize;

use crate::metrics::{Interval, PlayedEpisodes, RunResult, differences};
use crate::report::{Format, Report, TextTable, interval, title};
use crate::run::RunGrants;

/// Upper bound: goal and state granted.
const BOUND: &str = "oracle_plan";
/// Reference helper with only the state granted.
const WITH_STATE: &str = "ideal_observer";
/// Reference helper with only the goal granted.
const WITH_GOAL: &str = "infer_known_goal";
/// Reference helper with neither.
const WITHOUT: &str = "infer";

/// Loss by one cause, in transport rate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Loss {
    /// Name of the cause: `total`, `search`, `inference` or `planning`.
    pub cause: &'static str,
    /// Mean over the episodes of all tasks; `None` without an interval.
    pub all: Option<Interval>,
    /// Mean per task.
    pub tasks: BTreeMap<TaskId, Interval>,
}

/// Losses of one helper.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HelperLosses {
    /// Name of the helper.
    pub helper: String,
    /// Losses by cause; the first one is the total, of which the others are the parts.
    pub losses: Vec<Loss>,
}

/// Losses of all helpers of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Losses {
    /// Losses per helper, in the order of the run.
    pub helpers: Vec<HelperLosses>,
    /// Tasks in the order of reports.
    #[serde(skip)]
    tasks: Vec<TaskId>,
}

impl Losses {
    /// Computes the losses from the results of a report.
    ///
    /// # Errors
    /// One sentence that describes what the run lacks.
    pub fn from_report(report: &Report<'_>) -> Result<Losses, String> {
        let granted = report.granted.ok_or("the run has no recorded grants")?;
        let plan = report.plan();
        Losses::new(report.played_episodes(&plan), &report.options.helpers, granted)
    }

    /// Computes the losses from the results of a run with these helpers, or names the missing
    /// reference helpers.
    fn new(
        played: PlayedEpisodes<'_>,
        helpers: &[String],
        granted: &RunGrants,
    ) -> Result<Losses, String> {
        let others = helpers.iter().filter(|helper| !matches!(helper.as_str(), BOUND | NONE));
        let steps: Vec<(&String, Vec<CauseDifference>)> = others
            .map(|helper| (helper, steps(helper, granted.helpers.get(helper).copied())))
            .collect();
        let compared = steps.iter().flat_map(|(_, steps)| steps);
        let used = compared.flat_map(|step| [step.from, step.to]).chain([BOUND]);
        let missing: BTreeSet<&str> =
            used.filter(|name| !helpers.iter().any(|helper| helper == name)).collect();
        if !missing.is_empty() {
            let names: Vec<&str> = missing.into_iter().collect();
            return Err(format!(
                "losses need the helpers {} in the same run; play them too",
                names.join(", ")
            ));
        }
        let helpers: Vec<HelperLosses> = steps
            .iter()
            .map(|(helper, steps)| {
                let compared: BTreeSet<&str> =
                    steps.iter().flat_map(|step| [step.from, step.to]).collect();
                let results = on_common_episodes(played.results, &compared);
                let played = PlayedEpisodes { results: &results, ..played };
                let losses = steps.iter().map(|step| step.loss(played)).collect();
                HelperLosses { helper: (*helper).clone(), losses }
            })
            .collect();
        let losses = || helpers.iter().flat_map(|helper| &helper.losses);
        let is_known = |task: &TaskId| losses().any(|loss| loss.tasks.contains_key(task));
        let tasks = TaskId::all().filter(is_known).collect();
        Ok(Losses { helpers, tasks })
    }

    /// Formats the losses; the text ends with a line break.
    pub fn text(&self, format: Format) -> String {
        const LEGEND: &str = "Loss of TR against oracle_plan on the episodes that the helper and its \
                              references have,\nwith 95 % intervals over environments. total = \
                              search + inference + planning;\ndocs/metrics.md defines them.\n";
        match format {
            Format::Table => format!("{}\n{LEGEND}", self.table().to_terminal()),
            Format::Markdown => format!("{}\n{LEGEND}", self.table().to_markdown()),
            Format::Csv => self.csv(),
            Format::Json => {
                serde_json::to_string_pretty(self).expect("losses have string keys") + "\n"
            }
        }
    }

    fn rows(&self) -> impl Iterator<Item = (&str, &Loss)> {
        self.helpers.iter().flat_map(|h| h.losses.iter().map(move |loss| (h.helper.as_str(), loss)))
    }

    fn table(&self) -> TextTable {
        let header = ["Helper", "Loss by", "all"].map(str::to_owned).into_iter();
        let row = |(helper, loss): (&str, &Loss)| {
            let cells = self.tasks.iter().map(|task| interval(loss.tasks.get(task)));
            let first = [title(helper), loss.cause.to_owned(), interval(loss.all.as_ref())];
            first.into_iter().chain(cells).collect()
        };
        TextTable {
            title: "Losses against the upper bound, by cause".to_owned(),
            header: header.chain(self.tasks.iter().map(|t| t.info().title.to_owned())).collect(),
            rows: self.rows().map(row).collect(),
        }
    }

    fn csv(&self) -> String {
        let mut text = "helper,cause,task,loss,low,high\n".to_owned();
        for (helper, loss) in self.rows() {
            let all = loss.all.iter().map(|i| ("all", i));
            for (task, i) in all.chain(loss.tasks.iter().map(|(task, i)| (task.name(), i))) {
                let Interval { mean, low, high, .. } = i;
                let _ =
                    writeln!(text, "{helper},{},{task},{mean:.6},{low:.6},{high:.6}", loss.cause);
            }
        }
        text
    }
}

/// Returns the results of these helpers on the episodes that all of them have. On other episodes the
/// losses by cause would not add up.
fn on_common_episodes(results: &[RunResult], helpers: &BTreeSet<&str>) -> Vec<RunResult> {
    let of_helpers = || results.iter().filter(move |r| helpers.contains(r.key.helper.as_str()));
    let mut players: BTreeMap<(TaskId, &str), BTreeSet<&str>> = BTreeMap::new();
    for RunResult { key, .. } in of_helpers() {
        players.entry((key.task, &key.episode)).or_default().insert(&key.helper);
    }
    let is_common =
        |r: &&RunResult| players[&(r.key.task, r.key.episode.as_str())].len() == helpers.len();
    of_helpers().filter(is_common).cloned().collect()
}

/// Difference of two helpers that one cause explains.
#[derive(Clone, Copy, Debug)]
struct CauseDifference<'a> {
    cause: &'static str,
    from: &'a str,
    to: &'a str,
}

impl CauseDifference<'_> {
    /// Returns the mean of `from` − `to`.
    fn loss(&self, played: PlayedEpisodes<'_>) -> Loss {
        let pair = [self.to, self.from].map(str::to_owned);
        let difference = differences(played, &pair).pop();
        let (all, tasks) = difference.map(|d| (d.all, d.tasks)).unwrap_or_default();
        Loss { cause: self.cause, all, tasks }
    }
}

/// Returns the total loss of a helper with these grants, and the parts that are not zero by
/// definition.
fn steps<'a>(helper: &'a str, grants: Option<Grants>) -> Vec<CauseDifference<'a>> {
    let Grants { goal, state, .. } = grants.unwrap_or(Grants::NONE);
    // References from the upper bound to the helper's grants, with the cause of each difference.
    let path: &[(&'static str, &'static str)] = match (state, goal) {
        (true, true) => &[],
        (true, false) => &[("inference", WITH_STATE)],
        (false, true) => &[("search", WITH_GOAL)],
        (false, false) => &[("search", WITH_GOAL), ("inference", WITHOUT)],
    };
    let mut steps = vec![CauseDifference { cause: "total", from: BOUND, to: helper }];
    let mut from = BOUND;
    for (cause, to) in path {
        steps.push(CauseDifference { cause, from, to });
        from = to;
    }
    if from != helper {
        steps.push(CauseDifference { cause: "planning", from, to: helper });
    }
    steps
}

#[cfg(test)]
mod tests;
