//! A helper of one's own, evaluated against having none: copy this folder and begin.
//!
//! It knows no map and makes no plans: it walks towards the first possible target it sees, takes
//! it, looks for the goal place, and puts it there. `cargo run --release -p minimal-helper`
//! plays three tasks and prints the table.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use anyhow::Result;
use chaic_core::geom::{horizontal_distance, wrap_angle, yaw_towards};
use chaic_core::observation::{Grants, Identity, Senses};
use chaic_core::rng::Stream;
use chaic_core::{
    Action, Agent, AgentError, Briefing, ClassId, EntityId, Hand, Observation, Outcome, Target,
    TaskId, Vec3,
};
use chaic_env::minds::{Helper, Helpers};
use chaic_env::rules::PlannerRules;
use chaic_eval::metrics::FormulaSet;
use chaic_eval::report::{Format, Report};
use chaic_eval::run::{Access, Run, RunRequest};

/// How near to walk before taking or putting, metres.
const NEAR_M: f32 = 1.3;
/// Something this near straight ahead is in the way, metres.
const IN_THE_WAY_M: f32 = 0.6;

/// The whole mind.
#[derive(Default)]
struct Minimal {
    /// What it was told; set by `reset`.
    told: Option<(Briefing, Stream)>,
    /// What it has tried in vain.
    given_up: Vec<Target>,
    /// The way it goes round things: turns left to do.
    detour: u32,
}

impl Agent for Minimal {
    fn senses(&self) -> Senses {
        Senses { image_size: 128, ..Senses::DEPTH_AND_IDS }
    }

    fn reset(&mut self, briefing: &Briefing) {
        let stream = Stream::new(briefing.seed, "minimal", 0);
        *self = Minimal { told: Some((briefing.clone(), stream)), ..Minimal::default() };
    }

    fn act(&mut self, seen: &Observation) -> Result<Action, AgentError> {
        let Some((briefing, stream)) = &mut self.told else {
            return Ok(Action::Wait { frames: 10 });
        };
        if let Some((action, Outcome::Failure(_))) = seen.own.last {
            self.given_up.extend(action.subject());
            self.detour = 2 + stream.below(4) as u32;
        }
        let holds = seen.own.held().next().is_some();
        let wanted = |class: ClassId| {
            if holds {
                briefing.goal_places.contains(&class)
            } else {
                briefing.possible_targets.contains(&class)
            }
        };
        let subject = nearest(seen, &wanted, |e| {
            let holds_it = |k: &Identity| k.entity == e;
            !self.given_up.contains(&Target::Entity(e))
                && !seen.own.held().filter_map(|h| h.identity.as_ref()).any(holds_it)
        });
        Ok(match subject {
            Some((entity, at)) if horizontal_distance(at, seen.own.pose.position) < NEAR_M => {
                self.detour = 0;
                let hand = Hand::Right;
                if holds {
                    Action::PutOn { place: Target::Entity(entity), hand }
                } else {
                    Action::PickUp { object: Target::Entity(entity), hand }
                }
            }
            _ if self.detour > 0 => {
                self.detour -= 1;
                Action::TurnLeft
            }
            _ if depth_ahead(seen) < IN_THE_WAY_M => {
                self.detour = 2 + stream.below(6) as u32;
                Action::TurnLeft
            }
            Some((_, at)) => steer(seen, at),
            None => Action::MoveForward,
        })
    }
}

/// The nearest thing in view of a wanted class: its id and the mean of its visible points.
fn nearest(
    seen: &Observation,
    wanted: &dyn Fn(ClassId) -> bool,
    is_open: impl Fn(EntityId) -> bool,
) -> Option<(EntityId, Vec3)> {
    let (ids, depth) = (seen.images.ids.as_ref()?, seen.images.depth_m.as_ref()?);
    let mut sums = std::collections::BTreeMap::<u16, (Vec3, f32)>::new();
    for (i, (id, depth_m)) in ids.iter().zip(depth).enumerate() {
        let class = seen.granted.class_of(EntityId(*id));
        if class.is_some_and(wanted) && is_open(EntityId(*id)) {
            let (row, column) = (i as u32 / seen.camera.width, i as u32 % seen.camera.width);
            let sum = sums.entry(*id).or_default();
            sum.0 += seen.camera.unproject(column, row, *depth_m);
            sum.1 += 1.0;
        }
    }
    let here = seen.own.pose.position;
    let means = sums.into_iter().map(|(id, (sum, n))| (EntityId(id), sum / n));
    means.min_by(|a, b| horizontal_distance(a.1, here).total_cmp(&horizontal_distance(b.1, here)))
}

/// Depth of the pixel in the middle, metres.
fn depth_ahead(seen: &Observation) -> f32 {
    let middle = (seen.camera.height / 2 * seen.camera.width + seen.camera.width / 2) as usize;
    seen.images.depth_m.as_ref().map_or(f32::INFINITY, |d| d[middle])
}

/// A turn towards a point, or a step if one faces it.
fn steer(seen: &Observation, at: Vec3) -> Action {
    let off = wrap_angle(yaw_towards(seen.own.pose.position, at) - seen.own.pose.yaw_rad);
    match off.to_degrees() {
        d if d > 10.0 => Action::TurnLeft,
        d if d < -10.0 => Action::TurnRight,
        _ => Action::MoveForward,
    }
}

/// Where the run finds this helper.
struct Mine;

impl Helpers for Mine {
    fn names(&self) -> Vec<String> {
        vec!["minimal".to_owned()]
    }

    fn make(&self, name: &str, _: PlannerRules) -> Option<Helper> {
        (name == "minimal")
            .then(|| Helper { mind: Box::new(Minimal::default()), grants: Grants::PLANNER })
    }
}

fn main() -> Result<()> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "runs/minimal".to_owned());
    let given = RunRequest {
        tasks: Some(vec![TaskId::NoConstraint, TaskId::LowTarget, TaskId::Shopping]),
        helpers: Some(vec!["none".to_owned(), "minimal".to_owned()]),
        first: Some(4),
        ..RunRequest::default()
    };
    let (mut run, _) = Run::open(Path::new(&out), Access::Resume, &given, &Mine)?;
    run.play(2, &Mine, &AtomicBool::new(false), &mut |_| {})?;
    let (options, results, planned) = (run.options(), run.results(), run.planned());
    let (granted, formulas) = (Some(run.granted()), FormulaSet::Paper);
    let report = Report { options, results, planned, granted, formulas };
    println!("{}", report.text(Format::Table));
    Ok(())
}
