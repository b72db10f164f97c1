//! `chaic episodes`.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result};
use chaic_core::TaskId;
use chaic_episodes::{Episode, EpisodeError, Split, episodes, find_episode, json_schema};
use chaic_eval::{EvalError, frame_export, read_episode_file};
use chaic_export::episodes::file_name;
use chaic_files::{create_folders, write_atomically};
use comfy_table::Table;
use serde_json::json;

use super::{bars, sealed, table};
use crate::arguments::EpisodesCommand;
use crate::exit::ExitStatus;
use crate::interrupt;
use crate::output::{
    OutputFormat, counted, json_path, print, print_error, print_result, print_warning,
    print_while_read,
};

/// Lists, shows, generates or validates episodes.
pub fn run(command: &EpisodesCommand, format: OutputFormat) -> Result<ExitStatus> {
    match command {
        EpisodesCommand::List { split, task } => list(split, &task.0, format),
        EpisodesCommand::Show { episode, out, width } => show(episode, out, *width, format),
        EpisodesCommand::Generate { task, seeds, split, out } => {
            let generated = seeds.clone().map(Split::Generated);
            let split = generated.or(split.clone()).context("give --seeds or --split")?;
            generate(*task, &split, out, format)
        }
        EpisodesCommand::Validate { split: Some(split), .. } => validate_split(split, format),
        EpisodesCommand::Validate { files, .. } => validate(files, format),
        EpisodesCommand::Seal { secret, task, n_episodes, n_partners, out } => {
            let size = sealed::SplitSize {
                n_episodes: usize::from(*n_episodes),
                n_partners: usize::from(*n_partners),
            };
            sealed::seal(secret, &task.0, size, out, format)
        }
        EpisodesCommand::Open { secret, commitment, out, partners } => {
            sealed::open(secret, commitment, out, partners.as_deref(), format)
        }
        EpisodesCommand::Schema => {
            print(&(serde_json::to_string_pretty(&json_schema())? + "\n"))?;
            Ok(ExitStatus::Success)
        }
    }
}

/// Maximum number of episodes in one table. A longer list is printed as several tables, so that
/// output starts early.
const ROWS: usize = 96;

/// Prints while it reads: a split may have more episodes than memory holds.
fn list(split: &Split, tasks: &[TaskId], format: OutputFormat) -> Result<ExitStatus> {
    for task in tasks.iter().filter(|task| split.len_of(**task) == 0) {
        print_warning(&format!("{split} has no episodes of {task}, which is not the paper's"));
    }
    let mut listed = tasks.iter().flat_map(|task| episodes(split, *task));
    if format != OutputFormat::Json {
        loop {
            let rows: Vec<Episode> = listed.by_ref().take(ROWS).collect::<Result<_, _>>()?;
            if rows.is_empty() || !print_while_read(&(episode_table(&rows).trim_fmt() + "\n"))? {
                return Ok(ExitStatus::Success);
            }
        }
    }
    let mut separator = "[\n";
    for episode in listed {
        let text = serde_json::to_string_pretty(&json_of(&episode?))?;
        let text = text.replace('\n', "\n  ");
        if !print_while_read(&format!("{separator}  {text}"))? {
            return Ok(ExitStatus::Success);
        }
        separator = ",\n";
    }
    let is_empty = separator == "[\n";
    print(if is_empty { "[]\n" } else { "\n]\n" })?;
    Ok(ExitStatus::Success)
}

fn episode_table(rows: &[Episode]) -> Table {
    let mut table = table(["Episode", "Partner", "Goal", "Objects", "Frames", "Seed"]);
    for episode in rows {
        let setup = episode.setup();
        let partner = setup.people[0].persona;
        let goal: Vec<String> =
            setup.goal.targets.iter().map(|(c, n)| format!("{n} {c}")).collect();
        table.add_row([
            episode.id().to_owned(),
            format!("{partner:?}").to_lowercase(),
            goal.join(", "),
            setup.things.len().to_string(),
            setup.horizon.to_string(),
            episode.seed().to_string(),
        ]);
    }
    table
}

fn json_of(episode: &Episode) -> serde_json::Value {
    let setup = episode.setup();
    json!({
        "id": episode.id(),
        "task": setup.task,
        "split": episode.split(),
        "partner": setup.people[0].persona,
        "goal": setup.goal,
        "things": setup.things.len(),
        "horizon": setup.horizon,
        "seed": episode.seed(),
        "generator": episode.generator(),
    })
}

fn show(argument: &str, out: &Path, width_px: u32, format: OutputFormat) -> Result<ExitStatus> {
    let episode = super::episode(argument)?;
    frame_export::write_plan(&episode, width_px, out)?;
    let text = format!("{}: floor plan of {}\n", out.display(), episode.id());
    print_result(format, &json!({ "out": json_path(out), "episode": episode.id() }), &text)?;
    Ok(ExitStatus::Success)
}

