//! Makes a folder of policies by task from trainings of visual policies: `cargo run --release -p
//! chaic-learn --example bundle_by_task -- TRAININGS OUT`.
//!
//! Reads `TRAININGS/TASK/policy.safetensors` of the eight tasks and writes `OUT/TASK.safetensors`,
//! with values rounded to bfloat16. `chaic eval --helper mine=policy:OUT` plays them.

use std::error::Error;
use std::path::PathBuf;

use chaic_core::TaskId;
use chaic_learn::actor_critic::ActorCritic as _;
use chaic_learn::visual::network::VisualNetwork;
use chaic_nn::weights::{kind, to_bf16};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [trainings, out] = &arguments[..] else {
        return Err("give the folder of trainings and the folder to write".into());
    };
    std::fs::create_dir_all(out)?;
    for task in TaskId::paper() {
        let path = trainings.join(task.name()).join("policy.safetensors");
        let bytes = std::fs::read(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        let kind = kind(&bytes)?;
        let model = VisualNetwork::from_kind(&kind)
            .ok_or_else(|| format!("{}: no visual policy", path.display()))?;
        let rounded = to_bf16(model.network(), &bytes, &kind)?;
        std::fs::write(out.join(format!("{task}.safetensors")), rounded)?;
    }
    Ok(())
}
