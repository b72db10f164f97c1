//! `chaic render`.

use anyhow::Result;
use chaic_env::helper_registry::BuiltInHelpers;
use chaic_env::rules::RuleSet;
use chaic_eval::frame_export::{self, FrameExport};
use serde_json::json;

use crate::arguments::RenderArguments;
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, json_path, print_result};

/// Renders one frame of an episode.
pub fn run(arguments: &RenderArguments, format: OutputFormat) -> Result<ExitStatus> {
    let RenderArguments { episode, agent, frame, out, size, helper, seed, rules, appearance } =
        arguments;
    let episode = super::episode(episode)?;
    let export = FrameExport {
        episode: &episode,
        helper,
        seed: *seed,
        rules: RuleSet::named(*rules),
        agent: *agent,
        frame: *frame,
        size: *size,
        appearance: *appearance,
    };
    let rendered = frame_export::write(&export, &BuiltInHelpers, out)?;
    let id = episode.id();
    let text = format!("{}: view of the {agent} in {id} at frame {rendered}\n", out.display());
    let json = json!({
        "out": json_path(out), "episode": id, "agent": agent.role_name(), "frame": rendered,
    });
    print_result(format, &json, &text)?;
    Ok(ExitStatus::Success)
}
