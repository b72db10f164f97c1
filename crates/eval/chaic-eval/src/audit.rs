//! Non-interference test: two runs of one episode differ only in a secret of the partner, and the
//! observations of one agent are compared.
//!
//! As long as nothing differs that the agent can see or touch, its observations must be equal:
//! images, and the outcomes, reasons and durations of its actions. The first difference without a
//! visible cause is a [`Violation`], unless a rule or a grant discloses it. The comparison ends at
//! the first difference.
//!
//! **What it is not**: it does not evaluate helpers. Its own agent, the [`ProbeAgent`], tries all
//! actions that could reveal a secret.

pub mod opening;
mod probe_agent;
mod recording_agent;
mod secret;

pub use probe_agent::ProbeAgent;
pub use recording_agent::Leak;
pub use secret::HiddenProperty;

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use chaic_agents::{PlannerRules, partners};
use chaic_core::geom::horizontal_distance;
use chaic_core::observation::Observation;
use chaic_core::{Action, AgentId, Frame, Vec3};
use chaic_env::helper_registry::Helper;
use chaic_env::rules::RuleSet;
use chaic_env::{
    AgentSlot, Env, EpisodeAgents, EpisodeConfig, NoopAgent, agent_slots, seeded_by_episode,
};
use chaic_episodes::Episode;
use chaic_world::{JointLift, Setup, World};
use recording_agent::{ObservationLog, RecordedDecision, RecordingAgent};

use crate::error::Result;

/// Distance from an agent within which differences may be perceived by touch, in addition to half
/// the length of the object, meters. The world lets an agent approach objects from 3 m, and bodies
/// touch on the way.
const TOUCH_RANGE_M: f32 = 4.5;

/// Names of differences that need a special rule.
const GRANTED: &str = "granted information";
const TIME: &str = "the frame";

/// Behavior of the partner during the test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartnerMode {
    /// It follows its own rules, so its secret becomes visible.
    Acts,
    /// It stands still, so nothing becomes visible.
    Waits,
}

/// Configuration of a pair of runs.
#[derive(Clone, Copy)]
pub struct RunPair<'a> {
    /// The episode.
    pub episode: &'a Episode,
    /// Hidden property that differs between the two runs.
    pub secret: HiddenProperty,
    /// Behavior of the partner.
    pub partner: PartnerMode,
    /// Rules of both runs.
    pub rules: RuleSet,
    /// Length of a run, frames.
    pub frames: Frame,
    /// Side of the images, pixels.
    pub image_size: u32,
}

/// Information that an agent received without being able to see or touch its cause.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Violation {
    /// Frame of the observation.
    pub frame: Frame,
    /// Name of the part of the observation that differed.
    pub part: &'static str,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "frame {}: {} differs, and nothing in sight or reach does", self.frame, self.part)
    }
}

/// Outcome of the comparison of a pair.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoninterferenceResult {
    /// Number of observations that were equal before a visible difference or the end.
    pub compared: usize,
    /// First violation, if any.
    pub violation: Option<Violation>,
}

/// Runs both worlds in lockstep and compares observations up to the first difference. `make`
/// creates the watched helper of each run.
///
/// # Errors
/// If the episode can't be played.
pub fn compare(
    pair: &RunPair<'_>,
    make: &dyn Fn() -> Helper,
    leak: Option<Leak>,
) -> Result<NoninterferenceResult> {
    let mut runs =
        [AuditedRun::start(pair, false, make, leak)?, AuditedRun::start(pair, true, make, leak)?];
    let violation = |frame, part| Some(Violation { frame, part });
    if runs[0].log().briefing != runs[1].log().briefing {
        return Ok(NoninterferenceResult { compared: 0, violation: violation(0, "the briefing") });
    }
    let mut compared = 0;
    // Both worlds when the first of the two helpers received the next observation.
    let mut worlds_before: Option<[World; 2]> = None;
    // One of them may decide once more before the end, if the other was busy.
    while let Some(frame) = runs.iter().filter_map(AuditedRun::next_decision).min() {
        let is_next = |run: &AuditedRun| run.next_decision() == Some(frame);
        if worlds_before.is_none() && runs.iter().any(|run| is_next(run) && run.waits_for_helper())
        {
            worlds_before = Some([runs[0].env.world().clone(), runs[1].env.world().clone()]);
        }
        for run in runs.iter_mut().filter(|run| is_next(run)) {
            run.decide()?;
        }
        let Some([a, b]) = next_decisions(&runs) else { continue };
        if let Some(part) = difference(&a, &b) {
            let (x, y) = (&a.observation, &b.observation);
            let is_caused =
                |worlds: &[World; 2]| is_perceptible(worlds, part) || is_joint_lift(worlds, part);
            let is_explained =
                is_disclosed(pair, part, x, y) || worlds_before.as_ref().is_some_and(is_caused);
            let frame = x.frame.min(y.frame);
            let violation = if is_explained { None } else { violation(frame, part) };
            return Ok(NoninterferenceResult { compared, violation });
        }
        (compared, worlds_before) = (compared + 1, None);
    }
    Ok(NoninterferenceResult { compared, violation: None })
}

