//! `chaic scene`.

use anyhow::Result;
use chaic_gltf::{SceneOptions, Written};

use crate::arguments::SceneCommand;
use crate::exit::Ended;
use crate::output::say;

/// Writes scenes for other programs.
pub fn run(command: &SceneCommand) -> Result<Ended> {
    let SceneCommand::Export(arguments) = command;
    let episode = super::episode(&arguments.episode)?;
    let options =
        SceneOptions { detail: usize::from(arguments.detail), hide_ceiling: arguments.no_ceiling };
    let Written { instances, triangles } = chaic_gltf::write(&episode, options, &arguments.out)?;
    let (out, id) = (arguments.out.display(), episode.id());
    say(&format!("{out}: {id} in {instances} nodes with {triangles} triangles\n"))?;
    Ok(Ended::Well)
}
