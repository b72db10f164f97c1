//! Information in a helper's first observation: `cargo run --release -p chaic-eval --example
//! openings -- 100`.
//!
//! Collects the briefing and the first observation of a helper without grants, and of one with the
//! grants of planners. Uses all test episodes, and as many generated episodes of each task as the
//! argument says. For each scene kind, prints how many openings differ, which fields vary, and how
//! well they predict the task and the partner's kind.

use std::collections::BTreeMap;

use chaic_core::TaskId;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::task::{SceneKind, TaskOrigin};
use chaic_episodes::{Split, episodes};
use chaic_eval::audit::opening::{
    InitialInformation, distinct, predict, predict_by_value, varying_fields,
};
use rayon::prelude::*;

/// First generated seed; no named split has it.
const FIRST_SEED: u64 = 600_000;
/// Side of the images, pixels.
const IMAGE_SIZE: u32 = 64;

fn openings(split: &Split, grants: Grants) -> Vec<InitialInformation> {
    let sensors = SensorConfig {
        image_size: IMAGE_SIZE,
        rgb: true,
        depth: true,
        ids: false,
        frame_history: None,
    };
    let tasks: Vec<TaskId> = match split {
        Split::Generated(_) | Split::GeneratedStandard(_) => TaskId::all().collect(),
        _ => TaskId::paper().collect(),
    };
    let task_openings = |task: &TaskId| -> Vec<InitialInformation> {
        let all = episodes(split, *task).filter_map(Result::ok);
        all.filter_map(|episode| InitialInformation::new(&episode, grants, sensors).ok()).collect()
    };
    tasks.par_iter().flat_map(task_openings).collect()
}

fn print(openings: &[&InitialInformation]) {
    let n = openings.len();
    let briefings = distinct(openings, |o| o.briefing.clone());
    let seeds = distinct(openings, |o| o.briefing.get("seed").cloned());
    let with_proprioception =
        distinct(openings, |o| (o.briefing.clone(), o.proprioception.clone()));
    let with_images =
        distinct(openings, |o| (o.briefing.clone(), o.proprioception.clone(), o.images));
    println!(
        "  {n} openings: {seeds} seeds, {briefings} briefings, {with_proprioception} with proprioception, \
         {with_images} with images"
    );
    type Label = fn(&InitialInformation) -> String;
    type Fields = fn(&InitialInformation) -> &BTreeMap<String, String>;
    let labels: [(&str, Label); 2] =
        [("task", |o| o.task.to_string()), ("partner", |o| o.partner.to_string())];
    for (name, label) in labels {
        let found = predict(openings, label);
        println!(
            "  {name} from the start pose: {:.3}, by chance {:.3} (z = {:.1})",
            found.accuracy,
            found.chance,
            found.z()
        );
    }
    let parts: [(&str, Fields); 2] =
        [("briefing", |o| &o.briefing), ("proprioception", |o| &o.proprioception)];
    for (part, fields) in parts {
        for (field, values) in varying_fields(openings, fields) {
            let value = |o: &InitialInformation| fields(o).get(&field).cloned();
            let accuracies = labels.map(|(name, label)| {
                let found = predict_by_value(openings, value, label);
                format!("{name} {:.3} (z = {:.1})", found.accuracy, found.z())
            });
            println!("  {part}.{field}: {values} values; {}", accuracies.join(", "));
        }
    }
}

fn main() {
    let n = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(50);
    let generated = FIRST_SEED..FIRST_SEED + n;
    let splits =
        [Split::Test, Split::Generated(generated.clone()), Split::GeneratedStandard(generated)];
    for split in splits {
        for (name, grants) in [("no grants", Grants::NONE), ("planner's grants", Grants::PLANNER)] {
            println!("{split}, {name}");
            let all = openings(&split, grants);
            for scene in [SceneKind::House, SceneKind::Street, SceneKind::Yard] {
                let is_paper_task = |o: &&InitialInformation| {
                    o.scene == scene && o.task.info().origin != TaskOrigin::Chaic
                };
                println!(" {scene:?}, the paper's tasks");
                print(&all.iter().filter(is_paper_task).collect::<Vec<_>>());
                let scene_openings: Vec<&InitialInformation> =
                    all.iter().filter(|o| o.scene == scene).collect();
                if scene_openings.len() > all.iter().filter(is_paper_task).count() {
                    println!(" {scene:?}, all tasks");
                    print(&scene_openings);
                }
            }
        }
    }
}
