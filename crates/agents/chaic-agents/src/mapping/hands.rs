//! What the own hands hold, from what one saw oneself take.

use chaic_core::capability::Gait;
use chaic_core::observation::{Held, SelfState};
use chaic_core::{Action, ClassId, Hand, Outcome};

use crate::track::{Carried, Hands, Intent, TrackId};

/// The vehicle that a rider holds from the start, whose name nobody told.
const OWN_VEHICLE: TrackId = TrackId(u32::MAX);

/// What the hands hold now, if nobody tells: what they held before, changed by the action that has
/// ended, as far as it fits what the hands feel.
pub fn account(
    before: &Hands,
    own: &SelfState,
    last: Option<(Intent, Outcome)>,
    gait: Gait,
    class_of: impl Fn(TrackId) -> Option<ClassId>,
) -> Hands {
    let done = last.filter(|(_, outcome)| outcome.is_success()).map(|(action, _)| action);
    let taken = match done {
        Some(Action::PickUp { object, .. }) => class_of(object).map(|class| (object, class)),
        _ => None,
    };
    let carried = |hand: Hand| {
        let felt: &Held = own.hands[hand.index()].as_ref()?;
        let n_contents = felt.n_contents;
        let Some(held) = before.hands[hand.index()].clone() else {
            let rides = gait == Gait::WalkBike && hand == Hand::Left;
            let bike = || Some((OWN_VEHICLE, ClassId::by_name("bike")?));
            let what = if rides { bike() } else { taken };
            return Some(Carried { what, contents: Vec::new(), n_contents });
        };
        let mut contents = held.contents;
        if n_contents > held.n_contents {
            let stowed = match done {
                Some(Action::PutIn) => {
                    before.hands[hand.other().index()].as_ref().and_then(|other| other.what)
                }
                _ => taken,
            };
            contents.extend(stowed);
        }
        contents.truncate(n_contents as usize);
        Some(Carried { contents, n_contents, ..held })
    };
    Hands {
        hands: Hand::BOTH.map(carried),
        is_joint: own.hands.iter().flatten().any(|held| held.in_both_hands),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn felt(n_contents: u32) -> Option<Held> {
        Some(Held { n_contents, in_both_hands: false, identity: None })
    }

    /// After each action: what the hands feel, and what is then known of them.
    #[test]
    fn account_is_kept_of_what_one_takes_stows_and_puts_down() {
        let (apple, basket, bed) = (TrackId(1), TrackId(2), TrackId(3));
        let name = |track| if track == basket { "wicker_basket" } else { "apple" };
        let class_of = |track| ClassId::by_name(name(track));
        let take = |object, hand| Action::PickUp { object, hand };
        let story: [(Intent, [Option<Held>; 2], &str); 6] = [
            (take(basket, Hand::Left), [felt(0), None], "#2[], -"),
            (take(apple, Hand::Right), [felt(0), felt(0)], "#2[], #1[]"),
            (Action::PutIn, [felt(1), None], "#2[#1], -"),
            (take(apple, Hand::Right), [felt(1), felt(0)], "#2[#1], #1[]"),
            (Action::PutOn { place: bed, hand: Hand::Left }, [None, felt(0)], "-, #1[]"),
            (Action::PutOn { place: bed, hand: Hand::Right }, [None, None], "-, -"),
        ];
        let mut hands = Hands::default();
        for (action, own, expected) in story {
            let own =
                SelfState { pose: Default::default(), hands: own, last: None, other_end: None };
            let last = Some((action, Outcome::Success));
            hands = account(&hands, &own, last, Gait::Walk, class_of);
            let text = |c: &Option<Carried>| match c {
                None => "-".to_owned(),
                Some(c) => {
                    let inside: Vec<String> =
                        c.contents.iter().map(|(t, _)| t.to_string()).collect();
                    let what = c.what.map_or("?".to_owned(), |(t, _)| t.to_string());
                    format!("{what}[{}]", inside.join(" "))
                }
            };
            assert_eq!(hands.hands.iter().map(text).collect::<Vec<_>>().join(", "), expected);
        }
    }

    #[test]
    fn what_one_did_not_see_oneself_take_is_something() {
        let own = SelfState {
            pose: Default::default(),
            hands: [felt(0), felt(2)],
            last: None,
            other_end: None,
        };
        let hands = account(&Hands::default(), &own, None, Gait::WalkBike, |_| None);
        assert_eq!(hands.hands[0].as_ref().and_then(Carried::class), ClassId::by_name("bike"));
        let right = hands.hands[1].as_ref().expect("it is felt");
        assert_eq!((right.what, right.n_contents), (None, 2));
    }
}
