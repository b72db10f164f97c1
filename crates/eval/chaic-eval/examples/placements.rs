//! Measures what the heights of objects reveal about the goal: `cargo run --release -p chaic-eval
//! --example placements -- 300`.
//!
//! For each indoor task, prints the share of wanted classes among the possible targets on the floor,
//! on furniture, and above the reach of a child. Uses as many generated episodes of each task as the
//! argument says, with the settings of the standard split.

use chaic_core::TaskId;
use chaic_core::task::{SceneKind, TaskOrigin};
use chaic_episodes::{Split, episodes};

/// First generated seed; no named split has it.
const FIRST_SEED: u64 = 600_000;
/// Upper limits of the bands of heights, meters: objects on the floor, and the reach of a child.
const BANDS: [(&str, f32); 3] = [("floor", 0.25), ("furniture", 1.5), ("high", f32::INFINITY)];

fn main() {
    let n = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(50);
    let split = Split::GeneratedStandard(FIRST_SEED..FIRST_SEED + n);
    let is_indoors = |task: &TaskId| {
        let info = task.info();
        info.scene == SceneKind::House && info.origin != TaskOrigin::Chaic
    };
    for task in TaskId::paper().filter(is_indoors) {
        // Numbers of objects in each band: all, and those of wanted classes.
        let mut counts = [[0_u32; 2]; BANDS.len()];
        for episode in episodes(&split, task).filter_map(Result::ok) {
            let setup = episode.setup();
            for thing in setup.things.iter().filter(|t| t.class.info().is_possible_target()) {
                let top_m = thing.position.y + thing.size_m().y;
                let band = BANDS.iter().position(|(_, limit)| top_m <= *limit).unwrap_or(0);
                counts[band][0] += 1;
                counts[band][1] += u32::from(setup.goal.count(thing.class) > 0);
            }
        }
        let share = |([all, wanted], (name, _)): (&[u32; 2], &(&str, f32))| {
            format!("{name} {:.2} of {all}", *wanted as f32 / (*all).max(1) as f32)
        };
        let bands: Vec<String> = counts.iter().zip(&BANDS).map(share).collect();
        println!("{task}: {}", bands.join(", "));
    }
}
