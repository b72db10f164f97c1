//! What a helper's first knowledge identifies: `cargo run --release -p chaic-eval --example openings -- 100`.
//!
//! Takes the briefing and the first observation of a helper without grants, and of one with the grants
//! of planners, in all test episodes and in so many generated episodes of each task. Prints, for each
//! kind of scene, how many openings differ, which fields vary, and how well they predict the task and
//! the kind of partner.

use std::collections::BTreeMap;

use chaic_core::TaskId;
use chaic_core::observation::{Grants, Senses};
use chaic_core::task::{Origin, SceneKind};
use chaic_episodes::{Split, episodes};
use chaic_eval::audit::opening::{Opening, distinct, predict, predict_by_value, varying_fields};
use rayon::prelude::*;

/// First of the generated seeds that are looked at; no named split has them.
const FIRST_SEED: u64 = 600_000;
/// Side of the images, pixels.
const IMAGE_SIZE: u32 = 64;

fn openings(split: &Split, grants: Grants) -> Vec<Opening> {
    let senses = Senses { image_size: IMAGE_SIZE, rgb: true, depth: true, ids: false, film: None };
    let tasks: Vec<TaskId> = match split {
        Split::Generated(_) | Split::GeneratedStandard(_) => TaskId::all().collect(),
        _ => TaskId::paper().collect(),
    };
    let of_task = |task: &TaskId| -> Vec<Opening> {
        let all = episodes(split, *task).filter_map(Result::ok);
        all.filter_map(|episode| Opening::of(&episode, grants, senses).ok()).collect()
    };
    tasks.par_iter().flat_map(of_task).collect()
}

fn print(openings: &[&Opening]) {
    let n = openings.len();
    let briefings = distinct(openings, |o| o.briefing.clone());
    let seeds = distinct(openings, |o| o.briefing.get("seed").cloned());
    let with_own = distinct(openings, |o| (o.briefing.clone(), o.own.clone()));
    let with_images = distinct(openings, |o| (o.briefing.clone(), o.own.clone(), o.images));
    println!(
        "  {n} openings: {seeds} seeds, {briefings} briefings, {with_own} with the own state, \
         {with_images} with images"
    );
    type Label = fn(&Opening) -> String;
    type Fields = fn(&Opening) -> &BTreeMap<String, String>;
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
    let parts: [(&str, Fields); 2] = [("briefing", |o| &o.briefing), ("own", |o| &o.own)];
    for (part, of) in parts {
        for (field, values) in varying_fields(openings, of) {
            let value = |o: &Opening| of(o).get(&field).cloned();
            let by = labels.map(|(name, label)| {
                let found = predict_by_value(openings, value, label);
                format!("{name} {:.3} (z = {:.1})", found.accuracy, found.z())
            });
            println!("  {part}.{field}: {values} values; {}", by.join(", "));
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
                let papers =
                    |o: &&Opening| o.scene == scene && o.task.info().origin != Origin::Ours;
                println!(" {scene:?}, the paper's tasks");
                print(&all.iter().filter(papers).collect::<Vec<_>>());
                let of_scene: Vec<&Opening> = all.iter().filter(|o| o.scene == scene).collect();
                if of_scene.len() > all.iter().filter(papers).count() {
                    println!(" {scene:?}, all tasks");
                    print(&of_scene);
                }
            }
        }
    }
}
