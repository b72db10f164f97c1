//! Objects that a person put away, from earlier interactions.

use chaic_agents::TrackId;
use chaic_agents::memory::ActionRecord;
use chaic_core::{Action, ClassId, Outcome, Role};

/// For each interaction, oldest first, returns the object that was put down or into a container, if
/// known.
pub(super) fn put_away(
    history: &[ActionRecord],
    class_of: impl Fn(TrackId) -> Option<ClassId>,
) -> Vec<Option<TrackId>> {
    let mut hands: [Option<TrackId>; 2] = [None; 2];
    let is_container = |track: TrackId| {
        let role = class_of(track).map(|class| class.info().role);
        matches!(role, Some(Role::Container | Role::Vehicle))
    };
    let put = |record: &ActionRecord| {
        let from = match record.action {
            Action::PutOn { hand, .. } => Some(hand.index()),
            Action::PutIn => hands.iter().position(|held| held.is_some_and(|e| !is_container(e))),
            _ => None,
        };
        let object_put = from.and_then(|k| hands[k]);
        if record.outcome == Outcome::Success {
            if let Action::PickUp { hand, object } = record.action {
                hands[hand.index()] = Some(object);
            } else if let Some(from) = from {
                hands[from] = None;
            }
        }
        object_put
    };
    history.iter().map(put).collect()
}

#[cfg(test)]
mod tests {
    use chaic_core::action::Hand;

    use super::*;

    #[test]
    fn the_object_put_away_is_the_one_picked_up_by_that_hand() {
        let [apple, plate, bed] = [20, 21, 22].map(TrackId);
        let class_of = |e| {
            let name = if e == apple { "apple" } else { "plate" };
            (e != bed).then(|| ClassId::named(name))
        };
        let done = |action, outcome| ActionRecord { frame: 0, action, outcome };
        let good = Outcome::Success;
        let failed = Outcome::Failure(chaic_core::action::FailureReason::OutOfReach);
        let take = |hand, object| Action::PickUp { hand, object };
        let put = |hand| Action::PutOn { hand, place: bed };
        let history = [
            done(take(Hand::Left, apple), good),
            done(put(Hand::Left), failed),
            done(put(Hand::Left), good),
            done(put(Hand::Left), failed),
            done(take(Hand::Right, plate), good),
            done(take(Hand::Left, apple), good),
            done(Action::PutIn, good),
            done(put(Hand::Left), failed),
            done(put(Hand::Right), good),
        ];
        let expected =
            [None, Some(apple), Some(apple), None, None, None, Some(apple), None, Some(plate)];
        assert_eq!(put_away(&history, class_of), expected);
    }
}
