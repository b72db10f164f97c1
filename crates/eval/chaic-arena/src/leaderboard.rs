//! Leaderboards: tables of confirmed scores with paired differences.

mod page;
mod row;

pub use row::{LeaderboardRow, RowDifference, TaskRates};

use std::collections::BTreeMap;
use std::path::Path;

use chaic_env::RunKey;
use chaic_env::helper_registry::{NONE, RULES};
use chaic_eval::metrics::{
    Environments, HelperResults, RunResult, holm, paired_difference, two_sided_p,
};
use serde::Serialize;

use crate::evaluation::EvaluationReport;
use crate::score::{EpisodeRunRecord, EvaluationConditions, SubmissionScore};
use row::csv_line;

/// Format of [`Leaderboard`].
const FORMAT: &str = "chaic-leaderboard";
/// Version of the format.
const VERSION: u32 = 1;
/// Helper with which others are compared, if it played.
const PREFERRED_REFERENCE: &str = "rhp";

/// All confirmed scores, in one table for each set of rules.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Leaderboard {
    format: &'static str,
    version: u32,
    /// Tables, sorted by their rules.
    pub tables: Vec<LeaderboardTable>,
    /// Submissions that are in no table.
    pub refused: Vec<RefusedEntry>,
}

/// Scores under the same rules, on the same episodes and with the same partners.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeaderboardTable {
    /// The rules.
    pub conditions: EvaluationConditions,
    /// Number of environments of the episodes.
    pub environments: usize,
    /// Helper that the rows are compared with.
    pub reference: String,
    /// Rows, from the highest transport rate to the lowest.
    pub rows: Vec<LeaderboardRow>,
}

/// A submission that is in no table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RefusedEntry {
    /// Name of its folder.
    pub folder: String,
    /// Reason of the refusal, in one line.
    pub reason: String,
}

/// A confirmed score with the results that comparisons need.
#[derive(Debug)]
struct ConfirmedEntry {
    folder: String,
    score: SubmissionScore,
    /// Results that the table compares: with all partners of the list, or with the ordinary partner.
    results: Vec<RunResult>,
    /// Results that are compared with `none`; `None` if they all are.
    compared: Option<Vec<RunResult>>,
    environments: Environments,
}

/// Collector of evaluations.
#[derive(Debug, Default)]
pub struct LeaderboardBuilder {
    tables: BTreeMap<EvaluationConditions, Vec<ConfirmedEntry>>,
    refused: Vec<RefusedEntry>,
}

impl LeaderboardBuilder {
    /// Refuses the evaluation in a folder. Paths in the reason become relative to the folder.
    pub fn refuse(&mut self, folder: &Path, reason: &str) {
        let reason = reason.replace(&format!("{}/", folder.display()), "");
        self.refused.push(RefusedEntry { folder: name(folder), reason });
    }

    /// Adds a verified evaluation. It is refused if verification found a problem, or if it is the
    /// same submission as an earlier one. It is also refused if its built-in helpers have other
    /// results than those of an earlier evaluation with the same rules.
    pub fn add(&mut self, folder: &Path, report: EvaluationReport) {
        if let Some(problem) = report.problems.first() {
            return self.refuse(folder, problem);
        }
        let EvaluationReport { score, run, .. } = report;
        let entry = ConfirmedEntry {
            folder: name(folder),
            score,
            results: run.ranked_results(),
            compared: run.compared_results(),
            environments: run.environments(),
        };
        self.add_entry(folder, entry);
    }

    fn add_entry(&mut self, folder: &Path, entry: ConfirmedEntry) {
        let earlier = self.tables.get(&entry.score.conditions).map_or(&[][..], Vec::as_slice);
        if let Some(reason) = earlier.iter().find_map(|earlier| conflict(earlier, &entry)) {
            return self.refuse(folder, &reason);
        }
        self.tables.entry(entry.score.conditions.clone()).or_default().push(entry);
    }

    /// Computes the tables.
    pub fn build(self) -> Leaderboard {
        let tables = self.tables.into_iter().map(|(rules, entries)| table(rules, &entries));
        Leaderboard {
            format: FORMAT,
            version: VERSION,
            tables: tables.collect(),
            refused: self.refused,
        }
    }
}

impl ConfirmedEntry {
    /// Returns the results of a helper that are compared with those of a reference.
    fn compared_with<'a>(&'a self, reference: &str, helper: &'a str) -> HelperResults<'a> {
        let compared = self.compared.as_ref().filter(|_| reference == NONE);
        HelperResults { results: compared.unwrap_or(&self.results), helper }
    }
}

impl Leaderboard {
    /// Returns the number of submissions in the tables.
    pub fn n_submissions(&self) -> usize {
        let rows = self.tables.iter().flat_map(|table| &table.rows);
        rows.filter(|row| row.sha256.is_some()).count()
    }

