//! The document as a whole: what was done, what came out, and what is written by hand.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use chaic_core::TaskId;
use chaic_env::CHAIC_VERSION;
use chaic_files::{read_user_file, write_whole};

use crate::experiment::Experiment;
use crate::matrix::PartState;
use crate::sections::{RuleSection, formulas};
use crate::switches;
use chaic_eval::figure::{Bar, Bars, FigureError, HelperBars, transport_rate};
use chaic_eval::metrics::{Ending, Played, Scores};
use chaic_eval::published::published;
use chaic_eval::report::{coverage, shown_interval};
use chaic_eval::{EvalError, Result};

/// Longest document that is read, bytes: a hundred times a usual one.
const MAX_DOCUMENT_BYTES: u64 = 16 << 20;

/// Before what is written by hand.
pub const CAUSES_BEGIN: &str =
    "<!-- causes: written by hand, kept when the document is made again -->";
/// After it.
pub const CAUSES_END: &str = "<!-- end of causes -->";

/// All that a document is made from.
#[derive(Clone, Copy, Debug)]
pub struct Sheet<'a> {
    /// What is played.
    pub plan: &'a Experiment,
    /// What came out so far.
    pub parts: &'a [PartState],
}

/// Writes the document to `path`, and its figures to `images/` beside it. What stands between
/// [`CAUSES_BEGIN`] and [`CAUSES_END`] of a document that is there is kept.
///
/// # Errors
/// If something else is there, there is nothing to write, or the file system refuses.
pub fn write_document(sheet: Sheet<'_>, path: &Path) -> Result<()> {
    let causes = causes_of(path)?;
    let stem = path.file_stem().map_or("fidelity".into(), |s| s.to_string_lossy());
    let folder = path.parent().map_or(PathBuf::new(), Path::to_owned).join("images");
    fs::create_dir_all(&folder).map_err(EvalError::io("make the folder", &folder))?;
    for part in sheet.rule_sets() {
        let bars = sheet.bars(part);
        let file = folder.join(figure_name(&stem, part));
        transport_rate(&bars, &file).map_err(|e| match e {
            FigureError::Write(refusal) => refusal.into(),
            other => EvalError::Picture(other.to_string()),
        })?;
    }
    let text = document(sheet, &stem, &causes)?;
    Ok(write_whole(path, text.as_bytes())?)
}

/// Whether a document could be written to `path`, for whoever would play for hours before.
///
/// # Errors
/// If something else is there, or it can't be read.
pub fn check_document(path: &Path) -> Result<()> {
    causes_of(path).map(|_| ())
}

/// The text of the document; `stem` names its figures, `causes` is what was written by hand.
///
/// # Errors
/// If neither rule set has any result yet.
pub fn document(sheet: Sheet<'_>, stem: &str, causes: &str) -> Result<String> {
    let plan = sheet.plan;
    let shown: Vec<&PartState> = sheet.rule_sets().collect();
    if shown.is_empty() {
        let text = "no episode run has finished yet, so there is nothing to write about";
        return Err(EvalError::Options(text.to_owned()));
    }
    let mut text = String::from("# How near chaic comes to the published results\n\n");
    text += &sheet.state();
    text += &sheet.method();
    for part in shown {
        let (rules, played, labels) = (part.part.rules, part.played(), part.labels());
        let (tasks, helpers) = (plan.tasks.as_slice(), plan.helpers.as_slice());
        let section = RuleSection { rules, played, labels, tasks, helpers };
        text += &section.markdown(&format!("images/{}", figure_name(stem, part)));
    }
    if let Some(base) = sheet.base() {
        let begun: Vec<&PartState> = sheet.switches().filter(|s| !s.results.is_empty()).collect();
        text += &switches::section(base, &begun, &plan.tasks)?;
    }
    let _ = write!(text, "## Causes\n\n{CAUSES_BEGIN}\n{causes}{CAUSES_END}\n");
    Ok(text)
}

fn figure_name(stem: &str, part: &PartState) -> String {
    format!("{stem}-{}.svg", part.part.name)
}

/// What a document has between its marks; a line break where there is no document yet.
fn causes_of(path: &Path) -> Result<String> {
    if !path.exists() {
        return Ok("\n".to_owned());
    }
    let bytes = read_user_file(path, MAX_DOCUMENT_BYTES)?;
    let text = String::from_utf8_lossy(&bytes);
    let after = text.split_once(CAUSES_BEGIN).map(|(_, after)| after);
    let between = after.and_then(|a| a.split_once(CAUSES_END)).map(|(between, _)| between);
    between.map(|b| b.strip_prefix('\n').unwrap_or(b).to_owned()).ok_or_else(|| {
        EvalError::Options(format!(
            "{} exists and is no document of this kind: it lacks the lines `{CAUSES_BEGIN}` and \
             `{CAUSES_END}`; choose another file",
            path.display()
        ))
    })
}

