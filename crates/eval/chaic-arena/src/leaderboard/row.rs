//! Rows of a leaderboard.

use std::collections::BTreeMap;

use chaic_core::TaskId;
use chaic_eval::metrics::{
    Estimate, HelperResults, HelperRobustness, Interval, MeanRate, Score, mean_rate,
};
use chaic_eval::report::{RecordedGrants, csv_text, title};
use serde::Serialize;

use super::{ConfirmedEntry, LeaderboardTable};

/// Score of a helper in a leaderboard. In a table with a list of partners, rates, EI, failed runs and the
/// difference are over the partners of the list, without the ordinary one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeaderboardRow {
    /// Name of the helper.
    pub name: String,
    /// Title of the helper.
    pub title: String,
    /// Version of the helper; empty for a built-in helper that played for comparison.
    pub release: String,
    /// Authors, in order.
    pub authors: Vec<String>,
    /// License as an SPDX expression.
    pub license: String,
    /// Hardware of training and public run.
    pub hardware: String,
    /// Core hours of training.
    pub core_hours: Option<f64>,
    /// SHA-256 of the packed submission; absent for a built-in helper that played for comparison.
    pub sha256: Option<String>,
    /// Grants, perception and isolation.
    pub granted: Option<RecordedGrants>,
    /// Mean transport rate over the episodes of all tasks, 0 to 1.
    pub tr: f64,
    /// Its 95 % interval over environments.
    pub tr_ci: Option<[f64; 2]>,
    /// Efficiency improvement over no helper: mean over tasks, -1 to 1.
    pub ei: Option<f64>,
    /// Rates by task.
    pub tasks: BTreeMap<TaskId, TaskRates>,
    /// Number of environments.
    pub environments: usize,
    /// Number of failed episode runs, which count as zero.
    pub failed: usize,
    /// Difference of the transport rate to the reference of the table, paired by episode.
    pub difference: Option<RowDifference>,
    /// Gains with the ordinary partner and with those of the list; absent for `none` and without a list.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robustness: Option<HelperRobustness>,
}

/// Rates of a helper in a task.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskRates {
    /// Transport rate, 0 to 1.
    pub tr: f64,
    /// Its 95 % interval over environments.
    pub tr_ci: Option<[f64; 2]>,
    /// Efficiency improvement, -1 to 1.
    pub ei: Option<f64>,
}

/// Difference of transport rates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RowDifference {
    /// Mean difference.
    pub mean: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end of the 95 % interval.
    pub high: f64,
    /// Two-sided p-value of no difference.
    pub p: f64,
    /// P-value adjusted by the method of Holm for all submissions of the table.
    pub p_holm: f64,
}

impl RowDifference {
    /// Creates a difference whose p-value is not adjusted yet.
    pub(super) fn new(interval: &Interval, p: f64) -> RowDifference {
        let Interval { mean, low, high, .. } = *interval;
        RowDifference { mean, low, high, p, p_holm: p }
    }
}

impl LeaderboardRow {
    /// Returns the row of a submission; `None` without results.
    pub(super) fn submission(
        entry: &ConfirmedEntry,
        difference: Option<RowDifference>,
    ) -> Option<LeaderboardRow> {
        let submission = &entry.score.submission;
        let row = LeaderboardRow::from_results(entry, &submission.name)?;
        Some(LeaderboardRow {
            release: submission.release.clone(),
            authors: submission.authors.clone(),
            license: submission.license.clone(),
            hardware: submission.hardware.clone(),
            core_hours: Some(submission.core_hours),
            sha256: Some(submission.sha256.clone()),
            difference,
            ..row
        })
    }

