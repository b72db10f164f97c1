//! Rewards for training. They are ground truth that no agent observes.

use chaic_core::geom::horizontal_distance;
use chaic_core::{AgentId, ClassId, Frame};
use chaic_world::{ObjectLocation, World};
use serde::{Deserialize, Serialize};

/// Weights of the terms of a reward; 0 disables a term.
///
/// A reward per action has the terms of [`RewardTerms`], a cumulative reward those of
/// [`RewardTracker::cumulative`]. The paper rewards transported objects and the distance to the nearest
/// target, and penalizes invalid actions (appendix, "RL Baseline"). It does not state its weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RewardWeights {
    /// Delivery of all wanted objects, by any agent.
    pub delivered: f64,
    /// Delivery of all wanted objects by the agent itself; varies less with the partner's behavior. A
    /// delivery counts if fewer than the wanted number of its class were delivered before, by any agent.
    pub own_delivered: f64,
    /// Holding all objects still needed; taken back on delivery, on a drop and at the end of the
    /// episode.
    pub held: f64,
    /// Penalty per meter of remaining distance to the next delivery.
    pub remaining_per_m: f64,
    /// Reward per meter of progress to the next delivery during an action.
    pub progress_per_m: f64,
    /// Penalty per failed action of the agent other than steps, turns and waits.
    pub failed: f64,
    /// Penalty per failed action of any kind.
    pub invalid: f64,
    /// Penalty for a child that is away from its guardian during the whole episode.
    pub emergency: f64,
}

impl RewardWeights {
    /// No reward.
    pub const NONE: RewardWeights = RewardWeights {
        delivered: 0.0,
        own_delivered: 0.0,
        held: 0.0,
        remaining_per_m: 0.0,
        progress_per_m: 0.0,
        failed: 0.0,
        invalid: 0.0,
        emergency: 0.0,
    };
    /// Default weights per action.
    ///
    /// The penalty of 0.1 per invalid action is the only reward in the original code (facts S2.4). One
    /// delivered object of ten counts as much as 20 meters of progress, about one delivery in a house.
    pub const STANDARD: RewardWeights = RewardWeights {
        delivered: 10.0,
        progress_per_m: 0.05,
        invalid: 0.1,
        ..RewardWeights::NONE
    };
    /// Default weights of a cumulative reward, for policies that choose plans.
    pub const CUMULATIVE: RewardWeights = RewardWeights {
        delivered: 5.0,
        own_delivered: 5.0,
        held: 2.0,
        emergency: 0.5,
        ..RewardWeights::NONE
    };
}

/// Terms of the reward for one action.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RewardTerms {
    /// Fraction of all wanted objects that was delivered since the start of the action, by any agent,
    /// 0 to 1.
    pub delivered: f64,
    /// Decrease of the remaining distance to the next delivery, meters: in straight lines to the
    /// best target and from there to the goal place. Targets that another agent took or dropped, or
    /// that were delivered, do not count, so other agents' actions have no effect and going back
    /// and forth earns nothing.
    pub progress_m: f64,
    /// True if the action has ended and failed.
    pub is_invalid: bool,
}

impl RewardTerms {
    /// Returns the weighted sum of the terms.
    pub fn weighted_sum(&self, weights: &RewardWeights) -> f64 {
        weights.delivered * self.delivered + weights.progress_per_m * self.progress_m
            - if self.is_invalid { weights.invalid } else { 0.0 }
    }
}

/// Reward state of one agent in an episode.
#[derive(Clone, Debug)]
pub struct RewardTracker {
    agent: AgentId,
    /// State when the agent last chose an action.
    action_start: Option<ActionStart>,
    /// Failed actions other than steps, turns and waits.
    n_failed: u32,
    /// End of the last counted action.
    last_interaction: Option<Frame>,
}

impl RewardTracker {
    /// Creates the state at the start of an episode.
    pub fn new(agent: AgentId) -> RewardTracker {
        RewardTracker { agent, action_start: None, n_failed: 0, last_interaction: None }
    }

