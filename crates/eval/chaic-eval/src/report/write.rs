//! Complete reports, as text and as files.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use chaic_env::{CHAIC_VERSION, RunKey, Track};
use chaic_files::{EntryKind, kind, read_bounded};
use serde::Serialize;

use crate::error::Result;
use crate::metrics::{
    Difference, Environments, FormulaSet, MAX_LISTED_RUNS, PlayedEpisodes, Resolution, RunResult,
    RunStatus, Score, Scores, differences, resolution, run_differences,
};
use crate::report::Format;
use crate::report::coverage::coverage;
use crate::report::figure::{figure_text, fits_figure, write_figure};
use crate::report::labels::{Labels, RecordedGrants};
use crate::report::tables::{
    FAILED, MISSING, additional, counts, diagnostics, intervals, main_result, pairs, resolutions,
    run_pairs, stuck,
};
use crate::report::text_table::TextTable;
use crate::run::{EpisodeJob, RunFolder, RunGrants, RunOptions, environments};

/// File name of the figure as PNG.
const FIGURE_PNG: &str = "figure.png";

/// Note of a report without the environments of its episodes.
pub(crate) const UNKNOWN_ENVIRONMENTS: &str = "\
    Environments unknown, as the episodes are gone: each counts as independent, so standard errors \
    and intervals may be too small.";

/// Input of a report.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// Version of chaic that started the run.
    pub version: &'a str,
    /// Options of the run.
    pub options: &'a RunOptions,
    /// Results of the run.
    pub results: &'a [RunResult],
    /// All planned episode runs.
    pub planned: &'a [EpisodeJob],
    /// Recorded grants; `None` if the run has none.
    pub granted: Option<&'a RunGrants>,
    /// Formulas of the scores.
    pub formulas: FormulaSet,
}

/// Episode runs that were planned, in the form that metrics need.
pub(crate) struct Plan {
    keys: Vec<RunKey>,
    environments: Environments,
}

