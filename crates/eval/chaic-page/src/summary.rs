//! Content of a report for people, as texts and positions.

use std::collections::BTreeMap;
use std::path::PathBuf;

use chaic_core::{AgentId, FRAMES_PER_SECOND, Frame, TaskId};
use chaic_env::RunKey;
use chaic_env::helper_registry::NONE;
use chaic_env::narration::ActivityKind;
use chaic_eval::Result;
use chaic_eval::activity::ActivityTotals;
use chaic_eval::examples::{Example, ExampleRole, examples, paired_runs};
use chaic_eval::metrics::{Difference, Interval, Metric, Score, Scores};
use chaic_eval::published::published;
use chaic_eval::report::{
    Format, Labels, MIN_ENVIRONMENTS, Report, number, rounded, shown_interval,
};
use chaic_eval::run::RunFolder;
use serde::Serialize;

use crate::data_link;
use crate::overview::{OverviewRow, overview};
use crate::replays::PageReplay;

/// Report of a run for people.
#[derive(Clone, Debug, Serialize)]
pub struct RunSummary {
    /// Result of the helper with the largest gain in one sentence.
    pub lead: String,
    /// Gains of all helpers over no helper.
    pub gains: Vec<HelperGain>,
    /// Scores per task and helper.
    pub scores: Vec<ScoreRow>,
    /// True if the paper reports a score of one of the rows.
    pub has_paper: bool,
    /// Rule by which the examples are selected.
    pub example_rule: String,
    /// Example episodes.
    pub examples: Vec<ExampleRow>,
    /// Helper of the overview; empty without runs to compare.
    pub overview_helper: String,
    /// All episodes of the helper with the largest gain, beside those without helper.
    pub overview: Vec<OverviewRow>,
    /// Time by activity and failures, per helper and agent; empty without traces.
    pub activities: Vec<ActivityRow>,
    /// Limits of the figures.
    pub notes: Vec<String>,
    /// Command that repeats the run.
    pub command: String,
    /// Link to the scores as CSV.
    pub csv: String,
    /// Link to the scores as JSON.
    pub json: String,
}

/// Gain of a helper.
#[derive(Clone, Debug, Serialize)]
pub struct HelperGain {
    /// Title of the helper.
    pub helper: String,
    /// Its grants.
    pub grants: String,
    /// Mean transport rate over all tasks.
    pub rate: String,
    /// Difference of the transport rate to no helper, with its interval.
    pub gain: String,
}

/// Scores of a helper in a task.
#[derive(Clone, Debug, Serialize)]
pub struct ScoreRow {
    /// Title of the task.
    pub task: &'static str,
    /// Title of the helper.
    pub helper: String,
    /// Transport rate.
    pub rate: String,
    /// Its 95 % interval; empty if unknown.
    pub interval: String,
    /// Positions in the strip.
    pub span: StripPosition,
    /// Transport rate in the paper; empty if it has none.
    pub paper: String,
    /// Efficiency improvement, goal inference accuracy, completion ratio and emergency rate.
    pub others: [String; 4],
    /// Number of episode runs.
    pub episodes: usize,
}

/// Positions in the strip of a row, percent of its width.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StripPosition {
    /// Transport rate.
    pub rate: f64,
    /// Ends of the interval.
    pub interval: Option<[f64; 2]>,
    /// Transport rate in the paper.
    pub paper: Option<f64>,
}

/// Example episode.
#[derive(Clone, Debug, Serialize)]
pub struct ExampleRow {
    /// Reason why it is shown.
    pub heading: &'static str,
    /// Description of the episode and its result.
    pub text: String,
    /// Address of its turning point; absent without a trace.
    pub link: Option<String>,
    /// Address of the comparison with the baseline's run at that moment; absent without a trace.
    pub comparison_link: Option<String>,
    /// Time of the turning point.
    pub time: String,
    #[serde(skip)]
    example: Example,
}

/// Time by activity and failures of one agent.
#[derive(Clone, Debug, Serialize)]
pub struct ActivityRow {
    /// Title of the helper of the runs.
    pub helper: String,
    /// `partner` or `helper`.
    pub agent: &'static str,
    /// Percent of the time that it walks, uses its hands and waits.
    pub percent: [u32; 3],
    /// Failed and all attempts.
    pub failures: String,
    /// Failures by reason, most frequent first.
    pub reasons: String,
}