    /// Returns the tables as JSON.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain fields") + "\n"
    }

    /// Returns all rows as comma-separated values.
    pub fn to_csv(&self) -> String {
        let rows =
            self.tables.iter().enumerate().flat_map(|(k, table)| {
                table.rows.iter().map(move |row| csv_line(k + 1, table, row))
            });
        std::iter::once(row::CSV_HEADER.to_owned()).chain(rows).collect()
    }

    /// Returns the tables as an HTML page, which loads nothing and has no scripts.
    pub fn to_html(&self, title: &str) -> String {
        page::render(self, title)
    }
}

/// Returns the name of a folder.
fn name(folder: &Path) -> String {
    folder.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns the reason why two evaluations with the same rules cannot be in one table.
fn conflict(earlier: &ConfirmedEntry, entry: &ConfirmedEntry) -> Option<String> {
    let (a, b) = (&earlier.score.submission, &entry.score.submission);
    if a.sha256 == b.sha256 {
        return Some(format!("it is the submission of {}", earlier.folder));
    }
    let played: BTreeMap<(&str, &RunKey), &EpisodeRunRecord> =
        earlier.score.records().map(|(partner, run)| ((partner, &run.key), run)).collect();
    // Names of built-in helpers are taken, so a helper of one submission that also played in the other is
    // built in, unless both submissions have its name.
    let is_own = |run: &EpisodeRunRecord| a.name == b.name && run.key.helper == a.name;
    let (partner, differing) =
        entry.score.records().filter(|(_, run)| !is_own(run)).find(|(partner, run)| {
            played
                .get(&(*partner, &run.key))
                .is_some_and(|other| last_state(other) != last_state(run))
        })?;
    let RunKey { episode, helper, seed, .. } = &differing.key;
    let partner = if partner == RULES { String::new() } else { format!(", partner {partner}") };
    Some(format!(
        "{episode} with {helper}{partner} and seed {seed} ends otherwise than in {}; built-in helpers \
         always play the same",
        earlier.folder
    ))
}

/// Returns the digest of the last state; `None` for a failed run.
fn last_state(run: &EpisodeRunRecord) -> Option<chaic_env::Digest> {
    run.outcome.as_ref().map(|outcome| outcome.state)
}

fn table(conditions: EvaluationConditions, entries: &[ConfirmedEntry]) -> LeaderboardTable {
    // The same episodes have the same environments.
    let environments = &entries[0].environments;
    // Built-in helpers that played for comparison, each with the entry that has it.
    let mut references: BTreeMap<&str, &ConfirmedEntry> = BTreeMap::new();
    for entry in entries {
        let names = entry.score.grants.keys().filter(|name| **name != entry.score.submission.name);
        for name in names {
            references.entry(name).or_insert(entry);
        }
    }
    let has_preferred = references.contains_key(PREFERRED_REFERENCE);
    let reference = if has_preferred { PREFERRED_REFERENCE } else { NONE };
    let baseline = references.get(reference).map(|entry| entry.compared_with(reference, reference));
    let differences: Vec<Option<RowDifference>> = entries
        .iter()
        .map(|entry| {
            let helper = &entry.score.submission.name;
            let own = entry.compared_with(reference, helper);
            let all = paired_difference(own, baseline?, environments).all?;
            Some(RowDifference::new(&all, two_sided_p(&all)))
        })
        .collect();
    let differences = with_holm(differences);
    let mut rows: Vec<LeaderboardRow> = references
        .iter()
        .filter_map(|(name, entry)| LeaderboardRow::from_results(entry, name))
        .collect();
    let submissions = entries.iter().zip(differences);
    rows.extend(submissions.filter_map(|(entry, d)| LeaderboardRow::submission(entry, d)));
    rows.sort_by(|a, b| {
        let names = || (&a.name, &a.release, &a.sha256).cmp(&(&b.name, &b.release, &b.sha256));
        b.tr.total_cmp(&a.tr).then_with(names)
    });
    let n_environments = rows.iter().map(|row| row.environments).max().unwrap_or_default();
    LeaderboardTable {
        conditions,
        environments: n_environments,
        reference: reference.to_owned(),
        rows,
    }
}

/// Adjusts the p-values of the differences of one table.
fn with_holm(differences: Vec<Option<RowDifference>>) -> Vec<Option<RowDifference>> {
    let p_values: Vec<f64> = differences.iter().flatten().map(|difference| difference.p).collect();
    let mut adjusted = holm(&p_values).into_iter();
    let mut adjust = |difference: RowDifference| {
        let p_holm = adjusted.next().expect("one adjusted value for each given one");
        RowDifference { p_holm, ..difference }
    };
    differences.into_iter().map(|difference| difference.map(&mut adjust)).collect()
}

#[cfg(test)]
mod tests;
