//! `chaic verify`.

use anyhow::Result;
use chaic_eval::helpers::{BuiltIn, Helpers};
use chaic_eval::run::RunFolder;
use chaic_eval::verify::verify_run;
use chaic_llm::Language;

use super::{bars, jobs, llm};
use crate::Ended;
use crate::arguments::VerifyArguments;
use crate::output::{complain, counted, say};

/// Plays the traces of a run again and compares.
pub fn run(arguments: &VerifyArguments) -> Result<Ended> {
    let (folder, options) = RunFolder::read(&arguments.run)?;
    let bar = bars::plain(folder.traces()?.len() as u64, "traces");
    let progress = |done: usize| bar.set_position(done as u64);
    let language = Language::recorded(&arguments.run, llm::never())?;
    let helpers: &dyn Helpers = match &language {
        Some(language) => language,
        None => &BuiltIn,
    };
    let verdict = verify_run(&folder, &options, helpers, jobs(arguments.jobs), &progress);
    bar.finish_and_clear();
    let verdict = verdict?;
    for warning in &verdict.warnings {
        complain(&format!("warning: {warning}"));
    }
    for mismatch in &verdict.mismatches {
        say(&format!("DIFFERS {mismatch}\n"))?;
    }
    let (traces, decisions) = (verdict.agreeing, verdict.decisions);
    if !verdict.mismatches.is_empty() {
        let n = verdict.mismatches.len();
        say(&format!("traces that differ: {n} of {}\n", n + traces))?;
        return Ok(Ended::WithFindings);
    }
    if traces == 0 {
        anyhow::bail!("{} has no trace to verify", arguments.run.display());
    }
    let (traces, decisions) = (counted(traces, "trace"), counted(decisions, "decision"));
    say(&format!("{traces} with {decisions}: all digests agree\n"))?;
    Ok(Ended::Well)
}
