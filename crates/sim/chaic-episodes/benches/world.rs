//! Frames per second of the world alone, with two random agents: `cargo bench -p chaic-episodes
//! --bench world`. One iteration is a whole episode.

use std::hint::black_box;

use chaic_core::rng::RngStream;
use chaic_core::{Action, EntityId, Hand, ResolvedAction};
use chaic_episodes::find_episode;
use chaic_world::{Rules, Setup, World};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// Draws an action: half of all actions are steps, a quarter turns, and the others interactions
/// with objects of the episode.
fn any_action(rng: &mut RngStream, n_objects: usize) -> ResolvedAction {
    let hand = if rng.chance(0.5) { Hand::Left } else { Hand::Right };
    let object = |rng: &mut RngStream| -> EntityId { Setup::entity(rng.below(n_objects)) };
    match rng.below(16) {
        0..8 => Action::MoveForward,
        8..10 => Action::TurnLeft,
        10..12 => Action::TurnRight,
        12 => Action::PickUp { object: object(rng), hand },
        13 => Action::PutOn { place: object(rng), hand },
        14 => Action::RemoveObstacle { obstacle: object(rng), hand },
        _ => Action::PutIn,
    }
}

/// Plays an episode to the end; returns the number of actions.
fn play(mut world: World) -> u64 {
    let mut rng = RngStream::new(7, "bench", 0);
    let n_objects = world.setup().things.len();
    let mut n_actions = 0;
    while !world.is_over() {
        for agent in world.waiting() {
            world.submit(agent, any_action(&mut rng, n_objects)).expect("the agent is free");
            n_actions += 1;
        }
        world.advance();
        world.drain_events();
    }
    n_actions
}

fn frames(c: &mut Criterion) {
    let mut group = c.benchmark_group("frames");
    for id in ["no_constraint/test/00", "obstacle/test/00", "moving_house/test/00"] {
        let episode = find_episode(id).expect("it is bundled");
        let mut setup = episode.setup().clone();
        setup.people.truncate(2);
        group.throughput(Throughput::Elements(u64::from(setup.horizon)));
        let world = World::new(setup, Rules::paper()).expect("bundled episodes are valid");
        group.bench_function(id, |b| b.iter(|| black_box(play(world.clone()))));
    }
    group.finish();
}

criterion_group!(benches, frames);
criterion_main!(benches);
