//! Comparison of the reference with the world after every frame.

use std::fmt::{Debug, Write as _};

use chaic_core::{AgentId, ResolvedAction};
use chaic_world::{Event, EventKind, Phase, Setup, World};

use crate::numbers::RuleSet;
use crate::scene::{GivenQuantities, Scene};
use crate::state::{Location, Part, RefState};
use crate::turn::{Facts, Turn};
use crate::verdict::Choices;

/// Maximum number of states that remain possible because of open conditions.
const MAX_STATES: usize = 64;
/// Maximum difference of the fatigue of a person; rounding errors accumulate in it.
const FATIGUE_TOLERANCE: f32 = 1e-4;

/// States of the reference that are compared with a world.
pub(crate) struct Comparison<'a> {
    facts: Facts<'a>,
    /// States that agree with the world so far; usually one.
    states: Vec<RefState>,
    /// Number of open conditions so far.
    pub(crate) n_open: u64,
}

impl<'a> Comparison<'a> {
    /// Starts beside a new world.
    pub(crate) fn new(setup: &'a Setup, set: RuleSet, world: &World) -> Comparison<'a> {
        let states = vec![RefState::start(world)];
        Comparison { facts: Facts::new(setup, set), states, n_open: 0 }
    }

    /// Takes over the poses of people that were moved between two frames.
    pub(crate) fn move_people(&mut self, world: &World) {
        for state in &mut self.states {
            state.scene = Scene::of(world);
        }
    }

    /// Runs one frame of the reference and compares it with the world.
    pub(crate) fn frame(
        &mut self,
        submitted: &[(AgentId, ResolvedAction)],
        given: &GivenQuantities,
        world: &World,
        events: &[Event],
    ) -> Result<(), String> {
        let mut next: Vec<RefState> = Vec::new();
        let mut differences = Vec::new();
        for state in std::mem::take(&mut self.states) {
            let mut choices = Choices::default();
            loop {
                let state = state.clone();
                let mut turn = Turn { facts: &self.facts, state, given, choices: &mut choices };
                for (agent, action) in submitted {
                    turn.begin(*agent, *action);
                }
                turn.run_frame();
                let found = find_differences(&turn, world, events);
                let mut state = turn.state;
                state.events.clear();
                self.n_open += choices.n_open() as u64;
                if !found.is_empty() {
                    differences.push(found);
                } else if !next.contains(&state) {
                    next.push(state);
                }
                if !choices.advance() {
                    break;
                }
            }
        }
        if next.is_empty() {
            differences.sort_by_key(Vec::len);
            return Err(differences.swap_remove(0).join("\n"));
        }
        if next.len() > MAX_STATES {
            return Err(format!("{} states are possible", next.len()));
        }
        self.states = next;
        Ok(())
    }

    /// Returns the actions in progress and their parts, for messages.
    pub(crate) fn describe(&self) -> String {
        let mut text = String::new();
        for (k, person) in self.states.iter().flat_map(|s| s.people.iter().enumerate()) {
            let _ = writeln!(text, "person {k}: hands {:?}, {:?}", person.hands, person.ongoing);
        }
        text
    }
}

/// Kind of motion that the reference and the world name alike.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Motion {
    Walks,
    Approaches,
    Awaits,
    Follows,
    Other,
}

fn motion_of_part(part: Part) -> Motion {
    match part {
        Part::Walk { .. } => Motion::Walks,
        Part::Approach { .. } => Motion::Approaches,
        Part::AwaitOther { .. } => Motion::Awaits,
        Part::Follow => Motion::Follows,
        _ => Motion::Other,
    }
}

fn motion_of_phase(phase: Phase) -> Motion {
    match phase {
        Phase::Walk { .. } => Motion::Walks,
        Phase::Approach { .. } => Motion::Approaches,
        Phase::WaitForOtherAgent { .. } => Motion::Awaits,
        Phase::CarryAlong => Motion::Follows,
        _ => Motion::Other,
    }
}

/// A list of differences.
#[derive(Default)]
struct Differences(Vec<String>);

