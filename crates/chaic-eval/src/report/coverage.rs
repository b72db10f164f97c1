//! Whether all that a report should rest on is there, and is the same for everybody.

use std::collections::{BTreeMap, BTreeSet};

use chaic_protocol::TaskId;

use crate::metrics::{RunKey, RunResult};
use crate::report::tables::title;

/// What a reader of these results has to know: that episode runs of `planned` are missing, and
/// where helpers rest on different ones. Nothing of a whole run.
pub fn coverage(results: &[RunResult], planned: &[RunKey]) -> Vec<String> {
    missing(results, planned).into_iter().chain(unequal(results)).collect()
}

fn missing(results: &[RunResult], planned: &[RunKey]) -> Option<String> {
    let played: BTreeSet<&RunKey> = results.iter().map(|r| &r.key).collect();
    let mut by_helper: BTreeMap<&str, usize> = BTreeMap::new();
    for key in planned.iter().filter(|k| !played.contains(k)) {
        *by_helper.entry(&key.helper).or_default() += 1;
    }
    let n: usize = by_helper.values().sum();
    let each: Vec<String> = by_helper.iter().map(|(h, n)| format!("{} {n}", title(h))).collect();
    (n > 0).then(|| {
        let (total, each) = (planned.len(), each.join(", "));
        format!(
            "Unfinished: {n} of {total} episode runs are missing ({each}); all numbers are of those \
             that were played."
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
    for RunResult { key, .. } in results.iter().filter(|r| r.summary().is_some()) {
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