impl RunSummary {
    /// Summarizes a run. Reads all traces.
    ///
    /// # Errors
    /// If a trace cannot be read.
    pub fn new(folder: &RunFolder, report: &Report<'_>) -> Result<RunSummary> {
        let (scores, labels) = (report.scores(), report.labels());
        let helpers = scores.helpers();
        let differences = report.differences();
        let gains = gains(&scores, labels, &differences, &helpers);
        let best = best_helper(&differences, &helpers);
        let has_none = helpers.iter().any(|helper| helper == NONE);
        let baseline = has_none.then_some(NONE).filter(|none| best.as_deref() != Some(none));
        let examples: Vec<Example> =
            best.iter().flat_map(|best| examples(report.results, best, baseline)).collect();
        let pairs = best.as_deref().zip(baseline);
        let paired = pairs.map(|(best, baseline)| paired_runs(report.results, best, baseline));
        let watched: Vec<&RunKey> = examples.iter().map(|example| &example.key).collect();
        let overview = overview(&paired.unwrap_or_default(), &watched);
        let rows = score_rows(&scores, labels);
        Ok(RunSummary {
            lead: lead(&scores, labels, &differences, best.as_deref()),
            gains,
            has_paper: rows.iter().any(|row| row.span.paper.is_some()),
            scores: rows,
            example_rule: example_rule(labels, best.as_deref(), baseline),
            overview_helper: pairs.map_or(String::new(), |(best, _)| name(labels, best)),
            overview,
            examples: examples.into_iter().map(ExampleRow::new).collect(),
            activities: activities(folder, report, labels, &helpers)?,
            notes: notes(report, &helpers),
            command: report.options.command(),
            csv: data_link("text/csv", &report.text(Format::Csv)),
            json: data_link("application/json", &report.text(Format::Json)),
        })
    }

    /// Returns the traces of the examples and of the baseline's runs on the same episodes, as far as they
    /// exist.
    pub fn example_traces(&self, folder: &RunFolder) -> Vec<PathBuf> {
        let keys = self
            .examples
            .iter()
            .flat_map(|row| [Some(row.example.key.clone()), row.baseline_key()]);
        keys.flatten().filter(|key| folder.has_trace(key)).map(|key| folder.trace(&key)).collect()
    }

    /// Links the examples to those of these replays that show them.
    pub fn link(&mut self, replays: &[PageReplay]) {
        let index: BTreeMap<&RunKey, usize> =
            replays.iter().enumerate().map(|(k, replay)| (&replay.key, k)).collect();
        for row in &mut self.examples {
            let frame = row.example.frame;
            let own = index.get(&row.example.key);
            let baseline = row.baseline_key().and_then(|key| index.get(&key));
            row.link = own.map(|k| format!("#{k}@{frame}"));
            row.comparison_link =
                own.zip(baseline).map(|(k, other)| format!("#{k}+{other}@{frame}"));
        }
    }
}

impl ExampleRow {
    fn new(example: Example) -> ExampleRow {
        let heading = match example.role {
            ExampleRole::Typical => "Typical",
            ExampleRole::Best => "Best",
            ExampleRole::Worst => "Worst",
        };
        let key = &example.key;
        let rate = percent(example.rate);
        let alone = example.baseline_rate;
        let alone =
            alone.map_or(String::new(), |rate| format!(", {} without helper", percent(rate)));
        let task = key.task.info().title;
        let text = format!("{task}, {}, seed {}: {rate} delivered{alone}.", key.episode, key.seed);
        ExampleRow {
            heading,
            text,
            link: None,
            comparison_link: None,
            time: clock(example.frame),
            example,
        }
    }

    /// Returns the run without helper on the same episode and seed, if it is the baseline.
    fn baseline_key(&self) -> Option<RunKey> {
        self.example.baseline_rate?;
        Some(RunKey { helper: NONE.to_owned(), ..self.example.key.clone() })
    }
}

/// Formats a frame as minutes and seconds.
fn clock(frame: Frame) -> String {
    let seconds = frame / FRAMES_PER_SECOND;
    format!("{}:{:02}", seconds / 60, seconds % 60)
}

fn percent(rate: f64) -> String {
    // Formatting would round 12.5 to 12, unlike the list of all episodes and the replays.
    format!("{} %", (100.0 * rate).round())
}

/// Returns the name of a helper for people.
fn name(labels: Labels<'_>, helper: &str) -> String {
    if helper == NONE { "No helper".to_owned() } else { labels.name(helper) }
}

