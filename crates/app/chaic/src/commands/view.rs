//! `chaic view`.

use std::path::PathBuf;

use anyhow::{Result, bail};
use chaic_eval::replay::{find_trace, find_traces};
use chaic_eval::run::RunFolder;
use chaic_files::write_atomically;
use chaic_page::{page, read_replays};
use serde_json::json;

use super::llm::shown_language;
use super::traces_of_plan;
use crate::arguments::ViewArguments;
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, counted, json_path, print_result, print_warning, quoted_path};

/// Default name of the page.
const FILE_NAME: &str = "view.html";

/// Writes a page with replays of a run.
pub fn run(arguments: &ViewArguments, format: OutputFormat) -> Result<ExitStatus> {
    let ViewArguments { run, episode, out, helper, max } = arguments;
    let (folder, options) = RunFolder::read(run)?;
    let (traces, left_out) = traces_of_plan(&folder, &options)?;
    left_out.iter().for_each(|warning| print_warning(warning));
    let found = find_traces(&traces, episode.as_deref(), helper.as_deref(), None);
    if found.is_empty()
        && let Some(episode) = episode
    {
        find_trace(&folder, &traces, episode, helper.as_deref(), None)?;
    }
    let paths: Vec<PathBuf> =
        found.iter().take(*max as usize).map(|(path, _)| path.clone()).collect();
    let (replays, warnings) =
        read_replays(&folder, &options, &paths, &shown_language(folder.path()))?;
    warnings.iter().for_each(|warning| print_warning(warning));
    if replays.is_empty() {
        let helper = helper.as_ref().map_or(String::new(), |helper| format!(" with {helper}"));
        bail!("{} has no traces{helper}", run.display());
    }
    let page = page(&format!("chaic: replays of {}", run.display()), None, &replays);
    let out = out.clone().unwrap_or_else(|| folder.path().join(FILE_NAME));
    write_atomically(&out, page.as_bytes())?;
    if let Some(n @ 1..) = found.len().checked_sub(paths.len()) {
        let (replays, are) = (counted(n, "more replay"), if n == 1 { "is" } else { "are" });
        print_warning(&format!("{replays} {are} left out; see --max and --helper"));
    }
    let (n, bytes) = (replays.len(), page.len());
    let size = format!("{:.1} MB", bytes as f64 / 1e6);
    let text = format!(
        "{} of {}; open it in a browser\n",
        counted(n, "replay"),
        quoted_path(&out) + " (" + &size + ")"
    );
    let json = json!({ "out": json_path(&out), "replays": n, "bytes": bytes });
    print_result(format, &json, &text)?;
    Ok(ExitStatus::Success)
}
