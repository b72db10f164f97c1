//! Is what is hidden hidden? Two plays of one episode that differ in a secret of the partner alone
//! are held against each other, as one agent perceives them (a test of non-interference).
//!
//! As long as nothing differs that the agent's eyes could see or its hands could feel, all that it
//! is told must be the same: images, outcomes of its actions, their reasons and durations,
//! everything. The first difference without such a cause is a [`Finding`]. What follows after a
//! visible difference proves nothing, and is not looked at.
//!
//! **What it is not**: it judges no helper. Its own agent, the [`Prober`], tries whatever an agent
//! may try, to learn what it should not.

mod prober;
mod secret;
mod spy;

pub use prober::Prober;
pub use secret::Secret;
pub use spy::Leak;

use std::fmt;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

use chaic_agents::{PlannerRules, partners};
use chaic_episodes::Episode;
use chaic_protocol::geom::horizontal_distance;
use chaic_protocol::{AgentId, Frame, Vec3};
use chaic_world::{Setup, World};

use crate::error::Result;
use crate::helpers::Helper;
use crate::play::{Actor, Bystander, Cast, Minds, Play, Staging, cast};
use crate::rules::RuleSet;
use spy::{Log, Seen, Spy};

/// Whatever differs within this distance of an agent, beyond half of its own length, may be felt,
/// metres: the world lets one step up to things at 3 m, and bodies touch on the way.
const FELT_M: f32 = 4.5;

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

/// Plays both and compares. `make` gives the watched helper, a fresh one each time.
///
/// # Errors
/// If the episode can't be played.
pub fn compare(pair: &Pair<'_>, make: &dyn Fn() -> Helper, leak: Option<Leak>) -> Result<Verdict> {
    let [one, other] = [false, true].map(|changed| Side::new(pair, changed, make, leak));
    let (one, other) = (one?, other?);
    let (a, b) = (one.log(), other.log());
    let found = |frame, what| Some(Finding { frame, what });
    if a.briefing != b.briefing {
        return Ok(Verdict { compared: 0, finding: found(0, "the briefing") });
    }
    let n = a.seen.len().min(b.seen.len());
    let differs = |k: &usize| difference(&a.seen[*k], &b.seen[*k]).is_some();
    let first = (0..n).find(differs);
    let Some(k) = first else {
        // One of them may have been asked once more before the end, if it was kept busy.
        return Ok(Verdict { compared: n, finding: None });
    };
    let what = difference(&a.seen[k], &b.seen[k]).unwrap_or("something");
    let frame = a.seen[k].observation.frame.min(b.seen[k].observation.frame);
    let is_fair = is_visible_or_felt(pair, make, what, frame)?;
    Ok(Verdict { compared: k, finding: if is_fair { None } else { found(frame, what) } })
}

/// What differs between two moments, if anything does. Images come last: whatever else differs has
/// to have a cause of its own.
fn difference(a: &Seen, b: &Seen) -> Option<&'static str> {
    let (x, y) = (&a.observation, &b.observation);
    let checks = [
        ("an image", x.images == y.images),
        ("the time", x.frame == y.frame),
        ("the outcome of the own action", x.own.last == y.own.last),
        ("the own state", x.own == y.own),
        ("the camera", x.camera == y.camera),
        ("what is granted", x.granted == y.granted),
        ("the own action", a.action == b.action),
    ];
    checks.into_iter().find(|(_, same)| !same).map(|(what, _)| what)
}

/// Whether the two worlds differ, at this moment, in something that the helper can see or feel.
fn is_visible_or_felt(
    pair: &Pair<'_>,
    make: &dyn Fn() -> Helper,
    what: &str,
    frame: Frame,
) -> Result<bool> {
    let until = |changed| {
        let mut side = Side::begin(pair, changed, make, None)?;
        side.play.run(&AtomicBool::new(false), Some(frame), &mut |_| Ok(()))?;
        Ok::<Side, crate::EvalError>(side)
    };
    let (one, other) = (until(false)?, until(true)?);
    let (a, b) = (one.play.world(), other.play.world());
    if what == "an image" {
        return Ok(differing(a, b).next().is_some());
    }
    let here = a.state().people[AgentId::HELPER.index()].pose.position;
    let near = differing(a, b).any(|(at, half_m)| horizontal_distance(at, here) < FELT_M + half_m);
    Ok(near)
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
    play: Play,
    log: Arc<Mutex<Log>>,
}

impl Side {
    /// Played to its end.
    fn new(
        pair: &Pair<'_>,
        changed: bool,
        make: &dyn Fn() -> Helper,
        leak: Option<Leak>,
    ) -> Result<Side> {
        let mut side = Side::begin(pair, changed, make, leak)?;
        match leak {
            None => {
                side.play.run(&AtomicBool::new(false), None, &mut |_| Ok(()))?;
            }
            Some(_) => side.play_leaking()?,
        }
        Ok(side)
    }

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
        let staging = Staging {
            episode: &episode,
            seed: 0,
            rules,
            helper: "watched",
            partner: None,
            image_size: Some(image_size),
            appearance: chaic_render::Appearance::Canonical,
        };
        let people = people(pair, episode.setup(), rules.planner, make(), &log);
        Ok(Side { play: Play::with_cast(staging, people)?, log })
    }

    /// The same with a leak planted: before each decision the log learns what the leak tells.
    fn play_leaking(&mut self) -> Result<()> {
        let stop = AtomicBool::new(false);
        loop {
            let frame = self.play.world().state().frame;
            self.log.lock().unwrap_or_else(PoisonError::into_inner).overhear(self.play.world());
            if self.play.run(&stop, Some(frame + 1), &mut |_| Ok(()))? {
                return Ok(());
            }
        }
    }

    fn log(&self) -> Log {
        self.log.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Partner, watched helper, and a child that lives by its own rules.
fn people(
    pair: &Pair<'_>,
    setup: &Setup,
    rules: PlannerRules,
    helper: Helper,
    log: &Arc<Mutex<Log>>,
) -> Cast {
    let spy = Spy { mind: helper.mind, log: Arc::clone(log) };
    let helper = Helper { mind: Box::new(spy), grants: helper.grants };
    let mut cast = cast(setup, Minds { helper: Some(helper), partner: None }, rules);
    if pair.partner == Partner::Waits {
        let waits = Actor::new(Box::new(Bystander), partners::PARTNER_GRANTS);
        cast.actors[AgentId::PARTNER.index()] = waits;
    }
    cast
}
