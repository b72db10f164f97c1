//! `chaic episodes`.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result};
use chaic_episodes::{Episode, EpisodeError, Split, episodes, find_episode, json_schema};
use chaic_eval::files::{read_episode_file, write_whole};
use chaic_eval::still;
use chaic_protocol::TaskId;
use comfy_table::{ContentArrangement, Table, presets};
use serde_json::json;

use super::bars;
use crate::arguments::{EpisodesCommand, ListFormat};
use crate::exit::Ended;
use crate::interrupt;
use crate::output::{complain, counted, say, say_to_reader};

/// Lists, shows, makes or checks episodes.
pub fn run(command: &EpisodesCommand) -> Result<Ended> {
    match command {
        EpisodesCommand::List { split, task, format } => list(split, &task.0, *format),
        EpisodesCommand::Show { episode, out, width } => show(episode, out, *width),
        EpisodesCommand::Generate { task, seeds, out } => generate(*task, seeds.clone(), out),
        EpisodesCommand::Validate { files } => validate(files),
        EpisodesCommand::Schema => {
            say(&(serde_json::to_string_pretty(&json_schema())? + "\n"))?;
            Ok(Ended::Well)
        }
    }
}

/// Episodes of one table; a longer list is several, so that none waits for those after it.
const ROWS: usize = 96;

/// Prints while it goes: a split may have more episodes than memory holds, or than anybody reads.
fn list(split: &Split, tasks: &[TaskId], format: ListFormat) -> Result<Ended> {
    let mut listed = tasks.iter().flat_map(|task| episodes(split, *task));
    match format {
        ListFormat::Table => loop {
            let rows: Vec<Episode> = listed.by_ref().take(ROWS).collect::<Result<_, _>>()?;
            if rows.is_empty() || !say_to_reader(&(table(&rows).trim_fmt() + "\n"))? {
                break;
            }
        },
        ListFormat::Json => {
            let mut before = "[\n";
            for episode in listed {
                let text = serde_json::to_string_pretty(&json_of(&episode?))?;
                let text = text.replace('\n', "\n  ");
                if !say_to_reader(&format!("{before}  {text}"))? {
                    return Ok(Ended::Well);
                }
                before = ",\n";
            }
            say("\n]\n")?;
        }
    }
    Ok(Ended::Well)
}

fn table(rows: &[Episode]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_FULL_CONDENSED);
    table.set_content_arrangement(ContentArrangement::Disabled);
    table.set_header(["Episode", "Partner", "Goal", "Things", "Frames", "Seed"]);
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

fn show(argument: &str, out: &Path, width_px: u32) -> Result<Ended> {
    let episode = super::episode(argument)?;
    still::write_plan(&episode, width_px, out)?;
    say(&format!("{}: the map of {}\n", out.display(), episode.id()))?;
    Ok(Ended::Well)
}

fn generate(task: TaskId, seeds: Range<u64>, out: &Path) -> Result<Ended> {
    std::fs::create_dir_all(out)
        .with_context(|| format!("can't make the folder {}", out.display()))?;
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let bar = bars::plain(seeds.end - seeds.start, "episodes");
    for seed in seeds.clone() {
        if stop.load(Ordering::Relaxed) {
            bar.finish_and_clear();
            complain(&format!("stopped; --seeds {seed}..{} makes the rest", seeds.end));
            return Ok(Ended::Interrupted);
        }
        let episode = find_episode(&format!("{task}/gen/{seed}"))?;
        let path = out.join(format!("{task}-{seed}.json"));
        write_whole(&path, episode.to_json().as_bytes())?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    let n = counted((seeds.end - seeds.start) as usize, "episode");
    say(&format!("{}: {n} of {task}\n", out.display()))?;
    Ok(Ended::Well)
}

fn validate(files: &[PathBuf]) -> Result<Ended> {
    let mut n_bad = 0;
    for path in files {
        let name = path.display().to_string();
        let parsed = match read_episode_file(path) {
            Ok(bytes) => Episode::parse(&bytes, &name).map_err(|e| lines_of(&e)),
            Err(error) => Err(vec![error.to_string()]),
        };
        match parsed {
            Ok(episode) => say(&format!("{name}: fine ({})\n", episode.id()))?,
            Err(lines) => {
                n_bad += 1;
                lines.iter().for_each(|line| complain(line));
            }
        }
    }
    if n_bad > 0 {
        complain(&format!("{n_bad} of {} can't be played", counted(files.len(), "file")));
        return Ok(Ended::WithFindings);
    }
    Ok(Ended::Well)
}

/// A line for each problem: file, field, what is wrong and what was expected.
fn lines_of(error: &EpisodeError) -> Vec<String> {
    match error {
        EpisodeError::Invalid { source_name, problems } => {
            problems.iter().map(|p| format!("{source_name}: {p}")).collect()
        }
        other => vec![other.to_string()],
    }
}
