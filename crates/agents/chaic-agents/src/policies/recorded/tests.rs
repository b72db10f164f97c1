//! Promise: a recorded partner repeats the recorded interactions in their order, skips those that are no
//! longer possible, and then follows the rules.

use super::*;
use crate::test_support::{Toy, ToyObject};
use crate::{PlannerRules, PlanningAgent};

/// Returns a room with a goal place, three apples and a basket, and the tracks of the small objects.
fn room() -> (Toy, [TrackId; 4]) {
    let mut toy = Toy::room(8.0, 8.0);
    toy.add(ToyObject::new("bed", [3.3, 0.0, -1.8], [1.0, 0.5, 1.6]));
    let mut apple = |x, z| toy.add(ToyObject::new("apple", [x, 0.0, z], [0.16, 0.12, 0.16]));
    let apples = [apple(-1.0, -1.0), apple(-3.0, 3.0), apple(2.0, 3.0)];
    let basket = toy.add(ToyObject::new("wicker_basket", [-3.0, 0.0, 0.0], [0.4, 0.3, 0.4]));
    toy.stand([0.0, 0.0], 0.0);
    (toy, [apples[0], apples[1], apples[2], basket])
}

fn step(interaction: RecordedInteraction) -> RecordedStep {
    RecordedStep { interaction, n_attempts: 1, is_success: true, duration_frames: 100 }
}

/// Runs a partner that wants some apples; returns its plans and its counters.
fn run(
    toy: &mut Toy,
    n_wanted: u32,
    steps: &[RecordedInteraction],
) -> (String, BTreeMap<String, u64>) {
    let mut briefing = Briefing { horizon: 6000, ..toy.briefing() };
    briefing.goal = Toy::goal(&[("apple", n_wanted)]);
    let steps = steps.iter().copied().map(step).collect();
    let recording = Arc::new(PlanRecording { steps, digest: "0".repeat(16) });
    let mut agent = PlanningAgent::new(RecordedPolicy::new(recording), PlannerRules::paper());
    let plans = toy.run(&mut agent, &briefing);
    (plans.join("; "), agent.policy().counters())
}

#[test]
fn steps_are_repeated_in_their_order() {
    use RecordedInteraction::{PickUp, PutIn, PutOn};
    let (mut toy, [near, far, other, basket]) = room();
    // The rules fetch the basket and the nearest apple first.
    let (plans, counters) = run(
        &mut toy,
        3,
        &[PickUp(far), PutOn, PickUp(other), PickUp(basket), PutIn, PickUp(near), PutIn, PutOn],
    );
    assert_eq!(toy.delivered[0], far, "{plans}");
    assert!(toy.delivered.contains(&near) && toy.delivered.contains(&other), "{plans}");
    // The last put-on ends the episode.
    assert_eq!((counters["repeated"], counters["skipped"]), (7, 1), "{plans}");
    let position = |text: &str| plans.find(text).unwrap_or_else(|| panic!("no {text}: {plans}"));
    let order = [far, other, basket, near].map(|track| position(&track.to_string()));
    assert!(order.is_sorted(), "{plans}");
}

#[test]
fn a_step_that_is_not_possible_any_more_is_skipped() {
    use RecordedInteraction::{PickUp, PutIn, PutOn, RemoveObstacle};
    let (mut toy, [near, far, other, _]) = room();
    toy.remove(far);
    let missing = TrackId(999);
    let steps =
        [PickUp(far), PutOn, PickUp(missing), RemoveObstacle(missing), PutIn, PickUp(other)];
    let (plans, counters) = run(&mut toy, 2, &steps);
    assert_eq!((counters["skipped"], counters["repeated"]), (5, 1), "{plans}");
    // The rules deliver what the recording lacks.
    assert!(toy.delivered.contains(&near) && toy.delivered.contains(&other), "{plans}");
}
