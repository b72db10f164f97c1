//! Robustness report: tables, Markdown, CSV and JSON.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use chaic_env::CHAIC_VERSION;
use serde::Serialize;

use super::PartnerRun;
use crate::metrics::{Estimate, HelperRobustness, PartnerGain, PartnerResults, robustness};
use crate::report::{Format, TextTable, UNKNOWN_ENVIRONMENTS, interval, rounded, title};
use crate::run::environments;

/// Text of an undefined value.
const UNDEFINED: &str = "/";

/// Robustness of the helpers of a run with several partners.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Robustness {
    /// Version of chaic that computed it.
    chaic: String,
    /// Command that plays the same runs; a list of partners appears as `FILE`.
    command: String,
    /// Numbers of episode runs over all partners.
    episode_runs: EpisodeRuns,
    /// Agent and change of the person, by partner.
    partners: BTreeMap<String, String>,
    /// Robustness by helper, in the order of the run.
    helpers: Vec<HelperRobustness>,
    /// True if the environments of the episodes are known.
    #[serde(skip)]
    has_environments: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
struct EpisodeRuns {
    /// 0 if the episodes can't be read.
    planned: usize,
    finished: usize,
    broken: usize,
}

impl Robustness {
    /// Computes the robustness from the runs of all partners; the first is the ordinary one.
    pub fn from_runs(runs: &[PartnerRun]) -> Robustness {
        let results: Vec<PartnerResults<'_>> = runs
            .iter()
            .map(|run| PartnerResults {
                partner: &run.partner.name,
                person: run.partner.person,
                results: &run.results,
            })
            .collect();
        let first = runs.first();
        let helpers = first.map(|run| run.options.helpers.clone()).unwrap_or_default();
        let environments =
            environments(first.map(|run| run.planned.as_slice()).unwrap_or_default());
        let count = |n: fn(&PartnerRun) -> usize| runs.iter().map(n).sum();
        let description = |run: &PartnerRun| {
            let mind = run.partner.partner.clone();
            let body = run.partner.person.map(|change| change.to_string());
            let words: Vec<String> = mind.into_iter().chain(body).collect();
            (run.partner.name.clone(), words.join(" "))
        };
        Robustness {
            chaic: CHAIC_VERSION.to_owned(),
            command: first.map_or_else(String::new, |run| run.options.command())
                + " --partners FILE",
            episode_runs: EpisodeRuns {
                planned: count(|run| run.planned.len()),
                finished: count(|run| run.results.len()),
                broken: count(|run| run.results.iter().filter(|r| r.summary().is_none()).count()),
            },
            partners: runs.iter().skip(1).map(description).collect(),
            helpers: robustness(&results, &helpers, &environments),
            has_environments: first.is_some_and(|run| !run.planned.is_empty()),
        }
    }

    /// Returns the robustness by helper.
    pub fn helpers(&self) -> &[HelperRobustness] {
        &self.helpers
    }

    /// Returns the content of `robustness.json` and of `robustness.md`.
    pub(super) fn files(&self) -> [String; 2] {
        let heading = format!("# chaic robustness\n\nchaic {}. `{}`\n\n", self.chaic, self.command);
        [self.text(Format::Json), heading + &self.text(Format::Markdown)]
    }

    /// Formats the report; the text ends with a line break.
    pub fn text(&self, format: Format) -> String {
        match format {
            Format::Table => {
                let tables = self.tables().iter().map(|table| table.to_terminal() + "\n").collect();
                self.with_legend(tables)
            }
            Format::Markdown => {
                let tables = self.tables().iter().map(|table| table.to_markdown() + "\n").collect();
                self.with_legend(tables)
            }
            Format::Csv => self.csv(),
            Format::Json => {
                serde_json::to_string_pretty(self).expect("the report has string keys") + "\n"
            }
        }
    }

    fn with_legend(&self, tables: String) -> String {
        let mut text = tables;
        text += "Gain: TR minus TR without helper, with the same partner, on the same episodes. 95 % \
                 intervals over environments.\nShare kept: gain with other partners / gain with the \
                 ordinary one. Worst tenth: mean gain of the worst\ntenth of all pairs of partner and \
                 episode; docs/metrics.md.\n";
        let EpisodeRuns { planned, finished, broken } = self.episode_runs;
        if finished < planned {
            let _ = writeln!(
                text,
                "Unfinished: {} of {planned} episode runs are missing; all numbers are of the episodes \
                 that every listed partner has.",
                planned - finished
            );
        }
        if broken > 0 {
            let _ = writeln!(text, "Episode runs that broke down and count as zero: {broken}.");
        }
        if !self.has_environments {
            text += UNKNOWN_ENVIRONMENTS;
            text.push('\n');
        }
        if self.helpers.is_empty() {
            text += "No helper has an episode with the ordinary partner and another one, with and \
                     without help.\n";
        }
        text
    }

