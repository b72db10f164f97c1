//! Promise: equal setups and actions lead to equal digests, on any thread and after restoring a
//! snapshot.

use crate::common::*;
use chaic_core::action::{Action, Hand};
use chaic_core::capability::Persona;
use chaic_core::rng::RngStream;
use chaic_world::{Setup, Snapshot, SnapshotError, World};

fn busy_hall() -> Setup {
    let table = thing("dining_table", at(0.0, 0.0, 0.0));
    let top = chaic_world::top_surfaces(&table)[0].center.y;
    let mut things = vec![table, thing("wood_basket", at(1.5, 0.0, 0.5))];
    things.extend((0..5).map(|i| thing("orange", at(-0.4 + 0.2 * i as f32, top, 0.2))));
    hall(things, vec![person(Persona::Child, -1.0, 1.0), person(Persona::Helper, 1.0, 1.0)])
}

/// Submits random actions for all agents until frame `until`; returns the digests after each step.
fn play(world: &mut World, actions: &mut RngStream, until: u32) -> Vec<u64> {
    let mut digests = Vec::new();
    while !world.is_over() && world.state().frame < until {
        for agent in world.waiting() {
            let object = nth(actions.below(7));
            let hand = if actions.chance(0.5) { Hand::Left } else { Hand::Right };
            let action = match actions.below(8) {
                0..3 => Action::MoveForward,
                3 => Action::TurnLeft,
                4 => Action::TurnRight,
                5 => Action::PickUp { object, hand },
                6 => Action::PutOn { place: nth(0), hand },
                _ => Action::PutIn,
            };
            world.submit(agent, action).unwrap();
        }
        world.advance();
        digests.push(world.digest());
    }
    digests
}

#[test]
fn equal_actions_lead_to_equal_digests_on_every_thread() {
    let run = || play(&mut world(busy_hall()), &mut RngStream::new(5, "actions", 0), 3000);
    let expected = run();
    assert!(expected.len() > 100);
    let threads: Vec<_> = (0..4).map(|_| std::thread::spawn(run)).collect();
    for thread in threads {
        assert_eq!(thread.join().unwrap(), expected);
    }
}

#[test]
fn a_restored_world_continues_to_the_same_digests() {
    let mut actions = RngStream::new(5, "actions", 0);
    let mut w = world(busy_hall());
    play(&mut w, &mut actions, 1000);
    let snapshot = w.snapshot();
    let expected = play(&mut w, &mut actions.clone(), 3000);
    let mut other = world(busy_hall());
    other.restore(&snapshot).unwrap();
    assert_eq!(other.snapshot(), snapshot);
    assert_eq!(play(&mut other, &mut actions, 3000), expected);
}

#[test]
fn a_snapshot_of_another_setup_is_refused() {
    let mut w = world(busy_hall());
    let digest = w.digest();
    let other = world(hall(vec![], vec![person(Persona::Adult, 0.0, 0.0)])).snapshot();
    assert!(matches!(w.restore(&other), Err(SnapshotError::OtherSetup { .. })));
    let broken = Snapshot(w.snapshot().0[..20].to_vec());
    assert!(matches!(w.restore(&broken), Err(SnapshotError::Unreadable(_))));
    assert_eq!(w.digest(), digest, "the world is unchanged");
}
