//! `chaic show`.

use anyhow::Result;
use chaic_eval::metrics::FormulaSet;
use chaic_eval::report::Report;
use chaic_eval::run::{RunFolder, RunOptions, planned, planned_traces, read_results};
use serde_json::{Value, json};

use super::summary::{scores_json, scores_text};
use crate::arguments::ShowArguments;
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, counted, json_path, print_result, print_warning, quoted_path};

/// Name in `run.json` of the split of a run of episode files.
const FILES_SPLIT: &str = "files";

/// Prints options, progress and scores of a run.
pub fn run(arguments: &ShowArguments, format: OutputFormat) -> Result<ExitStatus> {
    let (folder, options) = RunFolder::read(&arguments.run)?;
    let planned = planned(&folder, &options).unwrap_or_else(|e| {
        print_warning(&format!("can't check whether the run is complete: {e}"));
        Vec::new()
    });
    let results = if folder.results().exists() {
        let (results, warnings) = read_results(&folder.results(), &planned)?;
        warnings.iter().for_each(|warning| print_warning(&warning.to_string()));
        results
    } else {
        Vec::new()
    };
    let n_failed = results.iter().filter(|result| result.summary().is_none()).count();
    let progress = Progress { planned: planned.len(), finished: results.len(), failed: n_failed };
    let n_traces = if options.traces { planned_traces(&folder, &planned)?.0.len() } else { 0 };
    let granted = folder.granted()?;
    let version = folder.version()?.unwrap_or_default();
    let report = Report {
        version: &version,
        options: &options,
        results: &results,
        planned: &planned,
        granted: granted.as_ref(),
        formulas: FormulaSet::Paper,
    };
    let json = json!({
        "run": json_path(folder.path()),
        "options": options,
        "episode_runs": {
            "planned": progress.planned, "finished": progress.finished, "failed": progress.failed,
        },
        "traces": n_traces,
        "scores": if results.is_empty() { Value::Null } else { scores_json(&report)? },
    });
    let mut text = options_text(&options, &progress, n_traces);
    text += "\n";
    text += &if results.is_empty() {
        format!("no finished episode run yet\nRun:     {}\n", quoted_path(folder.path()))
    } else {
        scores_text(&report, folder.path(), &[])
    };
    print_result(format, &json, &text)?;
    Ok(ExitStatus::Success)
}

/// Counts of episode runs.
struct Progress {
    /// Number of planned episode runs; 0 if the episode files of the run no longer exist.
    planned: usize,
    finished: usize,
    failed: usize,
}

/// Formats the options that differ from the default, and the progress.
fn options_text(options: &RunOptions, progress: &Progress, n_traces: usize) -> String {
    let RunOptions { split, seeds, rules, rule_overrides, traces, track, .. } = options;
    let episodes = match options.n_episodes {
        None => "all episodes".to_owned(),
        Some(1) => "the first episode".to_owned(),
        Some(n) => format!("the first {n} episodes"),
    };
    let split =
        if split == FILES_SPLIT { "episode files".to_owned() } else { format!("split {split}") };
    let tasks: Vec<&str> = options.tasks.iter().map(|task| task.name()).collect();
    let rules = [&[rules.to_string()], &rule_overrides[..]].concat().join(", ");
    let Progress { planned, finished, failed } = progress;
    let total = counted(*planned, "episode run");
    let optional = |label: &'static str, value: Option<String>| value.map(|value| (label, value));
    let lines = [
        Some(("Tasks", tasks.join(", "))),
        Some(("Helpers", options.helpers.join(", "))),
        Some(("Episodes", format!("{split}, {episodes} of each task, seeds: {seeds}"))),
        Some(("Rules", rules)),
        Some(("Track", track.to_string())),
        optional("Images", options.image_size.map(|px| format!("{px} pixels"))),
        optional("Partner", options.partner.clone()),
        optional("Person", options.person.map(|kind| kind.to_string())),
        optional("Perception", options.perception.clone()),
        optional("Behavior", options.behavior.clone()),
        optional("Appearance", options.appearance.clone()),
        Some(("Finished", format!("{finished} of {total}, failed: {failed}"))),
        Some(("Traces", if *traces { n_traces.to_string() } else { "not recorded".to_owned() })),
    ];
    let line = |(label, value)| format!("{:12}{value}\n", format!("{label}:"));
    lines.into_iter().flatten().map(line).collect()
}
