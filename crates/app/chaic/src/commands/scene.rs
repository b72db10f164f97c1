//! `chaic scene`.

use anyhow::Result;
use chaic_gltf::{SceneOptions, SceneSummary};
use serde_json::json;

use crate::arguments::SceneCommand;
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, print_result};

/// Exports scenes for other programs.
pub fn run(command: &SceneCommand, format: OutputFormat) -> Result<ExitStatus> {
    let SceneCommand::Export(arguments) = command;
    let episode = super::episode(&arguments.episode)?;
    let options =
        SceneOptions { detail: usize::from(arguments.detail), hide_ceiling: arguments.no_ceiling };
    let SceneSummary { instances, triangles } =
        chaic_gltf::write(&episode, options, &arguments.out)?;
    let (out, id) = (arguments.out.display().to_string(), episode.id());
    let text = format!("{out}: {id} in {instances} nodes with {triangles} triangles\n");
    let json = json!({ "out": out, "episode": id, "nodes": instances, "triangles": triangles });
    print_result(format, &json, &text)?;
    Ok(ExitStatus::Success)
}