    fn tables(&self) -> Vec<TextTable> {
        if self.helpers.is_empty() {
            return Vec::new();
        }
        let helpers = self.helpers.iter().map(|helper| title(&helper.helper));
        let header: Vec<String> = std::iter::once("Partner".to_owned()).chain(helpers).collect();
        let gains = TextTable {
            title: "Gain of TR over no helper, by partner".to_owned(),
            header: header.clone(),
            rows: self.rows(&|row| estimate(Some(&row.gain))),
        };
        let shares = TextTable {
            title: "Share of the gain kept, by partner".to_owned(),
            header,
            rows: self.rows(&|row| estimate(row.share_kept.as_ref())),
        };
        vec![self.summary(), gains, shares]
    }

    fn summary(&self) -> TextTable {
        let header = [
            "Helper",
            "episodes",
            "ordinary partner",
            "other partners",
            "share kept",
            "worst partner",
            "worst tenth",
            "worst tenth,\nordinary partner",
        ];
        let row = |helper: &HelperRobustness| {
            let worst = helper.worst_partner().map_or_else(
                || UNDEFINED.to_owned(),
                |row| format!("{} {}", row.partner, rounded(row.gain.mean)),
            );
            vec![
                title(&helper.helper),
                helper.episodes.to_string(),
                estimate(Some(&helper.ordinary.gain)),
                estimate(Some(&helper.suite)),
                estimate(helper.share_kept.as_ref()),
                worst,
                estimate(Some(&helper.worst_decile)),
                estimate(Some(&helper.worst_decile_ordinary)),
            ]
        };
        TextTable {
            title: "Robustness: gain of TR over no helper".to_owned(),
            header: header.map(str::to_owned).to_vec(),
            rows: self.helpers.iter().map(row).collect(),
        }
    }

    /// Returns a row per partner with a cell per helper.
    fn rows(&self, cell: &dyn Fn(&PartnerGain) -> String) -> Vec<Vec<String>> {
        let mut names: Vec<&str> = Vec::new();
        for row in self.helpers.iter().flat_map(HelperRobustness::rows) {
            if !names.contains(&row.partner.as_str()) {
                names.push(&row.partner);
            }
        }
        let line = |name: &str| {
            let cells = self.helpers.iter().map(|helper| {
                let row = helper.rows().find(|row| row.partner == name);
                row.map_or_else(|| UNDEFINED.to_owned(), cell)
            });
            std::iter::once(name.to_owned()).chain(cells).collect()
        };
        names.into_iter().map(line).collect()
    }

    fn csv(&self) -> String {
        let mut text = "helper,partner,task,gain,low,high\n".to_owned();
        for helper in &self.helpers {
            for row in helper.rows() {
                let tasks = row.tasks.iter().map(|(task, estimate)| (task.name(), estimate));
                for (task, estimate) in std::iter::once(("all", &row.gain)).chain(tasks) {
                    let end = |end: Option<f64>| end.map_or(String::new(), |x| format!("{x:.6}"));
                    let _ = writeln!(
                        text,
                        "{},{},{task},{:.6},{},{}",
                        helper.helper,
                        row.partner,
                        estimate.mean,
                        end(estimate.interval.map(|i| i.low)),
                        end(estimate.interval.map(|i| i.high)),
                    );
                }
            }
        }
        text
    }
}

impl HelperRobustness {
    /// Returns the gains with the ordinary partner and with all others.
    fn rows(&self) -> impl Iterator<Item = &PartnerGain> {
        std::iter::once(&self.ordinary).chain(&self.partners)
    }
}

/// Formats an estimate with its interval, or as undefined.
fn estimate(estimate: Option<&Estimate>) -> String {
    match estimate {
        None => UNDEFINED.to_owned(),
        Some(Estimate { interval: Some(i), .. }) => interval(Some(i)),
        Some(estimate) => rounded(estimate.mean),
    }
}