    /// Returns the reward accumulated since the start of the episode.
    ///
    /// The reward between two frames is the difference of their cumulative rewards. The method counts
    /// failed actions, so call it in every frame in which an agent decides.
    pub fn cumulative(&mut self, world: &World, weights: &RewardWeights) -> f32 {
        let interaction =
            world.state().agents.get(self.agent.index()).and_then(|agent| agent.last_interaction);
        if let Some((frame, _, outcome)) = interaction
            && self.last_interaction != Some(frame)
        {
            self.last_interaction = Some(frame);
            self.n_failed += u32::from(!outcome.is_success());
        }
        let totals = RewardTotals::new(world, self.agent);
        // Holding an object or being near one is worth nothing at the end of the episode.
        let (held, remaining_per_m) = if world.is_over() {
            (0.0, 0.0)
        } else {
            (weights.held as f32, weights.remaining_per_m as f32)
        };
        weights.delivered as f32 * totals.delivered as f32
            + weights.own_delivered as f32 * totals.own_delivered as f32
            + held * totals.held as f32
            - remaining_per_m * totals.remaining_m as f32
            - weights.failed as f32 * self.n_failed as f32
            - weights.emergency as f32 * totals.emergency as f32
    }

    /// Stores the state at the start of an action.
    pub(crate) fn begin_action(&mut self, world: &World) {
        self.action_start = Some(ActionStart::new(world, self.agent));
    }

    /// Returns the terms of the last action up to now; `None` before the first one.
    pub(crate) fn action_terms(&self, world: &World) -> Option<RewardTerms> {
        let start = self.action_start.as_ref()?;
        let agent_state = world.state().agents.get(self.agent.index());
        let is_under_way = agent_state.is_none_or(|agent| agent.activity.is_some());
        let now = ActionStart::new(world, self.agent);
        let both =
            || start.remaining_m.iter().zip(&now.remaining_m).filter_map(|(a, b)| (*a).zip(*b));
        let shortest = |distances: &mut dyn Iterator<Item = f32>| distances.min_by(f32::total_cmp);
        let before_m = shortest(&mut both().map(|(a, _)| a));
        let now_m = shortest(&mut both().map(|(_, b)| b));
        Some(RewardTerms {
            delivered: now.delivered - start.delivered,
            progress_m: before_m.zip(now_m).map_or(0.0, |(a, b)| f64::from(a - b)),
            is_invalid: !is_under_way
                && world.last_action(self.agent).is_some_and(|(_, outcome)| !outcome.is_success()),
        })
    }
}

/// Terms of a cumulative reward.
struct RewardTotals {
    /// Fraction of all wanted objects that is delivered, 0 to 1.
    delivered: f64,
    /// Fraction that the agent itself delivered; those of all agents sum to `delivered`.
    own_delivered: f64,
    /// Fraction that the agent holds, in its hands or in a held container, of each class at most the
    /// number still needed.
    held: f64,
    /// Fraction of the episode's frames in which the child was away from its guardian.
    emergency: f64,
    /// Distance to the next delivery in straight lines, meters; 0 without a deliverable object.
    remaining_m: f64,
}

