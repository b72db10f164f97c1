//! `chaic play`.

use anyhow::Result;
use chaic_agents::HELPERS;
use chaic_core::TaskId;
use chaic_env::helper_registry::NONE;
use chaic_episodes::{Episode, find_episode};
use chaic_files::write_atomically;
use chaic_page::play_page;
use serde_json::json;

use crate::arguments::PlayArguments;
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, counted, json_path, print_result, quoted_path};

/// Helper that is selected when the page opens.
const FIRST_HELPER: &str = "infer";

/// Writes a page in which a person plays.
pub fn run(arguments: &PlayArguments, format: OutputFormat) -> Result<ExitStatus> {
    let PlayArguments { episodes, out } = arguments;
    let default = || TaskId::paper().map(|task| format!("{task}/test/00")).collect();
    let ids: Vec<String> = if episodes.is_empty() { default() } else { episodes.clone() };
    let episodes: Result<Vec<Episode>, _> = ids.iter().map(|id| find_episode(id)).collect();
    let others = HELPERS.iter().map(|helper| helper.name).filter(|name| *name != FIRST_HELPER);
    let helpers: Vec<&str> = [FIRST_HELPER, NONE].into_iter().chain(others).collect();
    let page = play_page("chaic: play", &episodes?, &helpers);
    write_atomically(out, page.as_bytes())?;
    let size = format!("{:.1} MB", page.len() as f64 / 1e6);
    let (n, path) = (counted(ids.len(), "episode"), quoted_path(out));
    let text = format!("{n} in {path} ({size}); open it in a browser\n");
    let json = json!({ "out": json_path(out), "episodes": ids, "bytes": page.len() });
    print_result(format, &json, &text)?;
    Ok(ExitStatus::Success)
}
