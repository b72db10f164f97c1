//! Is what is hidden hidden? Two plays of one episode that differ in a secret of the partner alone
//! are held against each other, as one agent perceives them (a test of non-interference).
//!
//! As long as nothing differs that the agent's eyes could see or its hands could feel, all that it
//! is told must be the same: images, outcomes of its actions, their reasons and durations,
//! everything. The first difference without such a cause is a [`Finding`], unless a rule or a grant
//! states that it is told. What follows after a difference proves nothing, and is not looked at.
//!
//! **What it is not**: it judges no helper. Its own agent, the [`Prober`], tries whatever an agent
//! may try, to learn what it should not.

pub mod opening;
mod prober;
mod secret;
mod spy;

pub use prober::Prober;
pub use secret::Secret;
pub use spy::Leak;

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use chaic_agents::{PlannerRules, partners};
use chaic_core::geom::horizontal_distance;
use chaic_core::observation::Observation;
use chaic_core::{Action, AgentId, Frame, Vec3};
use chaic_env::minds::Helper;
use chaic_env::rules::RuleSet;
use chaic_env::{Env, EpisodeConfig, Idle, Minds, Seat, seats, seeded_by_episode};
use chaic_episodes::Episode;
use chaic_world::{JointLift, Setup, World};
use spy::{Log, Seen, Spy};

use crate::error::Result;

/// Whatever differs within this distance of an agent, beyond half of its own length, may be felt,
/// metres: the world lets one step up to things at 3 m, and bodies touch on the way.
const FELT_M: f32 = 4.5;

/// What differs, if it is neither seen nor felt.
const GRANTED: &str = "what is granted";
const TIME: &str = "the time";

/// What the partner does while it is watched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Partner {
    /// It lives by its own rules, so that its secret shows as soon as one looks.
    Acts,
    /// It stands there, so that nothing shows.
    Waits,
}

/// Two plays to be held against each other.
#[derive(Clone, Copy)]
pub struct Pair<'a> {
    /// The episode.
    pub episode: &'a Episode,
    /// What differs between the two.
    pub secret: Secret,
    /// What the partner does.
    pub partner: Partner,
    /// By which rules both are played.
    pub rules: RuleSet,
    /// How long, frames.
    pub frames: Frame,
    /// Side of the images, pixels.
    pub image_size: u32,
}

/// Something that an agent was told without being able to see or feel it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// When.
    pub frame: Frame,
    /// What was different.
    pub what: &'static str,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "frame {}: {} differs, and nothing in sight or reach does", self.frame, self.what)
    }
}

/// What came of a pair.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Verdict {
    /// How many observations were the same before a visible difference, or to the end.
    pub compared: usize,
    /// What should not have been told.
    pub finding: Option<Finding>,
}

/// Plays both side by side and compares, to the first difference. `make` gives the watched helper, a
/// fresh one each time.
///
/// # Errors
/// If the episode can't be played.
pub fn compare(pair: &Pair<'_>, make: &dyn Fn() -> Helper, leak: Option<Leak>) -> Result<Verdict> {
    let mut sides = [Side::begin(pair, false, make, leak)?, Side::begin(pair, true, make, leak)?];
    let found = |frame, what| Some(Finding { frame, what });
    if sides[0].log().briefing != sides[1].log().briefing {
        return Ok(Verdict { compared: 0, finding: found(0, "the briefing") });
    }
    let mut compared = 0;
    // Both worlds when the first of the two was told what comes next.
    let mut told_in: Option<[World; 2]> = None;
    // One of them may be asked once more before the end, if it was kept busy.
    while let Some(frame) = sides.iter().filter_map(Side::next_decision).min() {
        let is_next = |side: &Side| side.next_decision() == Some(frame);
        if told_in.is_none() && sides.iter().any(|side| is_next(side) && side.asks_helper()) {
            told_in = Some([sides[0].env.world().clone(), sides[1].env.world().clone()]);
        }
        for side in sides.iter_mut().filter(|side| is_next(side)) {
            side.decide()?;
        }
        let Some([a, b]) = both_told(&sides) else { continue };
        if let Some(what) = difference(&a, &b) {
            let (x, y) = (&a.observation, &b.observation);
            let is_caused = |worlds: &[World; 2]| {
                is_visible_or_felt(worlds, what) || is_called_to_lift(worlds, what)
            };
            let is_fair = is_stated(pair, what, x, y) || told_in.as_ref().is_some_and(is_caused);
            let frame = x.frame.min(y.frame);
            let finding = if is_fair { None } else { found(frame, what) };
            return Ok(Verdict { compared, finding });
        }
        (compared, told_in) = (compared + 1, None);
    }
    Ok(Verdict { compared, finding: None })
}

/// What both were told next, once they were.
fn both_told(sides: &[Side; 2]) -> Option<[Seen; 2]> {
    let [mut a, mut b] = sides.each_ref().map(Side::log);
    if a.seen.is_empty() || b.seen.is_empty() {
        return None;
    }
    Some([a.seen.pop_front()?, b.seen.pop_front()?])
}

/// What differs between two moments, if anything does. Images come last: whatever else differs has
/// to have a cause of its own.
fn difference(a: &Seen, b: &Seen) -> Option<&'static str> {
    let (x, y) = (&a.observation, &b.observation);
    let checks = [
        ("an image", x.images == y.images && x.film == y.film),
        (TIME, x.frame == y.frame),
        ("the outcome of the own action", x.own.last == y.own.last),
        ("the own state", x.own == y.own),
        ("the camera", x.camera == y.camera),
        (GRANTED, x.granted == y.granted),
        ("the own action", a.action == b.action),
    ];
    checks.into_iter().find(|(_, same)| !same).map(|(what, _)| what)
}