impl Differences {
    fn check<T: PartialEq + Debug>(&mut self, what: impl FnOnce() -> String, own: T, world: T) {
        if own != world {
            self.0.push(format!("{}: reference {own:?}, world {world:?}", what()));
        }
    }
}

/// Returns the events with consecutive losses of support sorted by object, because their order is
/// unspecified.
fn sorted(events: &[Event]) -> Vec<Event> {
    let mut events = events.to_vec();
    for group in events.chunk_by_mut(|a, b| {
        let is_loss = |e: &Event| matches!(e.kind, EventKind::LostSupport { .. });
        is_loss(a) && is_loss(b)
    }) {
        group.sort_by_key(|e| match e.kind {
            EventKind::LostSupport { object } => object.0,
            _ => 0,
        });
    }
    events
}

fn find_differences(turn: &Turn<'_>, world: &World, events: &[Event]) -> Vec<String> {
    let (own, state) = (&turn.state, world.state());
    let mut d = Differences(own.impossible_motions.clone());
    let name = |text: &'static str| move || text.to_owned();
    d.check(name("frame"), own.frame, state.frame);
    d.check(name("over"), own.over, state.over);
    d.check(name("child_away_frames"), own.child_away_frames, state.child_away_frames);
    d.check(name("child_is_away"), own.child_is_away, state.child_is_away);
    d.check(name("stuck_frames"), own.stuck_frames, state.stuck_frames);
    d.check(
        name("joint carry"),
        own.carry.map(|c| (c.object, c.leader, c.follower, c.has_begun)),
        state.joint.map(|c| (c.object, c.leader, c.follower, c.under_way)),
    );
    if !events.is_empty() || !own.events.is_empty() {
        d.check(name("events"), sorted(&own.events), sorted(events));
        let (achieved, total) = world.progress();
        d.check(name("progress"), turn.progress(), [achieved, total]);
    }
    for (k, (person, agent)) in own.people.iter().zip(&state.agents).enumerate() {
        let of = |text: &'static str| move || format!("person {k}, {text}");
        d.check(of("hands"), person.hands, agent.hands);
        d.check(of("last action"), person.last, agent.last);
        d.check(of("last interaction"), person.last_interaction, agent.last_interaction);
        d.check(of("in stride"), person.in_stride, agent.in_stride);
        let progress = (person.progress_frame, person.progress_at, person.is_stuck);
        let expected = agent.progress;
        let expected = (expected.frame, expected.position, expected.is_stuck);
        d.check(of("progress"), progress, expected);
        let draws = [person.n_break, person.n_take, person.n_put_on, person.n_put_in];
        let n = agent.draws;
        d.check(of("draws"), draws, [n.breaks, n.takes, n.puts_on, n.puts_in]);
        if let Some(condition) = state.impairment_states.get(k) {
            let drops = [person.n_slip, person.n_drop];
            d.check(of("draws of tremor"), drops, [condition.slips, condition.drops]);
            let is_equal = (person.fatigue - condition.fatigue).abs() < FATIGUE_TOLERANCE;
            d.check(of("equal fatigue"), is_equal, true);
        }
        let ongoing = person.ongoing.as_ref();
        let ongoing = ongoing.map(|d| (d.action, d.since, d.failing, motion_of_part(d.parts[0])));
        let activity = agent.activity.as_ref();
        let activity =
            activity.map(|a| (a.action, a.since, a.failing, motion_of_phase(a.step.phase)));
        d.check(of("action"), ongoing, activity);
    }
    for (k, (thing, object)) in own.things.iter().zip(&state.objects).enumerate() {
        let of = |text: &'static str| {
            move || {
                format!("{} {}, {text}", Setup::entity(k), turn.facts.setup.things[k].class.name())
            }
        };
        d.check(of("location"), thing.location, Location::of(&object.location));
        d.check(of("delivered"), thing.delivered, object.delivered);
        d.check(of("delivered by"), thing.delivered_by, object.delivered_by);
        d.check(of("last holder"), thing.last_holder, object.last_holder);
        d.check(of("released at"), thing.put_at, object.released_at);
    }
    d.0
}
