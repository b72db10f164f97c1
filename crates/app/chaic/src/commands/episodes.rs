//! `chaic episodes`.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result, bail};
use chaic_core::TaskId;
use chaic_episodes::{Episode, EpisodeError, Split, episodes, find_episode, json_schema};
use chaic_eval::frame_export;
use chaic_eval::read_episode_file;
use chaic_files::write_whole;
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
        EpisodesCommand::Generate { task, seeds, split, out } => {
            let of_seeds = seeds.clone().map(Split::Generated);
            let split = of_seeds.or(split.clone()).context("give --seeds or --split")?;
            generate(*task, &split, out)
        }
        EpisodesCommand::Validate { split: Some(split), .. } => validate_split(split),
        EpisodesCommand::Validate { files, .. } => validate(files),
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
    frame_export::write_plan(&episode, width_px, out)?;
    say(&format!("{}: the map of {}\n", out.display(), episode.id()))?;
    Ok(Ended::Well)
}

fn generate(task: TaskId, split: &Split, out: &Path) -> Result<Ended> {
    std::fs::create_dir_all(out)
        .with_context(|| format!("can't make the folder {}", out.display()))?;
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let n = split.len_of(task);
    if n == 0 {
        bail!("{split} has no episodes of {task}, which is not the paper's; give --seeds");
    }
    let bar = bars::plain(n as u64, "episodes");
    for k in 0..n {
        if stop.load(Ordering::Relaxed) {
            bar.finish_and_clear();
            complain(&rest(split, k));
            return Ok(Ended::Interrupted);
        }
        let id = split.episode_id(task, k);
        let episode = find_episode(&id)?;
        // `obstacle/gen/7` is written to `obstacle-7.json`, and `obstacle/standard/007` to
        // `obstacle-standard-007.json`.
        let name = id.replace("/gen/", "-").replace('/', "-");
        let path = out.join(format!("{name}.json"));
        write_whole(&path, episode.to_json().as_bytes())?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    say(&format!("{}: {} of {task}\n", out.display(), counted(n, "episode")))?;
    Ok(Ended::Well)
}

/// How to go on after the first `k` episodes of a split.
fn rest(split: &Split, k: usize) -> String {
    match split {
        Split::Generated(seeds) => {
            format!("stopped; --seeds {}..{} makes the rest", seeds.start + k as u64, seeds.end)
        }
        Split::GeneratedStandard(seeds) => {
            let rest = Split::GeneratedStandard(seeds.start + k as u64..seeds.end);
            format!("stopped; --split {rest} makes the rest")
        }
        _ => format!("stopped after {}; begin again to have all", counted(k, "episode")),
    }
}

/// Makes or reads every episode of a split and checks it as a file would be.
fn validate_split(split: &Split) -> Result<Ended> {
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let n = TaskId::all().map(|task| split.len_of(task)).fold(0, usize::saturating_add);
    let bar = bars::plain(n as u64, "episodes");
    let (mut n_bad, mut done) = (0, 0);
    for (task, episode) in TaskId::all().flat_map(|t| episodes(split, t).map(move |e| (t, e))) {
        if stop.load(Ordering::Relaxed) {
            bar.finish_and_clear();
            complain(&format!("stopped after {done} of {n} episodes"));
            return Ok(Ended::Interrupted);
        }
        let lines: Vec<String> = match &episode {
            Ok(episode) => {
                let problems = chaic_episodes::validate(episode.setup());
                problems.iter().map(|p| format!("{}: {p}", episode.id())).collect()
            }
            Err(error) => vec![format!("{task}: {error}")],
        };
        n_bad += usize::from(!lines.is_empty());
        lines.iter().for_each(|line| complain(line));
        done += 1;
        bar.inc(1);
    }
    bar.finish_and_clear();
    if n_bad > 0 {
        complain(&format!(
            "{n_bad} of {} of {split} aren't as they should be",
            counted(n, "episode")
        ));
        return Ok(Ended::WithFindings);
    }
    say(&format!("{split}: {} fine\n", counted(n, "episode")))?;
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
