//! Objects in the agent's own hands, inferred from its own actions.

use chaic_core::capability::Gait;
use chaic_core::observation::{HeldObject, Proprioception};
use chaic_core::{Action, ClassId, Hand, Outcome};

use crate::track::{CarriedObject, Hands, Intent, TrackId};

/// Track of the vehicle that a rider holds from the start, whose entity id is not granted.
const OWN_VEHICLE: TrackId = TrackId(u32::MAX);

/// Infers the objects in the hands without a grant. The result is the previous state, changed by
/// the completed action as far as it agrees with the sensed hands.
pub fn infer_held_objects(
    before: &Hands,
    own: &Proprioception,
    last: Option<(Intent, Outcome)>,
    gait: Gait,
    class_of: impl Fn(TrackId) -> Option<ClassId>,
) -> Hands {
    let completed = last.filter(|(_, outcome)| outcome.is_success()).map(|(action, _)| action);
    let taken = match completed {
        Some(Action::PickUp { object, .. }) => class_of(object).map(|class| (object, class)),
        _ => None,
    };
    let carried = |hand: Hand| {
        let sensed: &HeldObject = own.hands[hand.index()].as_ref()?;
        let n_contents = sensed.n_contents;
        let Some(held) = before.hands[hand.index()].clone() else {
            let holds_bike = gait == Gait::WalkBike && hand == Hand::Left;
            let bike = || Some((OWN_VEHICLE, ClassId::from_name("bike")?));
            let object = if holds_bike { bike() } else { taken };
            return Some(CarriedObject { object, contents: Vec::new(), n_contents });
        };
        let mut contents = held.contents;
        if n_contents > held.n_contents {
            let stowed = match completed {
                Some(Action::PutIn) => {
                    before.hands[hand.other().index()].as_ref().and_then(|other| other.object)
                }
                _ => taken,
            };
            contents.extend(stowed);
        }
        contents.truncate(n_contents as usize);
        Some(CarriedObject { contents, n_contents, ..held })
    };
    Hands {
        hands: Hand::BOTH.map(carried),
        is_joint: own.hands.iter().flatten().any(|held| held.in_both_hands),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensed(n_contents: u32) -> Option<HeldObject> {
        Some(HeldObject { n_contents, in_both_hands: false, identity: None })
    }

    /// Sequence of actions: the sensed hands after each action, and the expected knowledge.
    #[test]
    fn picked_up_stowed_and_put_down_objects_are_inferred() {
        let (apple, basket, bed) = (TrackId(1), TrackId(2), TrackId(3));
        let name = |track| if track == basket { "wicker_basket" } else { "apple" };
        let class_of = |track| ClassId::from_name(name(track));
        let take = |object, hand| Action::PickUp { object, hand };
        let steps: [(Intent, [Option<HeldObject>; 2], &str); 6] = [
            (take(basket, Hand::Left), [sensed(0), None], "#2[], -"),
            (take(apple, Hand::Right), [sensed(0), sensed(0)], "#2[], #1[]"),
            (Action::PutIn, [sensed(1), None], "#2[#1], -"),
            (take(apple, Hand::Right), [sensed(1), sensed(0)], "#2[#1], #1[]"),
            (Action::PutOn { place: bed, hand: Hand::Left }, [None, sensed(0)], "-, #1[]"),
            (Action::PutOn { place: bed, hand: Hand::Right }, [None, None], "-, -"),
        ];
        let mut hands = Hands::default();
        for (action, own, expected) in steps {
            let own = Proprioception {
                pose: Default::default(),
                hands: own,
                last: None,
                other_end: None,
            };
            let last = Some((action, Outcome::Success));
            hands = infer_held_objects(&hands, &own, last, Gait::Walk, class_of);
            let text = |c: &Option<CarriedObject>| match c {
                None => "-".to_owned(),
                Some(c) => {
                    let inside: Vec<String> =
                        c.contents.iter().map(|(t, _)| t.to_string()).collect();
                    let object = c.object.map_or("?".to_owned(), |(t, _)| t.to_string());
                    format!("{object}[{}]", inside.join(" "))
                }
            };
            assert_eq!(hands.hands.iter().map(text).collect::<Vec<_>>().join(", "), expected);
        }
    }

    #[test]
    fn an_object_that_was_not_seen_when_taken_is_held_but_unidentified() {
        let own = Proprioception {
            pose: Default::default(),
            hands: [sensed(0), sensed(2)],
            last: None,
            other_end: None,
        };
        let hands = infer_held_objects(&Hands::default(), &own, None, Gait::WalkBike, |_| None);
        assert_eq!(
            hands.hands[0].as_ref().and_then(CarriedObject::class),
            ClassId::from_name("bike")
        );
        let right = hands.hands[1].as_ref().expect("it is sensed");
        assert_eq!((right.object, right.n_contents), (None, 2));
    }
}