impl Report<'_> {
    /// Computes the scores.
    pub fn scores(&self) -> Scores {
        Scores::new(self.played_episodes(&self.plan()), &self.formulas.formulas())
    }

    /// Returns the paired differences of the transport rate between all helpers.
    pub fn differences(&self) -> Vec<Difference> {
        self.differences_of(&self.scores())
    }

    fn differences_of(&self, scores: &Scores) -> Vec<Difference> {
        differences(self.played_episodes(&self.plan()), &scores.helpers())
    }

    /// Returns the smallest difference that all tasks together distinguish from zero; `None` if no
    /// pair of helpers has an interval.
    pub fn resolution(&self) -> Option<Resolution> {
        resolution(&self.differences(), None)
    }

    /// Returns the labels of the rows.
    pub fn labels(&self) -> Labels<'_> {
        Labels { granted: self.granted }
    }

    /// Returns notes about missing or unequal episode runs; empty for a complete run.
    pub fn notes(&self) -> Vec<String> {
        let unknown = self.planned.is_empty().then(|| UNKNOWN_ENVIRONMENTS.to_owned());
        coverage(self.played_episodes(&self.plan())).into_iter().chain(unknown).collect()
    }

    /// Formats the report; the text ends with a line break.
    pub fn text(&self, format: Format) -> String {
        let scores = self.scores();
        match format {
            Format::Table => self.terminal(&scores),
            Format::Markdown => self.markdown(&scores),
            Format::Csv => self.csv(&scores),
            Format::Json => self.json(&scores),
        }
    }

    pub(crate) fn plan(&self) -> Plan {
        let keys = self.planned.iter().map(|job| job.key.clone()).collect();
        Plan { keys, environments: environments(self.planned) }
    }

    pub(crate) fn played_episodes<'a>(&'a self, plan: &'a Plan) -> PlayedEpisodes<'a> {
        let Plan { keys, environments } = plan;
        PlayedEpisodes { results: self.results, planned: keys, environments }
    }

    fn json(&self, scores: &Scores) -> String {
        #[derive(Serialize)]
        struct File<'a> {
            /// Absent if the run's episodes are missing.
            #[serde(skip_serializing_if = "Option::is_none")]
            episode_runs: Option<EpisodeRuns>,
            incomplete: bool,
            #[serde(skip_serializing_if = "Vec::is_empty")]
            missing: Vec<&'a RunKey>,
            #[serde(skip_serializing_if = "Option::is_none")]
            track: Option<Track>,
            #[serde(skip_serializing_if = "Option::is_none")]
            helpers: Option<BTreeMap<String, RecordedGrants>>,
            #[serde(skip_serializing_if = "Option::is_none")]
            partner: Option<RecordedGrants>,
            #[serde(flatten)]
            scores: &'a Scores,
        }
        #[derive(Serialize)]
        struct EpisodeRuns {
            planned: usize,
            scored: usize,
            broken: usize,
            missing: usize,
        }
        let plan = self.plan();
        let mut missing = self.played_episodes(&plan).missing();
        let episode_runs = (!self.planned.is_empty()).then_some(EpisodeRuns {
            planned: self.planned.len(),
            scored: self.results.len(),
            broken: self.results.iter().filter(|r| r.summary().is_none()).count(),
            missing: missing.len(),
        });
        let incomplete = !missing.is_empty();
        missing.truncate(MAX_LISTED_RUNS);
        let labels = self.labels();
        let helpers = labels.helper_grants(&self.options.helpers);
        let partner = labels.partner_grants();
        let track = Some(self.options.track).filter(|track| *track != Track::default());
        let file = File { episode_runs, incomplete, missing, track, helpers, partner, scores };
        serde_json::to_string_pretty(&file).expect("scores have string keys") + "\n"
    }

    fn tables(&self, scores: &Scores) -> Vec<TextTable> {
        let labels = self.labels();
        let mut tables = main_result(scores, labels);
        tables.extend(additional(scores, labels));
        tables.extend(stuck(scores, labels));
        tables.extend(counts(self.results, labels));
        tables
    }

    fn terminal(&self, scores: &Scores) -> String {
        let differences = self.differences_of(scores);
        let mut tables = self.tables(scores);
        tables.extend(resolutions(&differences, &scores.tasks()));
        let mut text: String = tables.iter().map(|t| t.to_terminal() + "\n").collect();
        text += &self.legend(scores);
        text += &self.notes().iter().map(|n| format!("{n}\n")).collect::<String>();
        text += &self.errors();
        text
    }

    /// Formats the table of TR differences to the results of another run, whose folder is
    /// `baseline`, for a terminal or as Markdown. Returns `None` if the runs have no helper with
    /// common episodes.
    pub fn differences_text(
        &self,
        baseline: &str,
        results: &[RunResult],
        format: Format,
    ) -> Option<String> {
        let differences = run_differences(self.played_episodes(&self.plan()), results);
        let table = run_pairs(&differences, &self.scores().tasks(), baseline);
        let text = match format {
            Format::Markdown => table.to_markdown(),
            _ => table.to_terminal(),
        };
        (!differences.is_empty()).then_some(text)
    }

    fn markdown(&self, scores: &Scores) -> String {
        let mut text = self.heading();
        let granted = self.labels().sentence(&scores.helpers());
        if let Some(granted) = &granted {
            let _ = writeln!(text, "**{granted}**\n");
        }
        for note in self.notes() {
            let _ = writeln!(text, "**{note}**\n");
        }
        let differences = self.differences_of(scores);
        let mut tables = self.tables(scores);
        tables.push(intervals(scores, self.labels()));
        if !differences.is_empty() {
            tables.push(pairs(&differences, &scores.tasks(), self.labels(), granted.as_deref()));
        }
        tables.extend(resolutions(&differences, &scores.tasks()));
        tables.extend(diagnostics(scores, self.labels()));
        for table in tables {
            text += &table.to_markdown();
            text.push('\n');
        }
        text += &self.legend(scores);
        text += &self.errors();
        text
    }

    /// Returns the heading, with the options of the run.
    fn heading(&self) -> String {
        let RunOptions { split, seeds, rules, rule_overrides, partner, person, track, .. } =
            self.options;
        let track =
            if *track == Track::default() { String::new() } else { format!(" Track: `{track}`.") };
        let episodes = match self.options.n_episodes {
            None => "all episodes".to_owned(),
            Some(1) => "first episode".to_owned(),
            Some(n) => format!("first {n} episodes"),
        };
        let size = self.options.image_size;
        let size = size.map_or("as each agent requests".to_owned(), |px| format!("{px} pixels"));
        let played_by = match rule_overrides[..] {
            [] => rules.to_string(),
            _ => format!("{rules} with {}", rule_overrides.join(", ")),
        };
        let mut version = self.version.to_owned();
        if version != CHAIC_VERSION {
            let _ = write!(version, " (report of chaic {CHAIC_VERSION})");
        }
        let driven = partner.as_ref();
        let driven = driven.map_or(String::new(), |p| format!(" The partner is driven by `{p}`."));
        let person = person.map_or(String::new(), |k| format!(" The partner is `{k}`."));
        format!(
            "# chaic run\n\nchaic {version}, rules `{played_by}`, formulas `{}`. Split `{split}`, \
             {episodes} of each task, seeds per episode: {seeds}. Images: {size}.{driven}{person}{track}\n\n",
            self.formulas,
        )
    }

    fn csv(&self, scores: &Scores) -> String {
        let granted = self.labels().helper_grants(&self.options.helpers).unwrap_or_default();
        let names = CSV_VALUES.map(|(name, _)| name).join(",");
        let mut text = format!(
            "task,helper,grants,perception,{names},episodes,environments,broken,incomplete\n"
        );
        for task in scores.tasks() {
            for helper in scores.helpers() {
                let Some(s) = scores.get(task, &helper) else { continue };
                let (grants, perception) = granted
                    .get(&helper)
                    .map_or((String::new(), ""), |g| (g.grants.join("+"), g.perception.as_str()));
                let values = CSV_VALUES.map(|(_, value)| csv_cell(value(s))).join(",");
                let Score { episodes, environments, failed, incomplete, .. } = s;
                let _ = writeln!(
                    text,
                    "{task},{helper},{grants},{},{values},{episodes},{environments},{failed},\
                     {incomplete}",
                    csv_text(perception)
                );
            }
        }
        text
    }

    fn legend(&self, scores: &Scores) -> String {
        let spread = match self.formulas {
            FormulaSet::Paper => "SE standard error of TR over environments",
            FormulaSet::Original => {
                "SE (original) standard deviation of TR over episodes and seeds"
            }
        };
        let mut text = format!(
            "TR transport rate, EI efficiency improvement over no helper (w/o), IA goal inference \
             accuracy,\nER emergency rate, CR completion ratio of the helper, {spread}.\n"
        );
        let rows = || scores.tasks.values().flat_map(|row| row.values());
        if rows().any(|s| s.failed > 0) {
            let _ = writeln!(text, "{FAILED} Episode runs broke down; they count as zero.");
        }
        if !self.played_episodes(&self.plan()).missing().is_empty() {
            let _ = writeln!(text, "{MISSING} Incomplete: episode runs are missing.");
        }
        if self.options.track != Track::default() {
            let _ = writeln!(
                text,
                "Track {}, which bounds the grants of all helpers.",
                self.options.track
            );
        }
        let n = self.results.len();
        let _ = writeln!(text, "{n} episode run{}.", if n == 1 { "" } else { "s" });
        text
    }

    fn errors(&self) -> String {
        let mut text = String::new();
        let mut results: Vec<&RunResult> = self.results.iter().collect();
        results.sort_by(|a, b| a.key.cmp(&b.key));
        for result in results {
            if let RunStatus::Error { message } = &result.status {
                let k = &result.key;
                let _ = writeln!(
                    text,
                    "Broke down, counts as zero: {} with {} (seed {}): {message}",
                    k.episode, k.helper, k.seed
                );
            }
        }
        text
    }
}

