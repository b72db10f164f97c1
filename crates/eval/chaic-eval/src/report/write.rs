//! The whole report, as text and as files.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use chaic_env::{CHAIC_VERSION, RunKey, Track};
use chaic_files::{EntryKind, kind, read_bounded};
use serde::Serialize;

use crate::error::Result;
use crate::metrics::{
    Ending, Environments, FormulaSet, MAX_NAMED, Played, RunResult, Score, Scores, differences,
};
use crate::report::Format;
use crate::report::coverage::coverage;
use crate::report::figure::{figure_text, write_figure};
use crate::report::labels::{GrantsFile, Labels};
use crate::report::tables::{
    BROKEN, MISSING, additional, counts, intervals, main_result, measures, pairs, resolutions,
    stuck,
};
use crate::report::text_table::TextTable;
use crate::run::{Item, RunFolder, RunGrants, RunOptions, environments};

/// File name of the figure as PNG.
const PICTURE: &str = "figure.png";

/// All that a report is made from.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// What was played.
    pub options: &'a RunOptions,
    /// What came out.
    pub results: &'a [RunResult],
    /// All episode runs that the run consists of.
    pub planned: &'a [Item],
    /// What everybody was granted; `None` where nobody has recorded it.
    pub granted: Option<&'a RunGrants>,
    /// By which formulas it is scored.
    pub formulas: FormulaSet,
}

/// What metrics need of the episode runs that were planned.
struct Plan {
    keys: Vec<RunKey>,
    environments: Environments,
}

impl Report<'_> {
    /// The scores.
    pub fn scores(&self) -> Scores {
        Scores::of(self.played(&self.plan()), &self.formulas.formulas())
    }

    /// What rows are called.
    pub fn labels(&self) -> Labels<'_> {
        Labels { granted: self.granted }
    }

    /// What has to be known of a run that isn't whole; nothing of one that is.
    pub fn notes(&self) -> Vec<String> {
        let unknown = "Environments unknown, as the episodes are gone: each counts as independent, so \
                       standard errors and intervals may be too small.";
        let unknown = self.planned.is_empty().then(|| unknown.to_owned());
        coverage(self.played(&self.plan())).into_iter().chain(unknown).collect()
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

    fn plan(&self) -> Plan {
        let keys = self.planned.iter().map(|i| i.key.clone()).collect();
        Plan { keys, environments: environments(self.planned) }
    }

    fn played<'a>(&'a self, plan: &'a Plan) -> Played<'a> {
        let Plan { keys, environments } = plan;
        Played { results: self.results, planned: keys, environments }
    }

    fn json(&self) -> String {
        #[derive(Serialize)]
        struct File<'a> {
            /// Absent where the run's episodes are gone.
            #[serde(skip_serializing_if = "Option::is_none")]
            episode_runs: Option<EpisodeRuns>,
            incomplete: bool,
            #[serde(skip_serializing_if = "Vec::is_empty")]
            missing: Vec<&'a RunKey>,
            #[serde(skip_serializing_if = "Option::is_none")]
            track: Option<Track>,
            #[serde(skip_serializing_if = "Option::is_none")]
            helpers: Option<BTreeMap<String, GrantsFile>>,
            #[serde(skip_serializing_if = "Option::is_none")]
            partner: Option<GrantsFile>,
            #[serde(flatten)]
            scores: Scores,
        }
        #[derive(Serialize)]
        struct EpisodeRuns {
            planned: usize,
            scored: usize,
            broken: usize,
            missing: usize,
        }
        let plan = self.plan();
        let mut missing = self.played(&plan).missing();
        let episode_runs = (!self.planned.is_empty()).then_some(EpisodeRuns {
            planned: self.planned.len(),
            scored: self.results.len(),
            broken: self.results.iter().filter(|r| r.summary().is_none()).count(),
            missing: missing.len(),
        });
        let incomplete = !missing.is_empty();
        missing.truncate(MAX_NAMED);
        let (labels, scores) = (self.labels(), self.scores());
        let helpers = labels.helpers_file(&self.options.helpers);
        let partner = labels.partner_file();
        let track = Some(self.options.track).filter(|track| *track != Track::default());
        let file = File { episode_runs, incomplete, missing, track, helpers, partner, scores };
        serde_json::to_string_pretty(&file).expect("scores have string keys") + "\n"
    }

    fn grids(&self, scores: &Scores) -> Vec<TextTable> {
        let labels = self.labels();
        let mut grids = main_result(scores, labels);
        grids.extend(additional(scores, labels));
        grids.extend(stuck(scores, labels));
        grids.extend(counts(self.results, labels));
        grids
    }

    fn terminal(&self) -> String {
        let scores = self.scores();
        let differences = differences(self.played(&self.plan()), &scores.helpers());
        let mut grids = self.grids(&scores);
        grids.extend(resolutions(&differences, &scores.tasks()));
        let mut text: String = grids.iter().map(|g| g.to_terminal() + "\n").collect();
        text += &self.legend(&scores);
        text += &self.notes().iter().map(|n| format!("{n}\n")).collect::<String>();
        text += &self.errors();
        text
    }

    fn markdown(&self) -> String {
        let scores = self.scores();
        let mut text = self.heading();
        let granted = self.labels().sentence(&scores.helpers());
        if let Some(granted) = &granted {
            let _ = writeln!(text, "**{granted}**\n");
        }
        for note in self.notes() {
            let _ = writeln!(text, "**{note}**\n");
        }
        let differences = differences(self.played(&self.plan()), &scores.helpers());
        let mut grids = self.grids(&scores);
        grids.push(intervals(&scores, self.labels()));
        if !differences.is_empty() {
            grids.push(pairs(&differences, &scores.tasks(), granted.as_deref()));
        }
        grids.extend(resolutions(&differences, &scores.tasks()));
        grids.extend(measures(&scores, self.labels()));
        for grid in grids {
            text += &grid.to_markdown();
            text.push('\n');
        }
        text += &self.legend(&scores);
        text += &self.errors();
        text
    }

    /// What was played, by what.
    fn heading(&self) -> String {
        let RunOptions {
            split, first, seeds, size, rules, set, partner, partner_is, track, ..
        } = self.options;
        let track =
            if *track == Track::default() { String::new() } else { format!(" Track: `{track}`.") };
        let episodes = first.map_or("all".to_owned(), |n| format!("first {n}"));
        let size = size.map_or("as each mind asks for".to_owned(), |px| format!("{px} pixels"));
        let played_by = match set[..] {
            [] => rules.to_string(),
            _ => format!("{rules} with {}", set.join(", ")),
        };
        let driven = partner.as_ref();
        let driven = driven.map_or(String::new(), |p| format!(" The partner is driven by `{p}`."));
        let person = partner_is.map_or(String::new(), |k| format!(" The partner is `{k}`."));
        format!(
            "# chaic run\n\nchaic {CHAIC_VERSION}, rules `{played_by}`, formulas `{}`. Split `{split}`, \
             {episodes} episodes of each task, seeds per episode: {seeds}. Images: {size}.{driven}{person}{track}\n\n",
            self.formulas,
        )
    }

    fn csv(&self) -> String {
        let scores = self.scores();
        let granted = self.labels().helpers_file(&self.options.helpers).unwrap_or_default();
        let mut text = String::from(
            "task,helper,grants,perception,tr,tr_se,tr_low,tr_high,ei,ei_low,ei_high,ia,cr,er,stuck,\
             episodes,environments,broken,incomplete\n",
        );
        for task in scores.tasks() {
            for helper in scores.helpers() {
                let Some(s) = scores.get(task, &helper) else { continue };
                let (grants, perception) = granted
                    .get(&helper)
                    .map_or((String::new(), ""), |g| (g.grants.join("+"), g.perception.as_str()));
                let numbers = csv_numbers(s);
                let Score { episodes, environments, broken, incomplete, .. } = s;
                let _ = writeln!(
                    text,
                    "{task},{helper},{grants},{perception},{numbers},{episodes},{environments},{broken},\
                     {incomplete}"
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
        if rows().any(|s| s.broken > 0) {
            let _ = writeln!(text, "{BROKEN} Episode runs broke down; they count as zero.");
        }
        if !self.played(&self.plan()).missing().is_empty() {
            let _ = writeln!(text, "{MISSING} Incomplete: episode runs are missing.");
        }
        if self.options.track != Track::default() {
            let _ = writeln!(
                text,
                "Track {}, which bounds the grants of all helpers.",
                self.options.track
            );
        }
        let _ = writeln!(text, "{} episode runs.", self.results.len());
        text
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
                    "Broke down, counts as zero: {} with {} (seed {}): {message}",
                    k.episode, k.helper, k.seed
                );
            }
        }
        text
    }
}

