//! Helpers that learn to choose single actions from images: the paper's RL baseline (appendix on learning).
//!
//! [`seen`] is what they read, [`network`] what they are, [`helper`] lets them act, and [`train`] learns by proximal policy
//! optimization, by the paper's numbers or with larger batches.

pub mod network;
pub mod seen;

pub mod helper;
pub mod train;

use chaic_agents::Mind;
use chaic_agents::decision::HandState;
use chaic_agents::mapping::Thing;
use chaic_agents::memory::Memory;
use chaic_agents::policies::External;
use chaic_core::{Action, Briefing, ClassId, Hand, Target};

/// What there is to choose from. The paper doesn't say what its helper's actions point at; ours at the nearest
/// thing of a kind that is in view.
pub const ACTIONS: [&str; 9] = [
    "move_forward",
    "turn_left",
    "turn_right",
    "pick_up_target",
    "pick_up_container",
    "put_in",
    "put_on_goal_place",
    "remove_obstacle",
    "wait",
];

/// How long a wait is, and an action that can't be begun, frames: about as long as a turn.
const WAIT_FRAMES: u32 = 10;

/// The pause in place of an action that can't be begun.
pub(crate) const PAUSE: Action = Action::Wait { frames: WAIT_FRAMES };

/// An action of [`ACTIONS`] as a mind that only looks means it; `None` if there is nothing in view that it could be
/// about, or no hand for it.
pub(crate) fn action_of(
    choice: usize,
    mind: &Mind<External>,
    briefing: &Briefing,
) -> Option<Action> {
    let memory = mind.memory()?;
    let hands = HandState::of(&memory.hands, briefing);
    let free = hands.free_hand;
    let at = |classes: &[ClassId]| in_view(memory, classes).find_map(|t| mind.target(t.track));
    Some(match choice {
        0 => Action::MoveForward,
        1 => Action::TurnLeft,
        2 => Action::TurnRight,
        3 => {
            let hand = hand_for_target(&hands)?;
            Action::PickUp { object: at(&briefing.possible_targets)?, hand }
        }
        4 => Action::PickUp { object: at(&briefing.containers)?, hand: free? },
        5 if hands.can_put_in => Action::PutIn,
        6 => put_on(at(&briefing.goal_places)?, &hands)?,
        7 => Action::RemoveObstacle { obstacle: at(&briefing.obstacles)?, hand: free? },
        8 => PAUSE,
        _ => return None,
    })
}

/// The hand that takes a target: a free one, or where a basket is filled, any.
fn hand_for_target(hands: &HandState) -> Option<Hand> {
    hands.can_take_target.then_some(hands.free_hand.unwrap_or(Hand::Left))
}

fn put_on(place: Target, hands: &HandState) -> Option<Action> {
    Some(Action::PutOn { place, hand: hands.to_deliver? })
}

/// Things of these classes that are in view and can be taken or used, nearest first.
fn in_view<'a>(memory: &'a Memory, classes: &[ClassId]) -> impl Iterator<Item = &'a Thing> {
    let is_there = |t: &&Thing| {
        classes.contains(&t.class) && t.last_seen == memory.frame && t.held_until <= memory.frame
    };
    let mut found: Vec<&Thing> = memory.things.iter().filter(is_there).collect();
    found.sort_by(|a, b| a.distance_from(memory.here()).total_cmp(&b.distance_from(memory.here())));
    found.into_iter()
}
