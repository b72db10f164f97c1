//! Markdown document with method, results and the handwritten causes.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use chaic_core::TaskId;
use chaic_env::CHAIC_VERSION;
use chaic_files::{create_folders, read_user_file, write_atomically};

use crate::experiment::Experiment;
use crate::experiment_folder::PartState;
use crate::sections::{RuleSection, formulas};
use crate::switches;
use chaic_eval::figure::{BarChart, BarValue, FigureError, HelperBars, transport_rate};
use chaic_eval::metrics::{PlayedEpisodes, RunStatus, Scores};
use chaic_eval::published::published;
use chaic_eval::report::{coverage, drawn_interval};
use chaic_eval::{EvalError, Result};

/// Largest document that is read, bytes: a hundred times the typical size.
const MAX_DOCUMENT_BYTES: u64 = 16 << 20;

/// Mark before the handwritten section.
pub const CAUSES_BEGIN: &str =
    "<!-- causes: written by hand, kept when the document is made again -->";
/// Mark after the handwritten section.
pub const CAUSES_END: &str = "<!-- end of causes -->";

/// Inputs of a document.
#[derive(Clone, Copy, Debug)]
pub struct ReportInputs<'a> {
    /// Experiment that was planned.
    pub plan: &'a Experiment,
    /// Results so far.
    pub parts: &'a [PartState],
}

/// Writes the document to `path`, and its figures to `images/` beside it. The text between
/// [`CAUSES_BEGIN`] and [`CAUSES_END`] of an existing document is kept.
///
/// # Errors
/// If another file exists at the path, there are no results, or a file cannot be written.
pub fn write_document(inputs: ReportInputs<'_>, path: &Path) -> Result<()> {
    let causes = read_causes(path)?;
    let stem = path.file_stem().map_or("fidelity".into(), |s| s.to_string_lossy());
    let folder = path.parent().map_or(PathBuf::new(), Path::to_owned).join("images");
    create_folders(&folder)?;
    for part in inputs.rule_sets() {
        let bars = inputs.bars(part);
        let file = folder.join(figure_name(&stem, part));
        transport_rate(&bars, &file).map_err(|e| match e {
            FigureError::Write(error) => error.into(),
            other => EvalError::Image(other.to_string()),
        })?;
    }
    let text = document(inputs, &stem, &causes)?;
    Ok(write_atomically(path, text.as_bytes())?)
}

/// Checks whether a document can be written to `path`, before hours of computation.
///
/// # Errors
/// If another file exists at the path, or it cannot be read.
pub fn check_document(path: &Path) -> Result<()> {
    read_causes(path).map(|_| ())
}

/// Returns the text of the document. `stem` is the prefix of figure names, `causes` the handwritten
/// section.
///
/// # Errors
/// If neither rule set has results.
pub fn document(inputs: ReportInputs<'_>, stem: &str, causes: &str) -> Result<String> {
    let plan = inputs.plan;
    let shown: Vec<&PartState> = inputs.rule_sets().collect();
    if shown.is_empty() {
        let text = "no episode run has finished yet, so there are no results to report";
        return Err(EvalError::Options(text.to_owned()));
    }
    let mut text = String::from("# Comparison with the published results\n\n");
    text += &inputs.state();
    text += &inputs.method();
    for part in shown {
        let (rules, played, labels) = (part.part.rules, part.played(), part.labels());
        let (tasks, helpers) = (plan.tasks.as_slice(), plan.helpers.as_slice());
        let section = RuleSection { rules, played, labels, tasks, helpers };
        text += &section.markdown(&format!("images/{}", figure_name(stem, part)));
    }
    if let Some(base) = inputs.base() {
        let started: Vec<&PartState> =
            inputs.switches().filter(|s| !s.results.is_empty()).collect();
        text += &switches::section(base, &started, &plan.tasks)?;
    }
    let _ = write!(text, "## Causes\n\n{CAUSES_BEGIN}\n{causes}{CAUSES_END}\n");
    Ok(text)
}

fn figure_name(stem: &str, part: &PartState) -> String {
    format!("{stem}-{}.svg", part.part.name)
}

/// Returns the handwritten section of a document; a line break if the document does not exist.
fn read_causes(path: &Path) -> Result<String> {
    if !path.exists() {
        return Ok("\n".to_owned());
    }
    let bytes = read_user_file(path, MAX_DOCUMENT_BYTES)?;
    let text = String::from_utf8_lossy(&bytes);
    let after = text.split_once(CAUSES_BEGIN).map(|(_, after)| after);
    let between = after.and_then(|a| a.split_once(CAUSES_END)).map(|(between, _)| between);
    between.map(|b| b.strip_prefix('\n').unwrap_or(b).to_owned()).ok_or_else(|| {
        EvalError::Options(format!(
            "{} exists and is not a document of this kind: it lacks the lines `{CAUSES_BEGIN}` and \
             `{CAUSES_END}`; choose another file",
            path.display()
        ))
    })
}

