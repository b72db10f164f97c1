//! The whole report, as text and as files.

use std::fmt::Write as _;

use serde::Serialize;

use crate::CHAIC_VERSION;
use crate::error::Result;
use crate::files::read_bounded;
use crate::metrics::{Ending, FormulaSet, RunKey, RunResult, Scores, differences};
use crate::report::Format;
use crate::report::coverage::coverage;
use crate::report::figure::{figure_text, write_figure};
use crate::report::grid::Grid;
use crate::report::tables::{additional, counts, main_result, pairs};
use crate::run::{RunFolder, RunOptions};

/// All that a report is made from.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// What was played.
    pub options: &'a RunOptions,
    /// What came out.
    pub results: &'a [RunResult],
    /// All episode runs that the run consists of.
    pub planned: &'a [RunKey],
    /// By which formulas it is scored.
    pub formulas: FormulaSet,
}

impl Report<'_> {
    /// The scores.
    pub fn scores(&self) -> Scores {
        Scores::of(self.results, &self.formulas.formulas())
    }

    /// What has to be known of a run that isn't whole; nothing of one that is.
    pub fn notes(&self) -> Vec<String> {
        coverage(self.results, self.planned)
    }

    /// The report as text that ends with a line break.
    pub fn text(&self, format: Format) -> String {
        match format {
            Format::Table => self.terminal(),
            Format::Markdown => self.markdown(),
            Format::Csv => self.csv(),
            Format::Json => self.json(),
        }
    }

    fn json(&self) -> String {
        #[derive(Serialize)]
        struct File {
            /// Absent where the run's episodes are gone.
            #[serde(skip_serializing_if = "Option::is_none")]
            episode_runs: Option<EpisodeRuns>,
            #[serde(flatten)]
            scores: Scores,
        }
        #[derive(Serialize)]
        struct EpisodeRuns {
            planned: usize,
            scored: usize,
            broken: usize,
        }
        let scored = self.results.iter().filter(|r| r.summary().is_some()).count();
        let (planned, broken) = (self.planned.len(), self.results.len() - scored);
        let episode_runs = (planned > 0).then_some(EpisodeRuns { planned, scored, broken });
        let file = File { episode_runs, scores: self.scores() };
        serde_json::to_string_pretty(&file).expect("scores have string keys") + "\n"
    }

    fn grids(&self) -> Vec<Grid> {
        let scores = self.scores();
        let mut grids = main_result(&scores);
        grids.extend(additional(&scores));
        grids.extend(counts(self.results));
        grids
    }

    fn terminal(&self) -> String {
        let mut text: String = self.grids().iter().map(|g| g.to_terminal() + "\n").collect();
        text += &self.legend();
        text += &self.notes().iter().map(|n| format!("{n}\n")).collect::<String>();
        text += &self.errors();
        text
    }

    fn markdown(&self) -> String {
        let RunOptions { split, first, seeds, size, rules, set, partner, .. } = self.options;
        let episodes = first.map_or("all".to_owned(), |n| format!("first {n}"));
        let size = size.map_or("as each mind asks for".to_owned(), |px| format!("{px} pixels"));
        let played_by = match set[..] {
            [] => rules.to_string(),
            _ => format!("{rules} with {}", set.join(", ")),
        };
        let driven = partner.as_ref();
        let driven = driven.map_or(String::new(), |p| format!(" The partner is driven by `{p}`."));
        let mut text = format!(
            "# chaic run\n\nchaic {CHAIC_VERSION}, rules `{played_by}`, formulas `{}`. Split `{split}`, \
             {episodes} episodes of each task, seeds per episode: {seeds}. Images: {size}.{driven}\n\n",
            self.formulas,
        );
        for note in self.notes() {
            let _ = writeln!(text, "**{note}**\n");
        }
        for grid in self.grids() {
            text += &grid.to_markdown();
            text.push('\n');
        }
        let scores = self.scores();
        let differences = differences(self.results, &scores.helpers());
        if !differences.is_empty() {
            text += &pairs(&differences, &scores.tasks()).to_markdown();
            text.push('\n');
        }
        text += &self.legend();
        text += &self.errors();
        text
    }

    fn csv(&self) -> String {
        let scores = self.scores();
        let mut text = String::from("task,helper,tr,tr_se,ei,ia,cr,er,episodes\n");
        for task in scores.tasks() {
            for helper in scores.helpers() {
                let Some(s) = scores.get(task, &helper) else { continue };
                let cell = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.6}"));
                let cells = [Some(s.tr), s.tr_se, s.ei, s.ia, s.cr, s.er].map(cell).join(",");
                let _ = writeln!(text, "{task},{helper},{cells},{}", s.episodes);
            }
        }
        text
    }

    fn legend(&self) -> String {
        let spread = match self.formulas {
            FormulaSet::Paper => "SE standard error of TR over episodes",
            FormulaSet::Original => {
                "SE (original) standard deviation of TR over episodes and seeds"
            }
        };
        let n = self.results.iter().filter(|r| r.summary().is_some()).count();
        format!(
            "TR transport rate, EI efficiency improvement over no helper (w/o), IA goal inference \
             accuracy,\nER emergency rate, CR completion ratio of the helper, {spread}.\n\
             {n} episode runs.\n"
        )
    }

    fn errors(&self) -> String {
        let mut text = String::new();
        let mut results: Vec<&RunResult> = self.results.iter().collect();
        results.sort_by(|a, b| a.key.cmp(&b.key));
        for result in results {
            if let Ending::Error { message } = &result.ending {
                let k = &result.key;
                let _ = writeln!(
                    text,
                    "Not scored: {} with {} (seed {}): {message}",
                    k.episode, k.helper, k.seed
                );
            }
        }
        text
    }
}

impl Report<'_> {
    /// The files of it that are text, by name; without the figure if there are more helpers than
    /// one can show.
    fn texts(&self) -> Vec<(&'static str, String)> {
        let figure = figure_text(&self.scores()).ok().map(|figure| ("figure.svg", figure));
        let texts = [("scores.json", self.json()), ("report.md", self.markdown())];
        texts.into_iter().chain(figure).collect()
    }
}

/// Writes `scores.json`, `report.md`, `figure.svg` and `figure.png` into the run's folder.
///
/// # Errors
/// If the file system refuses.
pub fn write_files(folder: &RunFolder, report: &Report<'_>) -> Result<()> {
    for (name, text) in report.texts() {
        folder.write(name, text.as_bytes())?;
    }
    write_figure(&report.scores(), &folder.join("figure.png"))
}

/// The files of a run's report that are not as [`write_files`] writes them; `None` if there is no
/// report. Pictures are left out, as their bytes may depend on the machine.
///
/// # Errors
/// If a file can't be read.
pub fn differing_files(
    folder: &RunFolder,
    report: &Report<'_>,
) -> Result<Option<Vec<&'static str>>> {
    let mut found = report.texts();
    found.retain(|(name, _)| folder.join(name).exists());
    if found.is_empty() {
        return Ok(None);
    }
    let mut differing = Vec::new();
    for (name, text) in found {
        // One byte more tells a longer file from an equal one.
        let bytes = read_bounded(&folder.join(name), text.len() as u64 + 1)?;
        if bytes != text.as_bytes() {
            differing.push(name);
        }
    }
    Ok(Some(differing))
}
