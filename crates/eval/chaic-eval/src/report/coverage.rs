//! Notes about missing episode runs, and about helpers with different episode runs.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::TaskId;
use chaic_env::RunKey;

use crate::metrics::{PlayedEpisodes, RunResult};
use crate::report::labels::title;

/// Number of missing episode runs that a note names.
const MAX_LISTED_RUNS: usize = 5;

/// Returns notes about missing episode runs and about helpers with different ones; empty for a
/// complete run.
pub fn coverage(played: PlayedEpisodes<'_>) -> Vec<String> {
    missing(played).into_iter().chain(unequal(played.results)).collect()
}

fn missing(played: PlayedEpisodes<'_>) -> Option<String> {
    let missing = played.missing();
    let mut by_helper: BTreeMap<&str, usize> = BTreeMap::new();
    for key in &missing {
        *by_helper.entry(&key.helper).or_default() += 1;
    }
    let counts: Vec<String> = by_helper.iter().map(|(h, n)| format!("{} {n}", title(h))).collect();
    let name = |k: &&RunKey| format!("{} with {}, seed {}", k.episode, k.helper, k.seed);
    let named: Vec<String> = missing.iter().take(MAX_LISTED_RUNS).map(name).collect();
    (!missing.is_empty()).then(|| {
        let (n, total, counts) = (missing.len(), played.planned.len(), counts.join(", "));
        let more = if n > MAX_LISTED_RUNS { "; ..." } else { "" };
        format!(
            "Unfinished: {n} of {total} episode runs are missing ({counts}); all numbers are of those \
             that were played. Missing: {}{more}.",
            named.join("; ")
        )
    })
}

/// Returns a message with the number of finished results that have no complete trace, and the first
/// of them. `journaled` are the results of the journal, `scored` those from traces. Returns `None`
/// if all have traces.
pub fn untraced_note(journaled: &[RunResult], scored: &[RunResult]) -> Option<String> {
    let scored: BTreeSet<&RunKey> = scored.iter().map(|r| &r.key).collect();
    let finished = || journaled.iter().filter(|r| r.summary().is_some()).map(|r| &r.key);
    let untraced: Vec<&RunKey> = finished().filter(|k| !scored.contains(k)).collect();
    let RunKey { helper, episode, seed, .. } = untraced.iter().min()?;
    Some(format!(
        "{} of {} finished episode runs have no whole trace and are left out, first {episode} with \
         {helper} and seed {seed}",
        untraced.len(),
        finished().count()
    ))
}

/// Returns the failed episode runs of the journal that `scored`, the results from traces, lack. A
/// failed episode run has no trace, but counts as zero.
pub fn untraced_failures(journaled: &[RunResult], scored: &[RunResult]) -> Vec<RunResult> {
    let scored: BTreeSet<&RunKey> = scored.iter().map(|r| &r.key).collect();
    let is_failed = |r: &&RunResult| r.summary().is_none() && !scored.contains(&r.key);
    journaled.iter().filter(is_failed).cloned().collect()
}

/// Pairs of episode and seed by helper.
type ByHelper<'a> = BTreeMap<&'a str, BTreeSet<(&'a str, u32)>>;

fn unequal(results: &[RunResult]) -> Vec<String> {
    let mut by_task: BTreeMap<TaskId, ByHelper<'_>> = BTreeMap::new();
    for RunResult { key, .. } in results {
        let helpers = by_task.entry(key.task).or_default();
        helpers.entry(&key.helper).or_default().insert((&key.episode, key.seed));
    }
    let note = |(task, helpers): (&TaskId, &ByHelper<'_>)| {
        let mut sets = helpers.values();
        let first = sets.next()?;
        if sets.all(|set| set == first) {
            return None;
        }
        let counts: Vec<String> =
            helpers.iter().map(|(h, set)| format!("{} on {}", title(h), set.len())).collect();
        Some(format!(
            "Unequal: in {} the rows rest on different episode runs ({}); EI and differences are \
             over the episodes that both have.",
            task.info().title.to_lowercase(),
            counts.join(", ")
        ))
    };
    by_task.iter().filter_map(note).collect()
}