    /// Returns the row of a helper with its scores alone; `None` without results.
    pub(super) fn from_results(entry: &ConfirmedEntry, helper: &str) -> Option<LeaderboardRow> {
        let results = HelperResults { results: &entry.results, helper };
        let MeanRate { mean: tr, interval, environments } =
            mean_rate(results, &entry.environments)?;
        let scores = entry.score.ranked_tasks().iter();
        let scores: Vec<(TaskId, &Score)> =
            scores.filter_map(|(task, row)| Some((*task, row.get(helper)?))).collect();
        let improvements: Vec<f64> = scores.iter().filter_map(|(_, score)| score.ei).collect();
        let n = improvements.len() as f64;
        let mut robustness = entry.score.partners.iter().flat_map(|partners| &partners.robustness);
        Some(LeaderboardRow {
            name: helper.to_owned(),
            title: title(helper),
            release: String::new(),
            authors: Vec::new(),
            license: String::new(),
            hardware: String::new(),
            core_hours: None,
            sha256: None,
            granted: entry.score.grants.get(helper).cloned(),
            tr,
            tr_ci: interval.map(|interval| interval.clamped(0.0, 1.0)),
            ei: (n > 0.0).then(|| improvements.iter().sum::<f64>() / n),
            environments,
            failed: scores.iter().map(|(_, score)| score.failed).sum(),
            tasks: scores
                .into_iter()
                .map(|(task, score)| {
                    (task, TaskRates { tr: score.tr, tr_ci: score.tr_ci, ei: score.ei })
                })
                .collect(),
            difference: None,
            robustness: robustness.find(|row| row.helper == helper).cloned(),
        })
    }
}

/// First line of the comma-separated values.
pub(super) const CSV_HEADER: &str = "table,chaic,split,track,rules,partner,helper,release,sha256,license,\
    core_hours,grants,perception,tr,tr_low,tr_high,ei,failed,reference,difference,difference_low,\
    difference_high,p,p_holm,partners,partners_sha256,ordinary_gain,gain,gain_low,gain_high,share_kept,\
    share_kept_low,share_kept_high,worst_partner,worst_partner_gain,worst_tenth,worst_tenth_ordinary\n";

/// Returns the line of a row in the comma-separated values. `number` is the number of its table.
pub(super) fn csv_line(number: usize, table: &LeaderboardTable, row: &LeaderboardRow) -> String {
    let rules = &table.conditions;
    let decimals = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.6}"));
    let granted = row.granted.as_ref();
    let difference =
        |value: fn(&RowDifference) -> f64| decimals(row.difference.as_ref().map(value));
    let robustness = row.robustness.as_ref();
    let estimate = |value: fn(&HelperRobustness) -> Option<&Estimate>| robustness.and_then(value);
    let mean = |value: Option<&Estimate>| decimals(value.map(|estimate| estimate.mean));
    let end = |value: Option<&Estimate>, end: fn(&Interval) -> f64| {
        decimals(value.and_then(|estimate| estimate.interval.as_ref()).map(end))
    };
    let gain = estimate(|row| Some(&row.suite));
    let share_kept = estimate(|row| row.share_kept.as_ref());
    let worst = robustness.and_then(HelperRobustness::worst_partner);
    let cells = [
        number.to_string(),
        rules.chaic.clone(),
        rules.split.clone(),
        rules.track.clone(),
        rules.rules.clone(),
        rules.ranked_partners(),
        row.name.clone(),
        row.release.clone(),
        row.sha256.clone().unwrap_or_default(),
        row.license.clone(),
        row.core_hours.map_or(String::new(), |hours| hours.to_string()),
        granted.map_or(String::new(), |granted| granted.grants.join("+")),
        granted.map_or(String::new(), |granted| granted.perception.clone()),
        decimals(Some(row.tr)),
        decimals(row.tr_ci.map(|[low, _]| low)),
        decimals(row.tr_ci.map(|[_, high]| high)),
        decimals(row.ei),
        row.failed.to_string(),
        table.reference.clone(),
        difference(|d| d.mean),
        difference(|d| d.low),
        difference(|d| d.high),
        difference(|d| d.p),
        difference(|d| d.p_holm),
        rules.partners.as_ref().map_or(String::new(), |partners| partners.n.to_string()),
        rules.partners.as_ref().map_or(String::new(), |partners| partners.sha256.clone()),
        mean(estimate(|row| Some(&row.ordinary.gain))),
        mean(gain),
        end(gain, |interval| interval.low),
        end(gain, |interval| interval.high),
        mean(share_kept),
        end(share_kept, |interval| interval.low),
        end(share_kept, |interval| interval.high),
        worst.map_or(String::new(), |worst| worst.partner.clone()),
        decimals(worst.map(|worst| worst.gain.mean)),
        mean(estimate(|row| Some(&row.worst_decile))),
        mean(estimate(|row| Some(&row.worst_decile_ordinary))),
    ];
    cells.map(|cell| csv_text(&cell)).join(",") + "\n"
}