fn generate(task: TaskId, split: &Split, out: &Path, format: OutputFormat) -> Result<ExitStatus> {
    let n = split.len_of(task);
    if n == 0 {
        let text =
            format!("{split} has no episodes of {task}, which is not the paper's; give --seeds");
        return Err(EvalError::Options(text).into());
    }
    create_folders(out)?;
    let stop = interrupt::stop_flag()?;
    let bar = bars::count_bar(n as u64, "episodes");
    for k in 0..n {
        if stop.load(Ordering::Relaxed) {
            bar.finish_and_clear();
            print_error(&how_to_continue(split, k));
            return Ok(ExitStatus::Interrupted);
        }
        let id = split.episode_id(task, k);
        let episode = find_episode(&id)?;
        let path = out.join(file_name(&id));
        write_atomically(&path, episode.to_json().as_bytes())?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    let text = format!("{}: {} of {task}\n", out.display(), counted(n, "episode"));
    print_result(format, &json!({ "out": json_path(out), "task": task, "episodes": n }), &text)?;
    Ok(ExitStatus::Success)
}

/// Returns how to continue after the first `k` episodes of a split.
fn how_to_continue(split: &Split, k: usize) -> String {
    match split {
        Split::Generated(seeds) => {
            format!("stopped; --seeds {}..{} makes the rest", seeds.start + k as u64, seeds.end)
        }
        Split::GeneratedStandard(seeds) => {
            let rest = Split::GeneratedStandard(seeds.start + k as u64..seeds.end);
            format!("stopped; --split {rest} makes the rest")
        }
        _ => format!("stopped after {}; run the same command again for all", counted(k, "episode")),
    }
}

/// Generates or reads every episode of a split and checks it like a file.
fn validate_split(split: &Split, format: OutputFormat) -> Result<ExitStatus> {
    let stop = interrupt::stop_flag()?;
    let n = TaskId::all().map(|task| split.len_of(task)).fold(0, usize::saturating_add);
    let bar = bars::count_bar(n as u64, "episodes");
    let (mut invalid, mut done) = (Vec::new(), 0);
    for (task, episode) in TaskId::all().flat_map(|t| episodes(split, t).map(move |e| (t, e))) {
        if stop.load(Ordering::Relaxed) {
            bar.finish_and_clear();
            print_error(&format!("stopped after {done} of {}", counted(n, "episode")));
            return Ok(ExitStatus::Interrupted);
        }
        let lines: Vec<String> = match &episode {
            Ok(episode) => {
                let problems = chaic_episodes::validate(episode.setup());
                problems.iter().map(|p| format!("{}: {p}", episode.id())).collect()
            }
            Err(error) => vec![format!("{task}: {error}")],
        };
        lines.iter().for_each(|line| print_error(line));
        if !lines.is_empty() {
            let id = episode.as_ref().map_or(task.name(), Episode::id);
            invalid.push(json!({ "name": id, "problems": lines }));
        }
        done += 1;
        bar.inc(1);
    }
    bar.finish_and_clear();
    let text = match invalid.len() {
        0 => format!("{split}: {} fine\n", counted(n, "episode")),
        n_bad => format!("{split}: {n_bad} of {} invalid\n", counted(n, "episode")),
    };
    let json = json!({ "split": split.to_string(), "checked": n, "invalid": invalid });
    print_result(format, &json, &text)?;
    Ok(ExitStatus::from_findings(!invalid.is_empty()))
}

fn validate(files: &[PathBuf], format: OutputFormat) -> Result<ExitStatus> {
    let (mut invalid, mut valid) = (Vec::new(), String::new());
    for path in files {
        let name = path.display().to_string();
        let parsed = match read_episode_file(path) {
            Ok(bytes) => Episode::parse(&bytes, &name).map_err(|e| lines_of(&e)),
            Err(error) => Err(vec![error.to_string()]),
        };
        match parsed {
            Ok(episode) => valid += &format!("{name}: fine ({})\n", episode.id()),
            Err(lines) => {
                lines.iter().for_each(|line| print_error(line));
                invalid.push(json!({ "name": name, "problems": lines }));
            }
        }
    }
    let n_bad = invalid.len();
    print_result(format, &json!({ "checked": files.len(), "invalid": invalid }), &valid)?;
    if n_bad > 0 {
        print_error(&format!("{n_bad} of {} can't be played", counted(files.len(), "file")));
    }
    Ok(ExitStatus::from_findings(n_bad > 0))
}

/// Returns one line per problem: file, field, problem and expectation.
fn lines_of(error: &EpisodeError) -> Vec<String> {
    match error {
        EpisodeError::Invalid { source_name, problems } => {
            problems.iter().map(|p| format!("{source_name}: {p}")).collect()
        }
        other => vec![other.to_string()],
    }
}
