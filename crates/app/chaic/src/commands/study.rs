//! `chaic study`.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use chaic_core::AgentId;
use chaic_eval::trace_file;
use chaic_export::card::Creator;
use chaic_export::lerobot::{LeRobotOptions, LeRobotWriter};
use chaic_files::write_atomically;
use chaic_page::study_page;
use chaic_sandbox::Launcher;
use chaic_study::deletion::{DERIVED, delete};
use chaic_study::export::{VerifiedTrial, export};
use chaic_study::{
    DesignBalance, Seat, Simulator, Study, StudyPlan, Trial, page_content, simulate,
};
use serde_json::json;

use super::{bars, table};
use crate::arguments::{
    StudyBuildArguments, StudyCheckArguments, StudyCommand, StudyDeleteArguments,
    StudyExportArguments,
};
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, counted, json_path, print_result, print_warning, quoted_path};

/// Sampling interval of LeRobot data sets, frames, and side of their images, pixels: the defaults of
/// `chaic export lerobot`.
const LEROBOT: (u32, u32) = (6, 256);
/// Maximum number of slots in a printed list of open slots.
const MAX_LISTED: usize = 20;

/// Runs a command for studies.
pub fn run(
    command: &StudyCommand,
    format: OutputFormat,
    launcher: &Launcher,
) -> Result<ExitStatus> {
    match command {
        StudyCommand::Serve(arguments) => super::study_serve::run(arguments, format, launcher),
        StudyCommand::Check(arguments) => check(arguments, format),
        StudyCommand::Build(arguments) => build(arguments, format),
        StudyCommand::Export(arguments) => export_data(arguments, format),
        StudyCommand::Delete(arguments) => delete_participant(arguments, format),
    }
}

fn read(path: &Path) -> Result<StudyPlan> {
    Ok(StudyPlan::new(Study::read(path)?, path)?)
}

/// Prints the plan of a study and the balance of simulated participants.
fn check(arguments: &StudyCheckArguments, format: OutputFormat) -> Result<ExitStatus> {
    let plan = read(&arguments.study)?;
    let n = arguments.participants.unwrap_or(plan.study().participants);
    let balance = simulate(&plan, n, f64::from(arguments.dropout) / 100.0);
    let [low, high] = balance.range();
    let names: Vec<&str> = plan.conditions().iter().map(|c| c.name.as_str()).collect();
    let json = json!({
        "title": plan.study().title,
        "digest": plan.digest(),
        "conditions": names,
        "orders": plan.assignment().orders(),
        "episodes": plan.episodes().iter().map(|episode| episode.id()).collect::<Vec<_>>(),
        "slots": plan.study().participants,
        "minutes": plan.length_minutes(),
        "simulator": plan.study().play.simulator,
        "simulation": {
            "arrived": balance.arrived,
            "completed": balance.completed,
            "late": balance.late,
            "counts": balance.counts,
            "smallest": low,
            "largest": high,
        },
    });
    print_result(format, &json, &check_text(&plan, &balance, arguments.dropout))?;
    Ok(ExitStatus::Success)
}

fn check_text(plan: &StudyPlan, balance: &DesignBalance, dropout: u8) -> String {
    let DesignBalance { arrived, completed, late, open_blocks, .. } = balance;
    let orders = plan.assignment().orders();
    let mut counts = table(["condition", "name", "complete, by position"]);
    for (condition, c) in plan.conditions().iter().enumerate() {
        let by_position = balance.counts.iter().map(|row| row[condition].to_string());
        let by_position = by_position.collect::<Vec<_>>().join(", ");
        counts.add_row([(condition + 1).to_string(), c.name.clone(), by_position]);
    }
    let numbers = |order: &[usize]| {
        order.iter().map(|condition| (condition + 1).to_string()).collect::<Vec<_>>().join(" ")
    };
    let orders: Vec<String> = orders.iter().map(|order| numbers(order)).collect();
    let [low, high] = balance.range();
    format!(
        "{}\ndigest {}\n{} for {}; orders of conditions: {}\nat least {:.0} minutes, if all episodes \
         are played to their end\n{}\n\n{counts}\nsimulated: {arrived} arrive, {dropout} % drop out, \
         {completed} complete{}\nlargest minus smallest count: {} (from {low} to {high}; {})\n",
        plan.study().title,
        plan.digest(),
        counted(plan.conditions().len(), "condition"),
        counted(plan.study().participants as usize, "slot"),
        orders.join(" | "),
        plan.length_minutes(),
        match plan.study().play.simulator {
            Simulator::Page => {
                "the page simulates the episodes, so it contains their goals"
            }
            Simulator::Server => {
                "the server simulates the episodes, so the page has no goals; it needs `chaic study serve`"
            }
        },
        if *late == 0 {
            String::new()
        } else {
            format!("; {late} finish after their slot was given away")
        },
        balance.spread(),
        counted(*open_blocks as usize, "incomplete block"),
    )
}