impl RewardTotals {
    fn new(world: &World, agent: AgentId) -> RewardTotals {
        let (setup, state) = (world.setup(), world.state());
        let (done, total) = world.progress();
        let fraction = |amount: f64| if total > 0.0 { amount / total } else { 0.0 };
        let n_objects = setup.things.len();
        let own = |(class, n_wanted): &(ClassId, u32)| {
            let n = n_counted_deliveries(world, agent, *class, *n_wanted);
            f64::from(n) * world.target_value(*class)
        };
        // Held objects of one class beyond the number still needed earn nothing.
        let held = |(class, n_wanted): &(ClassId, u32)| {
            let is_held =
                |k: &usize| setup.things[*k].class == *class && holder(world, *k) == Some(agent);
            let n = (0..n_objects).filter(is_held).count() as u32;
            let n_left = n_wanted.saturating_sub(world.n_delivered(*class));
            f64::from(n.min(n_left)) * world.target_value(*class)
        };
        let distances = (0..n_objects).filter_map(|k| remaining_distance_m(world, agent, k));
        RewardTotals {
            delivered: fraction(done),
            own_delivered: fraction(setup.goal.targets.iter().map(own).sum()),
            held: fraction(setup.goal.targets.iter().map(held).sum()),
            emergency: f64::from(state.child_away_frames) / f64::from(setup.horizon.max(1)),
            remaining_m: distances.min_by(f32::total_cmp).map_or(0.0, f64::from),
        }
    }
}

/// Returns the number of objects of a class that an agent delivered while they were wanted: those among the
/// first `n_wanted` deliveries by any agent. Deliveries of one frame count in the order of ids.
fn n_counted_deliveries(world: &World, agent: AgentId, class: ClassId, n_wanted: u32) -> u32 {
    let objects = world.setup().things.iter().zip(&world.state().objects);
    let of_class = objects.filter(|(thing, _)| thing.class == class);
    let mut deliveries: Vec<(Frame, Option<AgentId>)> =
        of_class.filter_map(|(_, object)| Some((object.delivered?, object.delivered_by))).collect();
    // A stable sort keeps the order of ids.
    deliveries.sort_by_key(|(frame, _)| *frame);
    let counted = deliveries.iter().take(n_wanted as usize);
    counted.filter(|(_, by)| *by == Some(agent)).count() as u32
}

/// State at the start of an action.
#[derive(Clone, Debug)]
struct ActionStart {
    /// Fraction of all wanted objects that is delivered.
    delivered: f64,
    /// Remaining distance by way of each object, meters; `None` for objects that the agent can't deliver.
    remaining_m: Vec<Option<f32>>,
}

impl ActionStart {
    fn new(world: &World, agent: AgentId) -> ActionStart {
        let (done, total) = world.progress();
        let n_objects = world.setup().things.len();
        ActionStart {
            delivered: if total > 0.0 { done / total } else { 0.0 },
            remaining_m: (0..n_objects).map(|k| remaining_distance_m(world, agent, k)).collect(),
        }
    }
}

/// Returns the straight-line distance from an agent by way of a target to the nearest goal place, meters.
///
/// A carried target counts the distance to the goal place only. `None` if the agent can't deliver the
/// object.
fn remaining_distance_m(world: &World, agent: AgentId, index: usize) -> Option<f32> {
    let (setup, state) = (world.setup(), world.state());
    let (class, object) = (setup.things[index].class, &state.objects[index]);
    let wanted = setup.goal.targets.iter().find(|(c, _)| *c == class).map_or(0, |(_, n)| *n);
    let is_out_of_play = object.delivered.is_some() || object.location == ObjectLocation::Broken;
    if is_out_of_play || world.n_delivered(class) >= wanted {
        return None;
    }
    let position = state.agents.get(agent.index())?.pose.position;
    let to_goal_m = |from| {
        let goals = setup.goal_places.iter().filter_map(|goal| setup.object_index(*goal));
        let distances = goals.map(|k| horizontal_distance(from, state.objects[k].position));
        distances.min_by(f32::total_cmp)
    };
    match holder(world, index) {
        Some(by) if by == agent => to_goal_m(position),
        Some(_) => None,
        None => Some(horizontal_distance(position, object.position) + to_goal_m(object.position)?),
    }
}

/// Returns the agent that holds an object or its container.
fn holder(world: &World, index: usize) -> Option<AgentId> {
    let state = world.state();
    let outer = match state.objects[index].location {
        ObjectLocation::Inside { container, .. } => world.setup().object_index(container)?,
        _ => index,
    };
    state.objects[outer].holder()
}