/// Returns the difference of a helper to no helper.
fn gain_of<'a>(differences: &'a [Difference], helper: &str) -> Option<&'a Difference> {
    differences.iter().find(|d| d.helper == helper && d.baseline == NONE)
}

/// Returns the helper with the largest gain over no helper; without gains the last helper.
fn best_helper(differences: &[Difference], helpers: &[String]) -> Option<String> {
    let mean = |helper: &str| Some(gain_of(differences, helper)?.all?.mean);
    let gains = helpers.iter().filter_map(|helper| Some((helper, mean(helper)?)));
    let best = gains.max_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(helper, _)| helper);
    best.or(helpers.last()).cloned()
}

/// Returns the mean transport rate over all episode runs of a helper.
fn mean_rate(scores: &Scores, helper: &str) -> Option<f64> {
    let tasks = scores.tasks();
    let rows: Vec<&Score> = tasks.iter().filter_map(|task| scores.get(*task, helper)).collect();
    let n: usize = rows.iter().map(|score| score.episodes).sum();
    let sum: f64 = rows.iter().map(|score| score.tr * score.episodes as f64).sum();
    (n > 0).then(|| sum / n as f64)
}

fn lead(
    scores: &Scores,
    labels: Labels<'_>,
    differences: &[Difference],
    best: Option<&str>,
) -> String {
    let Some(helper) = best else { return "No episode run is finished.".to_owned() };
    let Some(rate) = mean_rate(scores, helper) else { return String::new() };
    let (title, rate) = (name(labels, helper), percent(rate));
    let Some(alone) = mean_rate(scores, NONE).filter(|_| helper != NONE) else {
        return format!("With {title}, {rate} of the goal is delivered.");
    };
    let alone = percent(alone);
    let sentence = format!(
        "With {title}, {rate} of the goal is delivered; without helper, the partner delivers {alone}."
    );
    let gain = gain_of(differences, helper).and_then(|difference| difference.all);
    format!("{sentence} {}", gain_sentence(gain))
}

/// Returns the sentence about the gain over no helper.
fn gain_sentence(gain: Option<Interval>) -> String {
    let Some(gain) = gain.filter(|gain| gain.environments >= MIN_ENVIRONMENTS) else {
        return "There are too few environments for an interval.".to_owned();
    };
    let [mean, low, high] = [gain.mean, gain.low, gain.high].map(|x| rounded(100.0 * x));
    format!(
        "The gain is {mean} percentage points (95 % interval {low} to {high}, {} environments).",
        gain.environments
    )
}

fn gains(
    scores: &Scores,
    labels: Labels<'_>,
    differences: &[Difference],
    helpers: &[String],
) -> Vec<HelperGain> {
    let grants = labels.helper_grants(helpers).unwrap_or_default();
    let row = |helper: &String| {
        let gain = gain_of(differences, helper).and_then(|difference| difference.all.as_ref());
        let grants = grants.get(helper).map_or(String::new(), |file| {
            let granted: Vec<String> = file.grants.iter().map(|g| g.replace('_', " ")).collect();
            if granted.is_empty() { "none".to_owned() } else { granted.join(", ") }
        });
        HelperGain {
            helper: name(labels, helper),
            grants: if helper == NONE { "–".to_owned() } else { grants },
            rate: number(mean_rate(scores, helper)),
            gain: chaic_eval::report::interval(gain),
        }
    };
    helpers.iter().map(row).collect()
}

fn score_rows(scores: &Scores, labels: Labels<'_>) -> Vec<ScoreRow> {
    let helpers = scores.helpers();
    let row = |task: TaskId, helper: &String| {
        let score = scores.get(task, helper)?;
        let paper = published(helper).and_then(|row| row.scores(task)).map(|scores| scores.tr);
        let interval = shown_interval(score);
        let value = |key| number(Metric::from_key(key).value(score));
        Some(ScoreRow {
            task: task.info().title,
            helper: name(labels, helper),
            rate: rounded(score.tr),
            interval: interval.map_or(String::new(), |[low, high]| {
                format!("{} to {}", rounded(low), rounded(high))
            }),
            span: StripPosition {
                rate: position(score.tr),
                interval: interval.map(|ends| ends.map(position)),
                paper: paper.map(position),
            },
            paper: paper.map_or(String::new(), rounded),
            others: ["ei", "ia", "cr", "er"].map(value),
            episodes: score.episodes,
        })
    };
    let tasks = scores.tasks();
    let pairs = tasks.iter().flat_map(|task| helpers.iter().map(move |helper| (*task, helper)));
    pairs.filter_map(|(task, helper)| row(task, helper)).collect()
}

