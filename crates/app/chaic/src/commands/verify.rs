//! `chaic verify`.

use std::sync::Arc;

use anyhow::Result;
use chaic_env::minds::{Helpers, Seeing};
use chaic_eval::run::RunFolder;
use chaic_eval::verify::{ReportState, Verdict, verify_run};
use chaic_llm::Language;

use super::{bars, jobs, llm, sight};
use crate::arguments::VerifyArguments;
use crate::exit::Ended;
use crate::output::{complain, counted, say};

/// Plays the traces of a run again and compares.
pub fn run(arguments: &VerifyArguments) -> Result<Ended> {
    let (folder, options) = RunFolder::read(&arguments.run)?;
    let bar = bars::plain(folder.traces()?.len() as u64, "traces");
    let progress = |done: usize| bar.set_position(done as u64);
    let seeing = Seeing { sight: sight::recorded(&options) };
    let language = Language::recorded(&arguments.run, llm::never())?;
    let language = language.map(|language| language.with_sight(Arc::clone(&seeing.sight)));
    let helpers: &dyn Helpers = match &language {
        Some(language) => language,
        None => &seeing,
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
    for finding in &verdict.findings {
        say(&format!("FOUND {finding}\n"))?;
    }
    if verdict.agreeing + verdict.mismatches.len() + verdict.findings.len() == 0 {
        anyhow::bail!("{} has no trace to verify", arguments.run.display());
    }
    say(&(summary(&verdict) + "\n"))?;
    Ok(if verdict.is_good() { Ended::Well } else { Ended::WithFindings })
}

/// What was found in the run, its traces and its report, a line each.
fn summary(verdict: &Verdict) -> String {
    let (agreeing, n) = (verdict.agreeing, verdict.mismatches.len());
    let others = match verdict.findings.len() {
        0 => String::new(),
        n => format!("\nother findings in the folder: {n}"),
    };
    let traces = if n > 0 {
        format!("traces that differ: {n} of {}", n + agreeing)
    } else {
        let (traces, decisions) = (counted(agreeing, "trace"), verdict.decisions);
        format!("{traces} with {}: all digests agree", counted(decisions, "decision"))
    };
    let report = match &verdict.report {
        ReportState::Unchecked => "the report is not checked".to_owned(),
        ReportState::OfOtherVersion(chaic) => format!(
            "the report is NOT CHECKED, as chaic {chaic} began the run; verify it with that version"
        ),
        state @ ReportState::Compared { .. } if state.is_good() => {
            "the report is what the results give".to_owned()
        }
        ReportState::Compared { missing, altered } => [
            (missing, "MISSING", "write the report by chaic eval --resume"),
            (altered, "ALTERED", "the results give something else"),
        ]
        .into_iter()
        .filter(|(names, _, _)| !names.is_empty())
        .map(|(names, what, why)| format!("{what} {}: {why}", names.join(", ")))
        .collect::<Vec<_>>()
        .join("\n"),
    };
    // Where its episodes are gone, nobody knows how many there should be.
    let coverage = match &verdict.coverage {
        coverage if coverage.planned > 0 => format!("{coverage}\n"),
        _ => String::new(),
    };
    format!("{coverage}{traces}{others}\n{report}")
}