impl<'a> Sheet<'a> {
    /// The runs of whole rule sets that have results.
    fn rule_sets(self) -> impl Iterator<Item = &'a PartState> {
        let has_results = |p: &&PartState| p.results.iter().any(|r| r.summary().is_some());
        self.parts.iter().filter(|p| p.part.switch.is_none()).filter(has_results)
    }

    /// The run that switches are compared with.
    fn base(self) -> Option<&'a PartState> {
        self.rule_sets().find(|p| p.part.rules == chaic_env::rules::RuleSetName::Compat)
    }

    fn switches(self) -> impl Iterator<Item = &'a PartState> {
        self.parts.iter().filter(|p| p.part.switch.is_some())
    }

    /// What isn't there; nothing if all is.
    fn state(self) -> String {
        let planned: usize = self.parts.iter().map(|p| p.planned.len()).sum();
        let missing: usize = self.parts.iter().map(|p| p.missing().len()).sum();
        let mut text = String::new();
        if missing > 0 {
            let _ = writeln!(
                text,
                "**This document is unfinished: {missing} of {planned} episode runs are missing.** \
                 Its tables are over what is there.\n"
            );
            for part in self.parts.iter().filter(|p| !p.missing().is_empty()) {
                let (name, n) = (&part.part.name, part.missing().len());
                let _ = writeln!(text, "- `{name}`: {n} of {} are missing", part.planned.len());
            }
            text.push('\n');
        }
        for part in self.parts {
            // What is missing altogether has just been said.
            for note in coverage(Played { planned: &[], ..part.played() }) {
                let _ = writeln!(text, "**{}: {note}**\n", part.part.name);
            }
        }
        let broken: usize = self.parts.iter().map(PartState::n_broken).sum();
        if broken > 0 {
            let _ = writeln!(text, "**{broken} episode runs broke down and count as zero:**\n");
            for (part, result) in
                self.parts.iter().flat_map(|p| p.results.iter().map(move |r| (p, r)))
            {
                if let Ending::Error { message } = &result.ending {
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
            "Made by chaic {CHAIC_VERSION} with\n\n```sh\n{}\n```\n\nwhich also writes this file \
             (`--doc FILE`); nothing but the last section is written by hand. Episodes: {n}, tasks: {tasks}, seeds of each \
             episode: {seeds}, episode runs in all: {played}. The published figures are those \
             of the paper's tables of quantitative and additional results \
             (`chaic_eval::published`).\n\n",
            plan.command()
        );
        // TASK/KIND/NUMBER
        let kinds: BTreeSet<&str> =
            episodes.iter().map(|(_, id)| id.split('/').nth(1).unwrap_or(id)).collect();
        text += &match kinds.into_iter().collect::<Vec<_>>()[..] {
            ["original-train"] => "EPISODES are the original's training episodes as `chaic import \
                original --split train` makes them ([import.md](import.md)). **The published figures \
                are over the original's test split, these over its training split**: other floor \
                plans and other goals by the same generator. Equal figures are not to be expected \
                even of the original itself; how far apart two such sets of episodes may lie by \
                chance is computed below."
                .to_owned(),
            ref other => format!(
                "EPISODES are of the kind {}. **The published figures are over the original's test \
                 split, these are not**, so they are comparable in kind only.",
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

    fn bars(self, part: &PartState) -> Bars {
        let scores = Scores::of(part.played(), &formulas(part.part.rules));
        let tasks = &self.plan.tasks;
        let bars = |helper: &String| {
            let bar = |task: &TaskId| {
                let score = scores.get(*task, helper)?;
                let dot = published(helper).and_then(|row| Some(row.figures(*task)?.tr));
                Some(Bar { mean: score.tr, interval: shown_interval(score), dot })
            };
            let helper_title = part.labels().title(helper);
            HelperBars { helper: helper_title, values: tasks.iter().map(bar).collect() }
        };
        Bars {
            tasks: tasks.iter().map(|t| t.info().title.to_owned()).collect(),
            helpers: self.plan.helpers.iter().map(bars).collect(),
            dots: Some("published".to_owned()),
        }
    }
}
