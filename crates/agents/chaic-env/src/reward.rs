//! What a learner is rewarded for.

use chaic_core::AgentId;
use chaic_core::geom::horizontal_distance;
use chaic_world::{Place, World};
use serde::{Deserialize, Serialize};

/// What came of one action of an agent, in the terms of the paper's reward: "a linear combination of
/// transported objects and distance to the nearest target object. A penalty is also applied for each
/// invalid action" (paper, appendix, "RL Baseline").
///
/// These are facts of the world that no helper is told: they are for training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RewardTerms {
    /// Share of all that is wanted which was delivered meanwhile, by whomever: 0 to 1.
    pub delivered: f64,
    /// By how much shorter the agent's way to its next delivery has become, metres: in a straight
    /// line to the target for which that way is shortest and from there to the goal place. Targets that
    /// somebody took, dropped or delivered meanwhile are left out, so that what others do neither
    /// rewards nor punishes, and going to and fro earns nothing.
    pub approached_m: f64,
    /// Whether the action has ended and failed.
    pub is_invalid: bool,
}

/// How much each term counts. The paper doesn't tell its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RewardWeights {
    /// For everything that is wanted.
    pub delivered: f64,
    /// For each metre.
    pub approached_per_m: f64,
    /// Taken off for an invalid action.
    pub invalid: f64,
}

impl RewardWeights {
    /// Ours, but for the penalty: 0.1 for each invalid action is the only reward in the original's
    /// code (facts S2.4). A target of ten delivered is worth as much as 20 metres of approach: about
    /// the way of one delivery in a house.
    pub const STANDARD: RewardWeights =
        RewardWeights { delivered: 10.0, approached_per_m: 0.05, invalid: 0.1 };
}

impl RewardTerms {
    /// The reward.
    pub fn weigh(&self, weights: &RewardWeights) -> f64 {
        weights.delivered * self.delivered + weights.approached_per_m * self.approached_m
            - if self.is_invalid { weights.invalid } else { 0.0 }
    }

    /// What has come of an action that was begun as things stood `before`.
    pub(crate) fn between(before: &Standing, world: &World, agent: AgentId) -> RewardTerms {
        let person = world.state().people.get(agent.index());
        let is_under_way = person.is_none_or(|p| p.activity.is_some());
        let now = Standing::of(world, agent);
        let both = || before.ways_m.iter().zip(&now.ways_m).filter_map(|(a, b)| (*a).zip(*b));
        let shortest = |ways: &mut dyn Iterator<Item = f32>| ways.min_by(f32::total_cmp);
        let before_m = shortest(&mut both().map(|(a, _)| a));
        let now_m = shortest(&mut both().map(|(_, b)| b));
        RewardTerms {
            delivered: now.done - before.done,
            approached_m: before_m.zip(now_m).map_or(0.0, |(a, b)| f64::from(a - b)),
            is_invalid: !is_under_way
                && world.last_action(agent).is_some_and(|(_, outcome)| !outcome.is_success()),
        }
    }
}

/// Totals of what can be rewarded, as an episode stands for an agent: what it earns between two moments is by how
/// much they differ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    /// Share of all that is wanted which is delivered, by whomever: 0 to 1.
    pub delivered: f64,
    /// Share of it that the agent itself has delivered.
    pub own: f64,
    /// Share of it that the agent holds, in its hands or in a container there.
    pub held: f64,
    /// Share of the frames of the whole episode in which the child was away from its guardian.
    pub emergency: f64,
    /// The agent's way to its next delivery, metres, in straight lines; 0 if there is nothing to deliver.
    pub way_m: f64,
}

impl Totals {
    /// Those of a world.
    pub fn of(world: &World, agent: AgentId) -> Totals {
        let (setup, state) = (world.setup(), world.state());
        let (done, total) = world.progress();
        let share = |worth: f64| if total > 0.0 { worth / total } else { 0.0 };
        let n_things = setup.things.len();
        let worth = |is_counted: &dyn Fn(usize) -> bool| -> f64 {
            let wanted = |k: &usize| setup.goal.wanted(setup.things[*k].class) > 0;
            let counted = (0..n_things).filter(wanted).filter(|k| is_counted(*k));
            counted.map(|k| world.worth(setup.things[k].class)).sum()
        };
        let ways = (0..n_things).filter_map(|k| way_m(world, agent, k));
        Totals {
            delivered: share(done),
            own: share(worth(&|k| state.things[k].delivered_by == Some(agent))),
            held: share(worth(&|k| holder(world, k) == Some(agent))),
            emergency: f64::from(state.child_away_frames) / f64::from(setup.horizon.max(1)),
            way_m: ways.min_by(f32::total_cmp).map_or(0.0, f64::from),
        }
    }
}

/// How an episode stands for an agent.
#[derive(Clone, Debug)]
pub(crate) struct Standing {
    /// Share of what is wanted that is delivered.
    done: f64,
    /// The agent's way by each thing to a goal place, metres; `None` for what it can't deliver now.
    ways_m: Vec<Option<f32>>,
}

impl Standing {
    pub(crate) fn of(world: &World, agent: AgentId) -> Standing {
        let (done, total) = world.progress();
        let n_things = world.setup().things.len();
        Standing {
            done: if total > 0.0 { done / total } else { 0.0 },
            ways_m: (0..n_things).map(|k| way_m(world, agent, k)).collect(),
        }
    }
}

/// The length of an agent's way by a target to the nearest goal place, in straight lines; the way to
/// the goal place alone if the agent carries it.
fn way_m(world: &World, agent: AgentId, index: usize) -> Option<f32> {
    let (setup, state) = (world.setup(), world.state());
    let (class, thing) = (setup.things[index].class, &state.things[index]);
    let wanted = setup.goal.targets.iter().find(|(c, _)| *c == class).map_or(0, |(_, n)| *n);
    let is_gone = thing.delivered.is_some() || thing.place == Place::Broken;
    if is_gone || world.n_delivered(class) >= wanted {
        return None;
    }
    let here = state.people.get(agent.index())?.pose.position;
    let to_goal_m = |from| {
        let goals = setup.goal_places.iter().filter_map(|goal| setup.thing_index(*goal));
        let ways = goals.map(|k| horizontal_distance(from, state.things[k].position));
        ways.min_by(f32::total_cmp)
    };
    match holder(world, index) {
        Some(by) if by == agent => to_goal_m(here),
        Some(_) => None,
        None => Some(horizontal_distance(here, thing.position) + to_goal_m(thing.position)?),
    }
}

/// Who holds a thing, or the container that it is in.
fn holder(world: &World, index: usize) -> Option<AgentId> {
    let state = world.state();
    let outer = match state.things[index].place {
        Place::Inside { container, .. } => world.setup().thing_index(container)?,
        _ => index,
    };
    state.things[outer].holder()
}