/// Returns the next observation of both helpers when both are available.
fn next_decisions(runs: &[AuditedRun; 2]) -> Option<[RecordedDecision; 2]> {
    let [mut a, mut b] = runs.each_ref().map(AuditedRun::log);
    if a.decisions.is_empty() || b.decisions.is_empty() {
        return None;
    }
    Some([a.decisions.pop_front()?, b.decisions.pop_front()?])
}

/// Returns the first part that differs between two observations. A difference of images takes
/// precedence; any other difference needs a cause near the helper.
fn difference(a: &RecordedDecision, b: &RecordedDecision) -> Option<&'static str> {
    let (x, y) = (&a.observation, &b.observation);
    let checks = [
        ("an image", x.images == y.images && x.frame_history == y.frame_history),
        (TIME, x.frame == y.frame),
        ("the outcome of the agent's last action", x.proprioception.last == y.proprioception.last),
        ("the proprioception", x.proprioception == y.proprioception),
        ("the camera", x.camera == y.camera),
        (GRANTED, x.granted == y.granted),
        ("the action", a.action == b.action),
    ];
    checks.into_iter().find(|(_, same)| !same).map(|(part, _)| part)
}

/// Returns whether rules or grants disclose all differences in granted data. Rules may announce
/// removed obstacles. Granted behavior shows the action of a partner in the image, even if its
/// posture does not show the action yet. The granted state discloses all objects, and the
/// behavior of the partner at any place.
fn is_disclosed(pair: &RunPair<'_>, part: &str, a: &Observation, b: &Observation) -> bool {
    let undisclosed = |o: &Observation| {
        let mut granted = o.granted.clone();
        if pair.rules.world.announces_removed_obstacles {
            granted.removed.clear();
        }
        let sees_partner = granted.classes.iter().any(|(e, _)| e.agent() == Some(AgentId::PARTNER));
        if granted.state.take().is_some() || sees_partner {
            granted.behavior.retain(|behavior| behavior.agent != AgentId::PARTNER);
            granted.partner_hands = None;
        }
        granted
    };
    part == GRANTED && undisclosed(a) == undisclosed(b)
}

/// Returns whether two worlds differ in something that the helper can see or touch.
fn is_perceptible([a, b]: &[World; 2], part: &str) -> bool {
    if part == "an image" {
        return differing_positions(a, b).next().is_some();
    }
    let position = a.state().agents[AgentId::HELPER.index()].pose.position;
    differing_positions(a, b)
        .any(|(at, half_m)| horizontal_distance(at, position) < TOUCH_RANGE_M + half_m)
}

/// Returns whether a joint lift explains a different duration of the helper's action. Then the
/// partner chose the furniture that the helper chose last, in one of the two worlds only. Some
/// rules send the helper there from any distance.
fn is_joint_lift([a, b]: &[World; 2], part: &str) -> bool {
    let is_called = |world: &World| {
        let chose = |agent: AgentId| {
            let person = &world.state().agents[agent.index()];
            let last = person.activity.as_ref().map(|a| a.action).or(person.last.map(|l| l.0));
            last.filter(|action| matches!(action, Action::PickUp { .. }))?.subject()
        };
        let calls = world.rules().joint_lift == JointLift::LastChoice;
        calls && chose(AgentId::HELPER).is_some_and(|o| chose(AgentId::PARTNER) == Some(o))
    };
    part == TIME && is_called(a) != is_called(b)
}