/// Name of a numeric column of the CSV, and its value.
type CsvColumn = (&'static str, fn(&Score) -> Option<f64>);

/// Numeric columns of the CSV.
const CSV_VALUES: [CsvColumn; 11] = [
    ("tr", |s| Some(s.tr)),
    ("tr_se", |s| s.tr_se),
    ("tr_low", |s| s.tr_ci.map(|[low, _]| low)),
    ("tr_high", |s| s.tr_ci.map(|[_, high]| high)),
    ("ei", |s| s.ei),
    ("ei_low", |s| s.ei_ci.map(|[low, _]| low)),
    ("ei_high", |s| s.ei_ci.map(|[_, high]| high)),
    ("ia", |s| s.ia),
    ("cr", |s| s.cr),
    ("er", |s| s.er),
    ("stuck", |s| s.stuck),
];

fn csv_cell(value: Option<f64>) -> String {
    value.map_or(String::new(), |v| format!("{v:.6}"))
}

/// Returns a text as a cell of comma-separated values (RFC 4180).
pub fn csv_text(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        return format!("\"{}\"", text.replace('"', "\"\""));
    }
    text.to_owned()
}

impl Report<'_> {
    /// Returns the text files of the report by name. Leaves out the figure if it can't show that
    /// many helpers.
    fn texts(&self, scores: &Scores) -> Result<Vec<(&'static str, String)>> {
        let mut texts =
            vec![("scores.json", self.json(scores)), ("report.md", self.markdown(scores))];
        if fits_figure(scores) {
            texts.push(("figure.svg", figure_text(scores, self.labels())?));
        }
        Ok(texts)
    }
}

/// Writes `scores.json`, `report.md`, `figure.svg` and `figure.png` into the run's folder. Leaves out
/// both figures if they can't show that many helpers.
///
/// # Errors
/// If a file can't be written.
pub fn write_files(folder: &RunFolder, report: &Report<'_>) -> Result<()> {
    let scores = report.scores();
    for (name, text) in report.texts(&scores)? {
        folder.write(name, text.as_bytes())?;
    }
    if fits_figure(&scores) {
        write_figure(&scores, report.labels(), &folder.join(FIGURE_PNG))?;
    }
    Ok(())
}

/// Compares the files of a report with the output of [`write_files`]. Returns the names of missing
/// files and of differing files.
///
/// Checks only the file type of the PNG, because its bytes may depend on the machine.
///
/// # Errors
/// If a file can't be read.
pub fn differing_files(
    folder: &RunFolder,
    report: &Report<'_>,
) -> Result<(Vec<&'static str>, Vec<&'static str>)> {
    let (mut missing, mut altered) = (Vec::new(), Vec::new());
    for (name, text) in report.texts(&report.scores())? {
        let path = folder.join(name);
        match kind(&path)? {
            EntryKind::Missing => missing.push(name),
            // One byte more distinguishes a longer file from an equal one.
            EntryKind::File if read_bounded(&path, text.len() as u64 + 1)? == text.as_bytes() => {}
            _ => altered.push(name),
        }
    }
    let figure = kind(&folder.join(FIGURE_PNG))?;
    if ![EntryKind::Missing, EntryKind::File].contains(&figure) {
        altered.push(FIGURE_PNG);
    }
    Ok((missing, altered))
}
