//! Policies of primitive actions from images: the paper's RL baseline (appendix on learning).
//!
//! [`observation`] is the input, [`network`] the network, [`helper`] the agent, and [`train`] the
//! training by proximal policy optimization, with the paper's hyperparameters by default.

pub mod network;
pub mod observation;

pub mod helper;

mod config;
mod env_runner;
pub mod train;

use chaic_agents::PlanningAgent;
use chaic_agents::decision::HandState;
use chaic_agents::mapping::MappedObject;
use chaic_agents::memory::Memory;
use chaic_agents::policies::ExternalPolicy;
use chaic_core::{Action, Briefing, ClassId, Hand, Target};

/// Actions. The paper does not state their targets; ours are the nearest visible objects of a kind.
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

/// Duration of a wait, and of an action that cannot begin, frames: about that of a turn.
const WAIT_FRAMES: u32 = 10;

/// Wait that replaces an action that cannot begin.
pub(crate) const PAUSE: Action = Action::Wait { frames: WAIT_FRAMES };

/// Returns an action of [`ACTIONS`] with its target; `None` if no visible object or no hand fits.
pub(crate) fn resolve_action(
    action_index: usize,
    agent: &PlanningAgent<ExternalPolicy>,
    briefing: &Briefing,
) -> Option<Action> {
    let memory = agent.memory()?;
    let hands = HandState::new(&memory.hands, briefing);
    let free_hand = hands.free_hand;
    let nearest_visible =
        |classes: &[ClassId]| visible_objects(memory, classes).find_map(|t| agent.target(t.track));
    Some(match action_index {
        0 => Action::MoveForward,
        1 => Action::TurnLeft,
        2 => Action::TurnRight,
        3 => {
            let hand = hand_for_target(&hands)?;
            Action::PickUp { object: nearest_visible(&briefing.possible_targets)?, hand }
        }
        4 => Action::PickUp { object: nearest_visible(&briefing.containers)?, hand: free_hand? },
        5 if hands.can_put_in => Action::PutIn,
        6 => put_on(nearest_visible(&briefing.goal_places)?, &hands)?,
        7 => Action::RemoveObstacle {
            obstacle: nearest_visible(&briefing.obstacles)?,
            hand: free_hand?,
        },
        8 => PAUSE,
        _ => return None,
    })
}

/// Returns the hand that takes a target: a free one, or any if the target goes into a basket.
fn hand_for_target(hands: &HandState) -> Option<Hand> {
    hands.can_take_target.then_some(hands.free_hand.unwrap_or(Hand::Left))
}

fn put_on(place: Target, hands: &HandState) -> Option<Action> {
    Some(Action::PutOn { place, hand: hands.to_deliver? })
}

/// Returns visible and available objects of these classes, nearest first.
fn visible_objects<'a>(
    memory: &'a Memory,
    classes: &[ClassId],
) -> impl Iterator<Item = &'a MappedObject> {
    let is_available = |t: &&MappedObject| {
        classes.contains(&t.class) && t.last_seen == memory.frame && t.held_until <= memory.frame
    };
    let mut objects: Vec<&MappedObject> = memory.objects.iter().filter(is_available).collect();
    objects.sort_by(|a, b| {
        a.distance_from(memory.position()).total_cmp(&b.distance_from(memory.position()))
    });
    objects.into_iter()
}