/// Returns the positions of differing objects and agents of two worlds, each with half its
/// length in meters.
fn differing_positions<'a>(a: &'a World, b: &'a World) -> impl Iterator<Item = (Vec3, f32)> + 'a {
    let (x, y) = (a.state(), b.state());
    let objects = x.objects.iter().zip(&y.objects).enumerate();
    let objects = objects.filter(|(_, (p, q))| {
        p.position != q.position || p.rotation != q.rotation || p.location != q.location
    });
    let half_m = |k: usize| 0.5 * a.setup().things[k].size_m().max_element();
    let objects =
        objects.flat_map(move |(k, (p, q))| [(p.position, half_m(k)), (q.position, half_m(k))]);
    let people = a
        .setup()
        .agents()
        .filter(|agent| *agent != AgentId::HELPER && a.posture(*agent) != b.posture(*agent));
    let at = |w: &World, agent: AgentId| w.state().agents[agent.index()].pose.position;
    objects.chain(people.flat_map(move |agent| [(at(a, agent), 0.0), (at(b, agent), 0.0)]))
}

/// One of the two runs.
struct AuditedRun {
    env: Env,
    log: Arc<Mutex<ObservationLog>>,
}

impl AuditedRun {
    fn start(
        pair: &RunPair<'_>,
        changed: bool,
        make: &dyn Fn() -> Helper,
        leak: Option<Leak>,
    ) -> Result<AuditedRun> {
        let mut setup = pair.episode.setup().clone();
        setup.horizon = pair.frames;
        if changed {
            pair.secret.change(&mut setup);
        }
        let episode = Episode::new(pair.episode.id(), "audit", None, setup)?;
        let log = Arc::new(Mutex::new(ObservationLog::with_leak(leak)));
        let RunPair { rules, image_size, .. } = *pair;
        let config = EpisodeConfig {
            rules,
            image_size: Some(image_size),
            ..EpisodeConfig::new(&episode, "watched")
        };
        // Probe agents with the same random numbers in all episodes would try fewer actions.
        let helper = seeded_by_episode(make(), &config);
        let slots = audit_slots(pair, episode.setup(), rules.planner, helper, &log);
        Ok(AuditedRun { env: Env::with_slots(config, slots)?, log })
    }

    /// Returns the frame of the next decision; `None` at the end.
    fn next_decision(&self) -> Option<Frame> {
        let world = self.env.world();
        (!world.is_over()).then_some(world.state().frame)
    }

    /// Returns whether the watched helper decides next.
    fn waits_for_helper(&self) -> bool {
        self.env.world().waiting().contains(&AgentId::HELPER)
    }

    /// Lets all waiting agents decide, and runs to the next decision.
    fn decide(&mut self) -> Result<()> {
        let world = self.env.world();
        self.log().read_leak(world);
        let next = world.state().frame + 1;
        self.env.advance(Some(next))?;
        Ok(())
    }

    fn log(&self) -> MutexGuard<'_, ObservationLog> {
        self.log.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Returns the slots of the partner, the watched helper and a rule-based child.
fn audit_slots(
    pair: &RunPair<'_>,
    setup: &Setup,
    rules: PlannerRules,
    helper: Helper,
    log: &Arc<Mutex<ObservationLog>>,
) -> Vec<AgentSlot> {
    let recorder = RecordingAgent { agent: helper.agent, log: Arc::clone(log) };
    let helper = Helper { agent: Box::new(recorder), grants: helper.grants };
    let mut slots = agent_slots(setup, EpisodeAgents::new(Some(helper), None), rules);
    if pair.partner == PartnerMode::Waits {
        let idle = AgentSlot::with_agent(Box::new(NoopAgent), partners::PARTNER_GRANTS);
        slots[AgentId::PARTNER.index()] = idle;
    }
    slots
}
