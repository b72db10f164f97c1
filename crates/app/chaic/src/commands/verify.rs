//! `chaic verify`.

use std::path::Path;

use anyhow::Result;
use chaic_core::AgentId;
use chaic_env::trace::TraceWarning;
use chaic_episodes::find_episode;
use chaic_eval::run::RunFolder;
use chaic_eval::suite::SuiteFolder;
use chaic_eval::trace_file;
use chaic_eval::verify::{Finding, Mismatch, ReportState, VerificationReport, verify, verify_run};
use serde_json::{Value, json};

use super::recorded::RecordedHelpers;
use super::{bars, jobs};
use crate::arguments::VerifyArguments;
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, counted, json_path, print_result, print_warning};

/// Replays the traces of a run, or a single trace, and compares all recorded values.
pub fn run(arguments: &VerifyArguments, format: OutputFormat) -> Result<ExitStatus> {
    if arguments.run.is_file() {
        return verify_file(&arguments.run, format);
    }
    if SuiteFolder::is_suite(&arguments.run) {
        return verify_partners(arguments, format);
    }
    let verdict = verdict(&arguments.run, arguments)?;
    print_result(format, &to_json(&verdict), &text(&verdict))?;
    Ok(ExitStatus::from_findings(!verdict.has_passed()))
}

/// Verifies the run in a folder, and prints its warnings.
fn verdict(run: &Path, arguments: &VerifyArguments) -> Result<VerificationReport> {
    let (folder, options) = RunFolder::read(run)?;
    let bar = bars::count_bar(folder.traces()?.len() as u64, "traces");
    let progress = |done: usize| bar.set_position(done as u64);
    let helpers = RecordedHelpers::new(run, &options)?;
    let verdict =
        verify_run(&folder, &options, &helpers.registry(), jobs(arguments.jobs), &progress);
    bar.finish_and_clear();
    let verdict = verdict?;
    if verdict.agreeing + verdict.mismatches.len() + verdict.findings.len() == 0 {
        anyhow::bail!("{} has no trace to verify", run.display());
    }
    for warning in &verdict.warnings {
        print_warning(&warning.to_string());
    }
    Ok(verdict)
}

/// Formats all differences and findings, and the summary.
fn text(verdict: &VerificationReport) -> String {
    let differences: Vec<String> =
        verdict.mismatches.iter().map(|mismatch| format!("DIFFERS {mismatch}\n")).collect();
    let findings: Vec<String> =
        verdict.findings.iter().map(|finding| format!("FOUND {finding}\n")).collect();
    differences.concat() + &findings.concat() + &summary(verdict) + "\n"
}

/// Verifies the runs of all partners, and that they differ in the partner only.
fn verify_partners(arguments: &VerifyArguments, format: OutputFormat) -> Result<ExitStatus> {
    let folder = SuiteFolder::read(&arguments.run)?;
    // Incomplete records are reported when each run is verified below.
    let (runs, _) = folder.runs()?;
    let findings = folder.findings(&runs)?;
    let mut has_passed = findings.is_empty();
    let mut all_text: String =
        findings.iter().map(|finding| format!("FOUND {finding}\n")).collect();
    let mut of_partners = serde_json::Map::new();
    for entry in folder.partners() {
        let verdict = verdict(&folder.run_path(&entry), arguments)?;
        has_passed &= verdict.has_passed();
        all_text += &format!("{}: {}", entry.name, text(&verdict));
        of_partners.insert(entry.name, to_json(&verdict));
    }
    all_text += if findings.is_empty() {
        "the runs differ in the partner only, and the robustness report agrees with them\n"
    } else {
        "the folder has findings beside those of its runs\n"
    };
    let json = json!({
        "passed": has_passed,
        "findings": findings.iter().map(finding_json).collect::<Vec<_>>(),
        "partners": of_partners,
    });
    print_result(format, &json, &all_text)?;
    Ok(ExitStatus::from_findings(!has_passed))
}

