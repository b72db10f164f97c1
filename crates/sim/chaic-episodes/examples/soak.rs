//! Generates and checks many episodes: `cargo run --release -p chaic-episodes --example soak --
//! 1000`, and `-- 1000 standard` with the settings of the standard split.
//!
//! Generates this number of seeds for every task. Each episode must be valid, be read back equal
//! from its file, and be the same when generated again. Prints statistics of the episodes.

use std::collections::BTreeMap;
use std::time::Instant;

use chaic_core::{Role, TaskId};
use chaic_episodes::house::House;
use chaic_episodes::{Episode, Settings, Split, episodes};
use chaic_world::RoomKind;

/// Prints the outcomes of attempts at houses, and the number of low slots per house.
fn houses(n: u64, settings: Settings) {
    let mut results: BTreeMap<&str, u32> = BTreeMap::new();
    let mut places: BTreeMap<usize, u32> = BTreeMap::new();
    let mut max_attempts = 0;
    for seed in 0..n {
        for attempt in 0..u64::MAX {
            let house = House::attempt(seed, settings, attempt);
            *results
                .entry(house.as_ref().map_or_else(|reason| *reason, |_| "valid"))
                .or_default() += 1;
            if let Ok(house) = house {
                *places.entry(house.n_low_slots() / 10 * 10).or_default() += 1;
                max_attempts = max_attempts.max(attempt + 1);
                break;
            }
        }
    }
    println!("attempts at houses, at most {max_attempts} for one: {results:?}");
    println!("houses by number of low slots: {places:?}");
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let n: u64 = std::env::args().nth(1).map_or(Ok(100), |n| n.parse())?;
    let mut failures = 0;
    let settings = match std::env::args().nth(2).as_deref() {
        None => Settings::PAPER,
        Some("standard") => Settings::STANDARD,
        Some(other) => {
            return Err(format!("no settings `{other}`; write standard or omit it").into());
        }
    };
    houses(n, settings);
    let mut rooms: BTreeMap<usize, u32> = BTreeMap::new();
    let mut hosts: BTreeMap<&str, u32> = BTreeMap::new();
    for task in TaskId::all() {
        let (mut things, mut targets, mut bytes, mut containers) = (0, 0, 0, 0);
        let (mut spent, mut slowest) = (0.0f64, 0.0f64);
        let mut parse_spent = 0.0;
        for seed in 0..n {
            let start = Instant::now();
            let split = match settings {
                Settings::STANDARD => Split::GeneratedStandard(seed..seed + 1),
                _ => Split::Generated(seed..seed + 1),
            };
            let episode = episodes(&split, task).next();
            let elapsed_s = start.elapsed().as_secs_f64();
            spent += elapsed_s;
            slowest = slowest.max(elapsed_s);
            let episode = match episode {
                Some(Ok(episode)) => episode,
                Some(Err(e)) => {
                    failures += 1;
                    println!("{e}");
                    continue;
                }
                None => continue,
            };
            let start = Instant::now();
            let json = episode.to_json();
            match Episode::parse(json.as_bytes(), episode.id()) {
                Ok(again) if again == episode => {}
                Ok(_) => {
                    failures += 1;
                    println!("{}: differs when read from its file", episode.id());
                }
                Err(e) => {
                    failures += 1;
                    println!("{e}");
                }
            }
            parse_spent += start.elapsed().as_secs_f64();
            let setup = episode.setup();
            if seed % 50 == 0
                && chaic_episodes::generate_with(
                    task,
                    chaic_episodes::GeneratorSeeds { place: seed, episode: seed },
                    settings,
                )
                .as_ref()
                    != Ok(setup)
            {
                failures += 1;
                println!("{}: differs when generated again", episode.id());
            }
            bytes += episode.to_json_line().len();
            things += setup.things.len();
            targets += setup.goal.total();
            let is_container =
                |t: &&chaic_world::ObjectSpec| t.class.info().role == Role::Container;
            containers += setup.things.iter().filter(is_container).count();
            if task == TaskId::NoConstraint {
                let named = setup.rooms.iter().filter(|r| r.kind != RoomKind::Outdoors).count();
                *rooms.entry(named).or_default() += 1;
                for object in setup.things.iter().filter(|t| t.fixed) {
                    *hosts.entry(object.class.name()).or_default() += 1;
                }
            }
        }
        let each = |x: f64| x / n as f64;
        println!(
            "{task:>14}: {:.1} ms (slowest {:.0}), checked in {:.1} ms, {:.1} things, {:.2} targets, \
             {:.1} containers, {:.0} bytes",
            1e3 * each(spent),
            1e3 * slowest,
            1e3 * each(parse_spent),
            each(things as f64),
            each(f64::from(targets)),
            each(containers as f64),
            each(bytes as f64),
        );
    }
    println!("rooms: {rooms:?}");
    for (class, count) in hosts {
        println!("  {class}: {:.2} per house", f64::from(count) / n as f64);
    }
    if failures == 0 { Ok(()) } else { Err(format!("{failures} failures").into()) }
}