impl<'a> ReportInputs<'a> {
    /// Returns the runs of whole rule sets that have results.
    fn rule_sets(self) -> impl Iterator<Item = &'a PartState> {
        let has_results = |p: &&PartState| p.results.iter().any(|r| r.summary().is_some());
        self.parts.iter().filter(|p| p.part.switch.is_none()).filter(has_results)
    }

    /// Returns the run that switches are compared with.
    fn base(self) -> Option<&'a PartState> {
        self.rule_sets().find(|p| p.part.rules == chaic_env::rules::RuleSetName::Compat)
    }

    fn switches(self) -> impl Iterator<Item = &'a PartState> {
        self.parts.iter().filter(|p| p.part.switch.is_some())
    }

    /// Returns notes on missing and failed runs; empty if all runs are complete.
    fn state(self) -> String {
        let planned: usize = self.parts.iter().map(|p| p.planned.len()).sum();
        let missing: usize = self.parts.iter().map(|p| p.missing().len()).sum();
        let mut text = String::new();
        if missing > 0 {
            let _ = writeln!(
                text,
                "**This document is unfinished: {missing} of {planned} episode runs are missing.** \
                 Its tables cover the finished runs only.\n"
            );
            for part in self.parts.iter().filter(|p| !p.missing().is_empty()) {
                let (name, n) = (&part.part.name, part.missing().len());
                let _ = writeln!(text, "- `{name}`: {n} of {} are missing", part.planned.len());
            }
            text.push('\n');
        }
        for part in self.parts {
            // Missing runs are listed above.
            for note in coverage(PlayedEpisodes { planned: &[], ..part.played() }) {
                let _ = writeln!(text, "**{}: {note}**\n", part.part.name);
            }
        }
        let n_failed: usize = self.parts.iter().map(PartState::n_failed).sum();
        if n_failed > 0 {
            let (runs, count) = if n_failed == 1 { ("run", "counts") } else { ("runs", "count") };
            let _ = writeln!(text, "**{n_failed} episode {runs} failed and {count} as zero:**\n");
            for (part, result) in
                self.parts.iter().flat_map(|p| p.results.iter().map(move |r| (p, r)))
            {
                if let RunStatus::Error { message } = &result.status {
                    let (name, k) = (&part.part.name, &result.key);
                    let _ = writeln!(
                        text,
                        "- `{name}`: {} with {}, seed {}: {message}",
                        k.episode, k.helper, k.seed
                    );
                }
            }
            text.push('\n');
        }
        text
    }

    fn method(self) -> String {
        let plan = self.plan;
        let keys = || self.parts.iter().flat_map(|p| &p.planned);
        let episodes: BTreeSet<(TaskId, &str)> =
            keys().map(|k| (k.task, k.episode.as_str())).collect();
        let played: usize = self.parts.iter().map(|p| p.results.len()).sum();
        let (n, tasks, seeds) = (episodes.len(), plan.tasks.len(), plan.seeds);
        let mut text = format!(
            "Made by chaic {CHAIC_VERSION} with\n\n```sh\n{}\n```\n\nThe command also writes this file \
             (`--doc FILE`). Only the last section is written by hand. Episodes: {n}, tasks: \
             {tasks}, seeds per episode: {seeds}, episode runs: {played}. The published figures are \
             those of the paper's tables of quantitative and additional results \
             (`chaic_eval::published`).\n\n",
            plan.command()
        );
        // Episode ids have the form TASK/KIND/NUMBER.
        let kinds: BTreeSet<&str> =
            episodes.iter().map(|(_, id)| id.split('/').nth(1).unwrap_or(id)).collect();
        text += &match kinds.into_iter().collect::<Vec<_>>()[..] {
            ["original-train"] => "EPISODES are the original's training episodes as produced by \
                `chaic import original --split train` ([import.md](../import.md)). **The published \
                figures are over the original's test split, these over its training split**, which \
                has other floor plans and goals from the same generator. Even the original would \
                not reproduce the figures exactly; the difference that chance explains is computed \
                below."
                .to_owned(),
            ref other => format!(
                "EPISODES are of the kind {}. **The published figures are over the original's test \
                 split, these are not**, so the comparison is only qualitative.",
                other.join(", ")
            ),
        };
        text += "\n\n";
        let granted = self.parts.first().and_then(|p| p.labels().sentence(&plan.helpers));
        text += &granted.map_or(String::new(), |granted| format!("**{granted}**\n\n"));
        if plan.tasks.len() < TaskId::paper().count() {
            let names: Vec<&str> = plan.tasks.iter().map(|t| t.info().title).collect();
            let _ = writeln!(text, "Only these of the eight tasks: {}.\n", names.join(", "));
        }
        text
    }

    fn bars(self, part: &PartState) -> BarChart {
        let scores = Scores::new(part.played(), &formulas(part.part.rules));
        let tasks = &self.plan.tasks;
        let bars = |helper: &String| {
            let bar = |task: &TaskId| {
                let score = scores.get(*task, helper)?;
                let dot = published(helper).and_then(|row| Some(row.scores(*task)?.tr));
                Some(BarValue { mean: score.tr, interval: drawn_interval(score), dot })
            };
            let helper_title = part.labels().title(helper);
            HelperBars { helper: helper_title, values: tasks.iter().map(bar).collect() }
        };
        BarChart {
            tasks: tasks.iter().map(|t| t.info().title.to_owned()).collect(),
            helpers: self.plan.helpers.iter().map(bars).collect(),
            dots: Some("published".to_owned()),
        }
    }
}
