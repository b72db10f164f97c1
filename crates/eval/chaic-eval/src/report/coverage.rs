//! Whether all that a report should rest on is there, and is the same for everybody.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::TaskId;
use chaic_env::RunKey;

use crate::metrics::{Played, RunResult};
use crate::report::labels::title;

/// How many missing episode runs a note names.
const NAMED: usize = 5;

/// What a reader of these results has to know: which episode runs are missing, and where helpers
/// rest on different ones. Nothing of a whole run.
pub fn coverage(played: Played<'_>) -> Vec<String> {
    missing(played).into_iter().chain(unequal(played.results)).collect()
}

fn missing(played: Played<'_>) -> Option<String> {
    let missing = played.missing();
    let mut by_helper: BTreeMap<&str, usize> = BTreeMap::new();
    for key in &missing {
        *by_helper.entry(&key.helper).or_default() += 1;
    }
    let each: Vec<String> = by_helper.iter().map(|(h, n)| format!("{} {n}", title(h))).collect();
    let name = |k: &&RunKey| format!("{} with {}, seed {}", k.episode, k.helper, k.seed);
    let named: Vec<String> = missing.iter().take(NAMED).map(name).collect();
    (!missing.is_empty()).then(|| {
        let (n, total, each) = (missing.len(), played.planned.len(), each.join(", "));
        let more = if n > NAMED { "; ..." } else { "" };
        format!(
            "Unfinished: {n} of {total} episode runs are missing ({each}); all numbers are of those \
             that were played. Missing: {}{more}.",
            named.join("; ")
        )
    })
}

/// The finished ones among the `noted` results that are not among those `scored` from traces, and
/// so have no whole trace: how many, and which is the first. Nothing if there are none.
pub fn without_trace(noted: &[RunResult], scored: &[RunResult]) -> Option<String> {
    let scored: BTreeSet<&RunKey> = scored.iter().map(|r| &r.key).collect();
    let finished = || noted.iter().filter(|r| r.summary().is_some()).map(|r| &r.key);
    let missed: Vec<&RunKey> = finished().filter(|k| !scored.contains(k)).collect();
    let RunKey { helper, episode, seed, .. } = missed.iter().min()?;
    Some(format!(
        "{} of {} finished episode runs have no whole trace and are left out, first {episode} with \
         {helper} and seed {seed}",
        missed.len(),
        finished().count()
    ))
}

/// Episodes and seeds by helper.
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
        let each: Vec<String> =
            helpers.iter().map(|(h, set)| format!("{} on {}", title(h), set.len())).collect();
        Some(format!(
            "Unequal: in {} the rows rest on different episode runs ({}); EI and differences are \
             over the episodes that both have.",
            task.info().title.to_lowercase(),
            each.join(", ")
        ))
    };
    by_task.iter().filter_map(note).collect()
}