fn csv_numbers(s: &Score) -> String {
    let low = |ends: Option<[f64; 2]>| ends.map(|[low, _]| low);
    let high = |ends: Option<[f64; 2]>| ends.map(|[_, high]| high);
    let [tr_low, tr_high] = [low(s.tr_ci), high(s.tr_ci)];
    let [ei_low, ei_high] = [low(s.ei_ci), high(s.ei_ci)];
    let numbers =
        [Some(s.tr), s.tr_se, tr_low, tr_high, s.ei, ei_low, ei_high, s.ia, s.cr, s.er, s.stuck];
    let cell = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.6}"));
    numbers.map(cell).join(",")
}

impl Report<'_> {
    /// The files of it that are text, by name; without the figure if there are more helpers than
    /// one can show.
    fn texts(&self) -> Vec<(&'static str, String)> {
        let figure =
            figure_text(&self.scores(), self.labels()).ok().map(|figure| ("figure.svg", figure));
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
    write_figure(&report.scores(), report.labels(), &folder.join(PICTURE))
}

/// Compares the files of a report with what [`write_files`] writes. Returns the names of missing files and
/// of differing files. Of the PNG only the kind of file is checked: its bytes may depend on the machine.
///
/// # Errors
/// If a file can't be read.
pub fn differing_files(
    folder: &RunFolder,
    report: &Report<'_>,
) -> Result<(Vec<&'static str>, Vec<&'static str>)> {
    let (mut missing, mut altered) = (Vec::new(), Vec::new());
    for (name, text) in report.texts() {
        let path = folder.join(name);
        match kind(&path)? {
            EntryKind::Missing => missing.push(name),
            // One byte more tells a longer file from an equal one.
            EntryKind::File if read_bounded(&path, text.len() as u64 + 1)? == text.as_bytes() => {}
            _ => altered.push(name),
        }
    }
    let picture = kind(&folder.join(PICTURE))?;
    if ![EntryKind::Missing, EntryKind::File].contains(&picture) {
        altered.push(PICTURE);
    }
    Ok((missing, altered))
}
