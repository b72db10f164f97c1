//! Action spaces of visual policies.

use std::sync::LazyLock;

use chaic_agents::PlanningAgent;
use chaic_agents::decision::{HandState, Plan};
use chaic_agents::mapping::MappedObject;
use chaic_agents::memory::Memory;
use chaic_agents::policies::ExternalPolicy;
use chaic_core::{Action, Briefing, ClassId, Hand, Role, Target};
use serde::{Deserialize, Serialize};

/// Meaning of a policy's outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ActionSpace {
    /// A kind of plan of [`PLANS`] and the class of its object, one of [`classes`], chosen
    /// independently of each other. The next decision follows when the plan has ended. The paper
    /// does not state its action space; the original's code has this one for learners.
    Plans,
    /// A single action of [`PRIMITIVES`].
    Primitives,
}

/// Kinds of plans, those of the original's interface for learners. The original's eighth kind,
/// wait, always explores.
pub const PLANS: [&str; 7] = [
    "pick_up_target",
    "pick_up_container",
    "deliver",
    "put_in",
    "explore",
    "remove_obstacle",
    "follow_partner",
];

/// Single actions, with the nearest visible object of a kind as target.
pub const PRIMITIVES: [&str; 9] = [
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

/// Duration of a wait, and of an action that cannot begin, frames: about the duration of a step.
const WAIT_FRAMES: u32 = 10;
/// Wait that replaces an action that cannot begin.
pub(crate) const PAUSE: Action = Action::Wait { frames: WAIT_FRAMES };

static CLASSES: LazyLock<Vec<ClassId>> = LazyLock::new(|| {
    let is_movable = |class: &ClassId| {
        matches!(
            class.info().role,
            Role::Target | Role::Fragile | Role::HeavyTarget | Role::Container | Role::Obstacle
        )
    };
    ClassId::all().filter(is_movable).collect()
});

/// Classes that plans refer to: targets, furniture to move, containers and obstacles.
pub fn classes() -> &'static [ClassId] {
    &CLASSES
}

impl ActionSpace {
    /// All action spaces.
    pub const ALL: [ActionSpace; 2] = [ActionSpace::Plans, ActionSpace::Primitives];

    /// Sizes of the independent categorical distributions, one or two.
    pub fn head_sizes(self) -> Vec<usize> {
        match self {
            ActionSpace::Plans => vec![PLANS.len(), classes().len()],
            ActionSpace::Primitives => vec![PRIMITIVES.len()],
        }
    }

    /// Number of actions: combinations of the choices of all distributions.
    pub fn n_actions(self) -> usize {
        self.head_sizes().iter().product()
    }
}

/// Splits an action of [`ActionSpace::Plans`] into the kind of plan and the class.
fn kind_and_class(action_index: usize) -> (usize, ClassId) {
    (action_index / classes().len(), classes()[action_index % classes().len()])
}

/// Returns the index of the chosen plan of [`ActionSpace::Plans`] among the valid ones: the first
/// one for an object of the chosen class, or the first of any class if none of the chosen class is
/// known. Objects to pick up are sorted by distance. `None` if no plan of the chosen kind is valid.
pub(crate) fn resolve_plan(action_index: usize, valid: &[Plan]) -> Option<usize> {
    let (kind, class) = kind_and_class(action_index);
    let is_of_kind = |plan: &Plan| {
        matches!(
            (PLANS[kind], plan),
            ("pick_up_target", Plan::PickUp(_) | Plan::LiftWith(_))
                | ("pick_up_container", Plan::PickContainer(_))
                | ("deliver", Plan::Deliver)
                | ("put_in", Plan::PutIn)
                | ("explore", Plan::Explore)
                | ("remove_obstacle", Plan::RemoveObstacle(_))
                | ("follow_partner", Plan::FollowPartner)
        )
    };
    let is_of_class = |plan: &Plan| plan.subject().is_some_and(|subject| subject.class == class);
    let exact = valid.iter().position(|plan| is_of_kind(plan) && is_of_class(plan));
    exact.or_else(|| valid.iter().position(is_of_kind))
}

/// Returns an action of [`PRIMITIVES`] with its target; `None` if no visible object or no hand fits.
pub(crate) fn resolve_primitive(
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
pub(crate) fn visible_objects<'a>(
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

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_agents::decision::Subject;
    use chaic_agents::track::TrackId;

    fn subject(track: u32, class: &str) -> Subject {
        Subject { track: TrackId(track), class: ClassId::named(class) }
    }

    fn choice(kind: &str, class: &str, valid: &[Plan]) -> Option<usize> {
        let kind = PLANS.iter().position(|name| *name == kind).unwrap();
        let class = ClassId::named(class);
        let class = classes().iter().position(|c| *c == class).unwrap();
        resolve_plan(kind * classes().len() + class, valid)
    }

    #[test]
    fn a_plan_refers_to_the_nearest_object_of_the_class_or_else_of_any_class() {
        let valid = [
            Plan::Explore,
            Plan::Deliver,
            Plan::PickUp(subject(1, "banana")),
            Plan::PickUp(subject(2, "apple")),
            Plan::PickUp(subject(3, "apple")),
            Plan::TurnAround,
        ];
        for (kind, class, expected) in [
            ("pick_up_target", "apple", Some(3)),
            ("pick_up_target", "orange", Some(2)),
            ("deliver", "apple", Some(1)),
            ("explore", "apple", Some(0)),
            ("pick_up_container", "apple", None),
            ("put_in", "apple", None),
            ("remove_obstacle", "apple", None),
            ("follow_partner", "apple", None),
        ] {
            assert_eq!(choice(kind, class, &valid), expected, "{kind} {class}");
        }
    }

    #[test]
    fn every_kind_of_plan_can_be_chosen() {
        let it = subject(1, "apple");
        for (plan, kind) in [
            (Plan::PickUp(it), "pick_up_target"),
            (Plan::LiftWith(it), "pick_up_target"),
            (Plan::PickContainer(it), "pick_up_container"),
            (Plan::Deliver, "deliver"),
            (Plan::PutIn, "put_in"),
            (Plan::Explore, "explore"),
            (Plan::RemoveObstacle(it), "remove_obstacle"),
            (Plan::FollowPartner, "follow_partner"),
        ] {
            assert_eq!(choice(kind, "banana", &[plan]), Some(0), "{kind}");
        }
    }
}