/// Writes the page of a study.
fn build(arguments: &StudyBuildArguments, format: OutputFormat) -> Result<ExitStatus> {
    let StudyBuildArguments { study, out } = arguments;
    let plan = read(study)?;
    if plan.study().play.simulator == Simulator::Server {
        bail!(
            "{}: `play.simulator = \"server\"` needs a server; use `chaic study serve`, or \
             `play.simulator = \"page\"` for a page that contains the goals",
            study.display()
        );
    }
    let page = study_page(&plan.study().title, &page_content(&plan));
    write_atomically(out, page.as_bytes())?;
    let slots = plan.study().participants;
    let name = out.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let text = format!(
        "{} ({:.1} MB), digest {}\n{}: give each participant the address of one, {name}#1 to \
         {name}#{slots}\nthe page contains the goals of its episodes, so a participant can find them\n",
        quoted_path(out),
        page.len() as f64 / 1e6,
        &plan.digest()[..8],
        counted(slots as usize, "slot"),
    );
    let json = json!({
        "out": json_path(out), "digest": plan.digest(), "slots": slots, "bytes": page.len(),
    });
    print_result(format, &json, &text)?;
    Ok(ExitStatus::Success)
}

/// Exports the data of participants.
fn export_data(arguments: &StudyExportArguments, format: OutputFormat) -> Result<ExitStatus> {
    let StudyExportArguments { data, study, out, lerobot, creator } = arguments;
    let plan = read(study)?;
    let report = export(&plan, data, out)?;
    if *lerobot {
        for seat in [Seat::Partner, Seat::Helper] {
            write_lerobot(&plan, &report.verified, seat, creator, out)?;
        }
    }
    report.problems.iter().for_each(|problem| print_warning(problem));
    let listed: Vec<String> =
        report.open_slots.iter().take(MAX_LISTED).map(ToString::to_string).collect();
    let more = if report.open_slots.len() > MAX_LISTED { " ..." } else { "" };
    let open = match report.open_slots.len() {
        0 => "no open slot".to_owned(),
        n => format!("{}: {}{more}", counted(n, "open slot"), listed.join(", ")),
    };
    let text = format!(
        "{}: {}, {} complete; {} of {} verified\n{open}\n",
        quoted_path(out),
        counted(report.participants, "participant"),
        report.completed,
        report.verified.len(),
        counted(report.traces, "trace"),
    );
    let json = json!({
        "out": json_path(out), "participants": report.participants, "completed": report.completed,
        "traces": report.traces, "verified": report.verified.len(), "problems": report.problems,
        "open_slots": report.open_slots,
    });
    print_result(format, &json, &text)?;
    Ok(ExitStatus::from_findings(report.verified.len() < report.traces))
}

/// Writes the verified episodes in which people played this seat as a LeRobot data set, without
/// practice episodes.
fn write_lerobot(
    plan: &StudyPlan,
    verified: &[VerifiedTrial],
    seat: Seat,
    creators: &[Creator],
    out: &Path,
) -> Result<()> {
    let has_seat = |trial: &Trial| plan.conditions()[trial.condition].seat == seat;
    let chosen: Vec<&VerifiedTrial> =
        verified.iter().filter(|v| v.trial.position > 0 && has_seat(&v.trial)).collect();
    if chosen.is_empty() {
        return Ok(());
    }
    let agent = match seat {
        Seat::Partner => AgentId::PARTNER,
        Seat::Helper => AgentId::HELPER,
    };
    let (every, image_size) = LEROBOT;
    let folder = out.join(format!("{DERIVED}{}", agent.role_name()));
    let writer = LeRobotWriter::create(&folder, LeRobotOptions { agent, every, image_size })?;
    let mut writer = writer.with_creators(creators.to_vec());
    let bar = bars::count_bar(chosen.len() as u64, "episodes");
    for VerifiedTrial { path, trial } in chosen {
        let (trace, _) = trace_file::read(path)?;
        writer.add(&trace, &plan.episodes()[trial.episode], &mut || true)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    writer.finish()?;
    Ok(())
}

/// Deletes the data of a participant.
fn delete_participant(
    arguments: &StudyDeleteArguments,
    format: OutputFormat,
) -> Result<ExitStatus> {
    let StudyDeleteArguments { code, folder } = arguments;
    let deleted = delete(code, folder)?;
    for path in &deleted.unsearched {
        print_warning(&format!("{} may still hold data; look at it", path.display()));
    }
    let text = format!(
        "{}: {} and {} of {code} removed\n",
        quoted_path(folder),
        counted(deleted.files.len(), "file"),
        counted(deleted.rows, "row"),
    );
    let paths = |paths: &[PathBuf]| paths.iter().map(|path| json_path(path)).collect::<Vec<_>>();
    let json = json!({
        "files": paths(&deleted.files), "rows": deleted.rows,
        "unsearched": paths(&deleted.unsearched),
    });
    print_result(format, &json, &text)?;
    Ok(ExitStatus::from_findings(!deleted.unsearched.is_empty()))
}
