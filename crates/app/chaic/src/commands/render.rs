//! `chaic render`.

use anyhow::Result;
use chaic_env::minds::BuiltIn;
use chaic_env::rules::RuleSet;
use chaic_eval::frame_export::{self, FrameExport};

use crate::arguments::RenderArguments;
use crate::exit::Ended;
use crate::output::say;

/// Makes pictures of one moment.
pub fn run(arguments: &RenderArguments) -> Result<Ended> {
    let RenderArguments { episode, agent, frame, out, size, helper, seed, rules, appearance } =
        arguments;
    let episode = super::episode(episode)?;
    let rules = RuleSet::named(*rules);
    let (agent, frame, size, seed) = (*agent, *frame, *size, *seed);
    let still = FrameExport {
        episode: &episode,
        helper,
        seed,
        rules,
        agent,
        frame,
        size,
        appearance: *appearance,
    };
    let shown = frame_export::write(&still, &BuiltIn, out)?;
    let id = episode.id();
    say(&format!("{}: what the {agent} sees of {id} at frame {shown}\n", out.display()))?;
    Ok(Ended::Well)
}