/// Returns the position of a rate in a strip, percent with one decimal.
fn position(rate: f64) -> f64 {
    (1000.0 * rate).round() / 10.0
}

fn example_rule(labels: Labels<'_>, helper: Option<&str>, baseline: Option<&str>) -> String {
    let Some(helper) = helper.map(|helper| name(labels, helper)) else { return String::new() };
    match baseline {
        Some(_) => format!(
            "Of the episodes of {helper}, the one whose difference to the same episode without helper \
             is nearest to the mean, the one with the largest and the one with the smallest difference. Each opens \
             at the first frame with the largest difference between both runs."
        ),
        None => format!(
            "Of the episodes of {helper}, the one whose transport rate is nearest to the mean, the \
             one with the highest and the one with the lowest. Each opens at its first delivery."
        ),
    }
}

fn activities(
    folder: &RunFolder,
    report: &Report<'_>,
    labels: Labels<'_>,
    helpers: &[String],
) -> Result<Vec<ActivityRow>> {
    let mut totals: BTreeMap<(&str, AgentId), ActivityTotals> = BTreeMap::new();
    for result in report.results.iter().filter(|result| folder.has_trace(&result.key)) {
        let (trace, _) = folder.read_trace(&folder.trace(&result.key))?;
        for agent in [AgentId::PARTNER, AgentId::HELPER] {
            totals.entry((&result.key.helper, agent)).or_default().add(&trace, agent);
        }
    }
    let agents = [(AgentId::PARTNER, "partner"), (AgentId::HELPER, "helper")];
    let places = helpers.iter().flat_map(|helper| agents.map(|agent| (helper, agent)));
    let row = |(helper, (agent, role)): (&String, (AgentId, &'static str))| {
        let totals = totals.get(&(helper.as_str(), agent))?;
        (!totals.frames.is_empty()).then(|| ActivityRow::new(name(labels, helper), role, totals))
    };
    Ok(places.filter_map(row).collect())
}

impl ActivityRow {
    fn new(helper: String, agent: &'static str, totals: &ActivityTotals) -> ActivityRow {
        let kinds = [ActivityKind::Walk, ActivityKind::Interact, ActivityKind::Wait];
        let mut reasons: Vec<(&String, u64)> =
            totals.failures.iter().map(|(reason, n)| (reason, *n)).collect();
        reasons.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
        let n_failures: u64 = totals.failures.values().sum();
        let text: Vec<String> = reasons.iter().map(|(reason, n)| format!("{reason} {n}")).collect();
        ActivityRow {
            helper,
            agent,
            percent: kinds.map(|kind| (100.0 * totals.fraction(kind)).round() as u32),
            failures: format!("{n_failures} of {}", totals.attempts),
            reasons: text.join(", "),
        }
    }
}

fn notes(report: &Report<'_>, helpers: &[String]) -> Vec<String> {
    let resolution = report.resolution().map(|resolution| {
        format!(
            "A difference of two helpers below {} in the mean over all tasks cannot be told from zero \
             here (half the 95 % interval of the median pair, {} environments).",
            rounded(resolution.median),
            resolution.environments
        )
    });
    let granted = report.labels().sentence(helpers);
    let track = format!("Track: {}.", report.options.track);
    let simulated = "Partners are simulated; the scores do not tell how people with disabilities judge a helper.";
    let all = report.notes().into_iter().chain(resolution).chain(granted).chain([track]);
    all.chain([simulated.to_owned()]).collect()
}

#[cfg(test)]
mod tests {
    use chaic_eval::report::interval;

    use super::*;

    #[test]
    fn the_first_sentence_has_an_interval_if_the_table_has_one() {
        for environments in 2..5 {
            let [mean, se, low, high] = [0.25, 0.05, 0.125, 0.375];
            let gain = Interval { mean, se, low, high, environments, df: environments - 1 };
            let sentence = gain_sentence(Some(gain));
            let is_in_table = interval(Some(&gain)).contains('[');
            assert_eq!(sentence.contains("12.50 to 37.50"), is_in_table, "{sentence}");
        }
        assert!(gain_sentence(None).contains("too few environments"));
    }

    #[test]
    fn percentages_are_those_of_the_other_parts_of_the_page() {
        assert_eq!([0.0, 0.125, 0.625, 1.0].map(percent), ["0 %", "13 %", "63 %", "100 %"]);
    }
}
