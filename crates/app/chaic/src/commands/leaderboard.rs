//! `chaic leaderboard`.

use anyhow::{Result, bail};
use chaic_arena::leaderboard::LeaderboardBuilder;
use chaic_arena::{Evaluation, Leaderboard};
use chaic_eval::EvalError;
use chaic_files::{EntryKind, entries, kind, write_atomically};
use serde_json::json;

use super::jobs;
use super::sealed::read_commitment;
use super::submit::verify_evaluation;
use crate::arguments::{LeaderboardBuildArguments, LeaderboardCommand};
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, counted, json_path, print_progress, print_result};

/// Builds a leaderboard.
pub fn run(command: &LeaderboardCommand, format: OutputFormat) -> Result<ExitStatus> {
    let LeaderboardCommand::Build(arguments) = command;
    let out = &arguments.out;
    if out.extension().is_none_or(|extension| extension != "html") {
        let problem = format!("{} is no page; write a name that ends with .html", out.display());
        return Err(EvalError::Options(problem).into());
    }
    let leaderboard = collect(arguments)?;
    let [json_file, csv_file] = ["json", "csv"].map(|extension| out.with_extension(extension));
    write_atomically(&json_file, leaderboard.to_json().as_bytes())?;
    write_atomically(&csv_file, leaderboard.to_csv().as_bytes())?;
    write_atomically(out, leaderboard.to_html(&arguments.title).as_bytes())?;
    let refused = &leaderboard.refused;
    let json = json!({
        "page": json_path(out), "json": json_path(&json_file), "csv": json_path(&csv_file),
        "tables": leaderboard.tables.len(), "submissions": leaderboard.n_submissions(), "refused": refused,
    });
    let mut text: String = refused
        .iter()
        .map(|entry| format!("REFUSED {}: {}\n", entry.folder, entry.reason))
        .collect();
    text += &format!(
        "{}: {} in {}\n",
        out.display(),
        counted(leaderboard.n_submissions(), "submission"),
        counted(leaderboard.tables.len(), "table")
    );
    print_result(format, &json, &text)?;
    Ok(ExitStatus::from_findings(!refused.is_empty()))
}

/// Verifies the evaluations below a folder.
fn collect(arguments: &LeaderboardBuildArguments) -> Result<Leaderboard> {
    let commitment = arguments.commitment.as_deref().map(read_commitment).transpose()?;
    if Evaluation::at(&arguments.folder).submission().is_ok() {
        bail!(
            "{} is one folder of chaic submit run; name the folder that holds such folders",
            arguments.folder.display()
        );
    }
    let mut builder = LeaderboardBuilder::default();
    let mut n_folders = 0;
    for path in entries(&arguments.folder)? {
        let is_link = kind(&path)? == EntryKind::Link;
        if !path.is_dir() {
            continue;
        }
        n_folders += 1;
        if is_link {
            builder.refuse(&path, "it is a link; put the folder itself there");
            continue;
        }
        print_progress(&format!("{}: verifying", path.display()));
        let jobs = jobs(arguments.jobs);
        match verify_evaluation(&Evaluation::at(&path), commitment.as_ref(), jobs) {
            Ok(report) => builder.add(&path, report),
            Err(error) => builder.refuse(&path, &format!("{error:#}")),
        }
    }
    if n_folders == 0 {
        bail!("{} holds no folder of chaic submit run", arguments.folder.display());
    }
    Ok(builder.build())
}
