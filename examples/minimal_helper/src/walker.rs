//! A helper without map or plans: it walks to the first possible target in view, picks it up, looks for
//! the goal place, and puts it there.

use std::collections::BTreeMap;

use chaic_core::geom::{horizontal_distance, wrap_angle, yaw_towards};
use chaic_core::observation::{HeldIdentity, SensorConfig};
use chaic_core::rng::RngStream;
use chaic_core::{
    Action, Agent, AgentError, Briefing, ClassId, EntityId, Hand, Observation, Outcome, Target,
    Vec3,
};

/// Maximum distance at which the helper picks up or puts on objects, meters.
const NEAR_M: f32 = 1.3;
/// The path ahead is blocked if the depth straight ahead is below this, meters.
const BLOCKED_M: f32 = 0.6;

/// State of one episode.
#[derive(Default)]
pub struct Walker {
    /// Briefing and random draws; `None` before the first `reset`.
    episode: Option<(Briefing, RngStream)>,
    /// Targets of failed actions, which the helper does not try again.
    given_up: Vec<Target>,
    /// Remaining turns of the current detour.
    detour: u32,
}

impl Agent for Walker {
    fn sensors(&self) -> SensorConfig {
        SensorConfig { image_size: 128, ..SensorConfig::DEPTH_AND_IDS }
    }

    fn reset(&mut self, briefing: &Briefing) {
        let stream = RngStream::new(briefing.seed, "minimal", 0);
        *self = Walker { episode: Some((briefing.clone(), stream)), ..Walker::default() };
    }

    fn act(&mut self, seen: &Observation) -> Result<Action, AgentError> {
        let Some((briefing, stream)) = &mut self.episode else {
            return Ok(Action::Wait { frames: 10 });
        };
        if let Some((action, Outcome::Failure(_))) = seen.proprioception.last {
            self.given_up.extend(action.subject());
            self.detour = 2 + stream.below(4) as u32;
        }
        let holds = seen.proprioception.held().next().is_some();
        let is_wanted = |class: ClassId| {
            let classes = if holds { &briefing.goal_places } else { &briefing.possible_targets };
            classes.contains(&class)
        };
        let subject = nearest(seen, &is_wanted, |e| {
            let is_held = |k: &HeldIdentity| k.entity == e;
            !self.given_up.contains(&Target::Entity(e))
                && !seen.proprioception.held().filter_map(|h| h.identity.as_ref()).any(is_held)
        });
        Ok(match subject {
            Some((entity, at))
                if horizontal_distance(at, seen.proprioception.pose.position) < NEAR_M =>
            {
                self.detour = 0;
                let (target, hand) = (Target::Entity(entity), Hand::Right);
                if holds {
                    Action::PutOn { place: target, hand }
                } else {
                    Action::PickUp { object: target, hand }
                }
            }
            _ if self.detour > 0 => {
                self.detour -= 1;
                Action::TurnLeft
            }
            _ if depth_ahead_m(seen) < BLOCKED_M => {
                self.detour = 2 + stream.below(6) as u32;
                Action::TurnLeft
            }
            Some((_, at)) => steer(seen, at),
            None => Action::MoveForward,
        })
    }
}

/// Returns the nearest visible entity of a wanted class, with the mean of its visible points in the world.
fn nearest(
    seen: &Observation,
    is_wanted: &dyn Fn(ClassId) -> bool,
    is_open: impl Fn(EntityId) -> bool,
) -> Option<(EntityId, Vec3)> {
    let (ids, depth) = (seen.images.ids.as_ref()?, seen.images.depth_m.as_ref()?);
    let mut sums = BTreeMap::<u16, (Vec3, f32)>::new();
    for (i, (id, depth_m)) in ids.iter().zip(depth).enumerate() {
        let class = seen.granted.class_of(EntityId(*id));
        if class.is_some_and(is_wanted) && is_open(EntityId(*id)) {
            let (row, column) = (i as u32 / seen.camera.width, i as u32 % seen.camera.width);
            let sum = sums.entry(*id).or_default();
            sum.0 += seen.camera.unproject(column, row, *depth_m);
            sum.1 += 1.0;
        }
    }
    let here = seen.proprioception.pose.position;
    let means = sums.into_iter().map(|(id, (sum, n))| (EntityId(id), sum / n));
    means.min_by(|a, b| horizontal_distance(a.1, here).total_cmp(&horizontal_distance(b.1, here)))
}

/// Returns the depth of the central pixel, meters.
fn depth_ahead_m(seen: &Observation) -> f32 {
    let middle = (seen.camera.height / 2 * seen.camera.width + seen.camera.width / 2) as usize;
    seen.images.depth_m.as_ref().map_or(f32::INFINITY, |d| d[middle])
}

/// Turns towards a point, or steps forward when facing it.
fn steer(seen: &Observation, at: Vec3) -> Action {
    let off = wrap_angle(
        yaw_towards(seen.proprioception.pose.position, at) - seen.proprioception.pose.yaw_rad,
    );
    match off.to_degrees() {
        d if d > 10.0 => Action::TurnLeft,
        d if d < -10.0 => Action::TurnRight,
        _ => Action::MoveForward,
    }
}