/// Replays a trace that belongs to no run, such as that of a game in a browser.
fn verify_file(path: &Path, format: OutputFormat) -> Result<ExitStatus> {
    let (trace, warnings) = trace_file::read(path)?;
    warnings.iter().for_each(|warning| print_warning(&warning.to_string()));
    // The trace names the episode; the caller does not.
    let episode = find_episode(&trace.header.episode)
        .map_err(|problem| anyhow::anyhow!("{}: {problem}", path.display()))?;
    let mismatch = verify(&trace, &episode, path)?;
    let decisions = trace.decisions().count();
    let is_damaged = |warning: &&TraceWarning| matches!(warning, TraceWarning::Torn { .. });
    let damage = warnings.iter().find(is_damaged).map(ToString::to_string);
    let problem = mismatch.as_ref().map(ToString::to_string).or(damage);
    let text = match (&problem, &mismatch) {
        (Some(problem), Some(_)) => format!("DIFFERS {problem}\n"),
        (Some(_), None) => {
            format!("DAMAGED: the digests of {} agree\n", counted(decisions, "whole decision"))
        }
        (None, _) => format!("{}: all digests agree\n", counted(decisions, "decision")),
    };
    let json = json!({ "passed": problem.is_none(), "decisions": decisions, "problem": problem });
    print_result(format, &json, &text)?;
    Ok(ExitStatus::from_findings(problem.is_some()))
}

fn finding_json(finding: &Finding) -> Value {
    json!({ "path": json_path(&finding.path), "problem": finding.problem })
}

fn to_json(verdict: &VerificationReport) -> Value {
    let mismatch = |m: &Mismatch| {
        json!({
            "path": json_path(&m.path), "frame": m.frame,
            "agent": m.agent.map(AgentId::role_name), "problem": m.problem,
        })
    };
    let coverage = &verdict.coverage;
    json!({
        "passed": verdict.has_passed(),
        "traces": { "agreeing": verdict.agreeing, "decisions": verdict.decisions },
        "mismatches": verdict.mismatches.iter().map(mismatch).collect::<Vec<_>>(),
        "findings": verdict.findings.iter().map(finding_json).collect::<Vec<_>>(),
        "episode_runs": {
            "planned": coverage.planned,
            "missing": coverage.missing.len(),
            "failed": coverage.failed.len(),
        },
        "report": report_text(&verdict.report),
    })
}

/// Formats the findings in the run, its traces and its report, one line each.
fn summary(verdict: &VerificationReport) -> String {
    let (agreeing, n) = (verdict.agreeing, verdict.mismatches.len());
    let findings = match verdict.findings.len() {
        0 => String::new(),
        n => format!("\nother findings in the folder: {n}"),
    };
    let traces = if n > 0 {
        format!("traces that differ: {n} of {}", n + agreeing)
    } else {
        let (traces, decisions) = (counted(agreeing, "trace"), verdict.decisions);
        format!("{traces} with {}: all digests agree", counted(decisions, "decision"))
    };
    // Without the episodes, the number of planned episode runs is unknown.
    let coverage = match &verdict.coverage {
        coverage if coverage.planned > 0 => format!("{coverage}\n"),
        _ => String::new(),
    };
    format!("{coverage}{traces}{findings}\n{}", report_text(&verdict.report))
}

/// Describes the result of comparing the report with the results.
fn report_text(state: &ReportState) -> String {
    match state {
        ReportState::Unchecked => "the report is not checked".to_owned(),
        ReportState::OtherVersion(chaic) => format!(
            "the report is NOT CHECKED, because chaic {chaic} started the run; verify it with that version"
        ),
        state @ ReportState::Compared { .. } if state.has_passed() => {
            "the report agrees with the results".to_owned()
        }
        ReportState::Compared { missing, altered } => [
            (missing, "MISSING", "write the report with chaic eval --resume"),
            (altered, "ALTERED", "it differs from the results"),
        ]
        .into_iter()
        .filter(|(names, _, _)| !names.is_empty())
        .map(|(names, state, reason)| format!("{state} {}: {reason}", names.join(", ")))
        .collect::<Vec<_>>()
        .join("\n"),
    }
}