/// Whether all that is granted differently is stated to be told: removed obstacles, where the rules
/// announce them to everybody, and what the partner in the image is about, where that is granted. It
/// may have begun what its posture doesn't show yet.
fn is_stated(pair: &Pair<'_>, what: &str, a: &Observation, b: &Observation) -> bool {
    let rest = |o: &Observation| {
        let mut granted = o.granted.clone();
        if pair.rules.world.tells_removed {
            granted.removed.clear();
        }
        if granted.classes.iter().any(|(e, _)| e.agent() == Some(AgentId::PARTNER)) {
            granted.behavior.retain(|seen| seen.agent != AgentId::PARTNER);
            granted.partner_hands = None;
        }
        granted
    };
    what == GRANTED && rest(a) == rest(b)
}

/// Whether two worlds differ, at one moment, in something that the helper can see or feel.
fn is_visible_or_felt([a, b]: &[World; 2], what: &str) -> bool {
    if what == "an image" {
        return differing(a, b).next().is_some();
    }
    let here = a.state().people[AgentId::HELPER.index()].pose.position;
    differing(a, b).any(|(at, half_m)| horizontal_distance(at, here) < FELT_M + half_m)
}

/// Whether the own action took another time since, in one of the two worlds alone, the partner chose
/// the piece of furniture that the helper chose last: where rules have it so, the helper finds itself
/// going there, however far away the partner is.
fn is_called_to_lift([a, b]: &[World; 2], what: &str) -> bool {
    let is_called = |world: &World| {
        let chose = |agent: AgentId| {
            let person = &world.state().people[agent.index()];
            let last = person.activity.as_ref().map(|a| a.action).or(person.last.map(|l| l.0));
            last.filter(|action| matches!(action, Action::PickUp { .. }))?.subject()
        };
        let calls = world.rules().joint_lift == JointLift::LastChoice;
        calls && chose(AgentId::HELPER).is_some_and(|o| chose(AgentId::PARTNER) == Some(o))
    };
    what == TIME && is_called(a) != is_called(b)
}

/// Where two worlds of one episode differ in what stands or moves, with half the length of it.
fn differing<'a>(a: &'a World, b: &'a World) -> impl Iterator<Item = (Vec3, f32)> + 'a {
    let (x, y) = (a.state(), b.state());
    let things = x.things.iter().zip(&y.things).enumerate();
    let things = things.filter(|(_, (p, q))| {
        p.position != q.position || p.rotation != q.rotation || p.place != q.place
    });
    let half_m = |k: usize| 0.5 * a.setup().things[k].size_m().max_element();
    let things =
        things.flat_map(move |(k, (p, q))| [(p.position, half_m(k)), (q.position, half_m(k))]);
    let people = a
        .setup()
        .agents()
        .filter(|agent| *agent != AgentId::HELPER && a.posture(*agent) != b.posture(*agent));
    let at = |w: &World, agent: AgentId| w.state().people[agent.index()].pose.position;
    things.chain(people.flat_map(move |agent| [(at(a, agent), 0.0), (at(b, agent), 0.0)]))
}

/// One of the two plays.
struct Side {
    env: Env,
    log: Arc<Mutex<Log>>,
}

impl Side {
    fn begin(
        pair: &Pair<'_>,
        changed: bool,
        make: &dyn Fn() -> Helper,
        leak: Option<Leak>,
    ) -> Result<Side> {
        let mut setup = pair.episode.setup().clone();
        setup.horizon = pair.frames;
        if changed {
            pair.secret.change(&mut setup);
        }
        let episode = Episode::new(pair.episode.id(), "audit", None, setup)?;
        let log = Arc::new(Mutex::new(Log::leaking_by(leak)));
        let Pair { rules, image_size, .. } = *pair;
        let config = EpisodeConfig {
            episode: &episode,
            seed: 0,
            rules,
            helper: "watched",
            partner: None,
            image_size: Some(image_size),
            appearance: chaic_render::Appearance::Canonical,
        };
        // Probers that draw the same numbers in all episodes would try less.
        let helper = seeded_by_episode(make(), &config);
        let people = people(pair, episode.setup(), rules.planner, helper, &log);
        Ok(Side { env: Env::with_seats(config, people)?, log })
    }

    /// When somebody decides next; `None` at the end.
    fn next_decision(&self) -> Option<Frame> {
        let world = self.env.world();
        (!world.is_over()).then_some(world.state().frame)
    }

    /// Whether the watched helper decides next.
    fn asks_helper(&self) -> bool {
        self.env.world().waiting().contains(&AgentId::HELPER)
    }

    /// Lets all decide whose turn it is, and plays on to the next decision.
    fn decide(&mut self) -> Result<()> {
        let world = self.env.world();
        self.log().overhear(world);
        let next = world.state().frame + 1;
        self.env.advance(Some(next))?;
        Ok(())
    }

    fn log(&self) -> MutexGuard<'_, Log> {
        self.log.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Partner, watched helper, and a child that lives by its own rules.
fn people(
    pair: &Pair<'_>,
    setup: &Setup,
    rules: PlannerRules,
    helper: Helper,
    log: &Arc<Mutex<Log>>,
) -> Vec<Seat> {
    let spy = Spy { mind: helper.mind, log: Arc::clone(log) };
    let helper = Helper { mind: Box::new(spy), grants: helper.grants };
    let mut seats = seats(setup, Minds::of(Some(helper), None), rules);
    if pair.partner == Partner::Waits {
        let waits = Seat::of_mind(Box::new(Idle), partners::PARTNER_GRANTS);
        seats[AgentId::PARTNER.index()] = waits;
    }
    seats
}
