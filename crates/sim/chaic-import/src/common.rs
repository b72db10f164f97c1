//! Common parts of indoor and outdoor episodes.

use chaic_core::briefing::Goal;
use chaic_core::capability::{PersonKind, Persona};
use chaic_core::geom::{Pose, to_xz};
use chaic_core::{ClassId, TaskId, Vec2, Vec3};
use chaic_episodes::{mm, mm3};
use chaic_world::{AgentSpec, ObjectSpec, Setup};

use crate::dataset::Source;
use crate::package::Package;
use crate::piece::{PosedModel, to_object};
use crate::settle::Surroundings;
use crate::tables::MODELS;
use crate::{ImportError, axes};

/// Returns the goal of the partner.
pub(crate) fn goal(source: &Source) -> Result<Goal, ImportError> {
    let mut targets: Vec<(ClassId, u32)> = Vec::new();
    for (i, (model, count)) in source.entry.task.goal_task.iter().enumerate() {
        let class = MODELS.get(model).map(|m| m.class).ok_or_else(|| {
            let field = format!("[{}].task.goal_task[{i}]", source.index);
            let problem = format!("names {model:?}, a model without a class");
            ImportError::field(&source.list_path, field, problem)
        })?;
        match targets.iter_mut().find(|(c, _)| *c == class) {
            Some((_, n)) => *n = n.saturating_add(*count),
            None => targets.push((class, *count)),
        }
    }
    targets.sort();
    Ok(Goal { targets })
}

/// Returns the kinds of the people, in the order of agents.
fn kinds(task: TaskId) -> Vec<PersonKind> {
    let mut kinds = vec![task.info().partner, Persona::Helper.into()];
    kinds.extend(task.info().has_child.then_some(PersonKind::from(Persona::Child)));
    kinds
}

/// Returns the start position of an agent.
fn start(source: &Source, agent: usize) -> Result<Vec3, ImportError> {
    let start = source.metadata.agent.get(&agent.to_string()).ok_or_else(|| {
        let problem = format!("has no {agent}, expected the start of agent {agent}");
        ImportError::field(&source.metadata_path, "agent", problem)
    })?;
    // Outdoors agents are dropped from 0.1 m.
    let p = axes::point(start.position());
    Ok(mm3(Vec3::new(p.x, 0.0, p.z)))
}

/// Returns the people of an episode. Each starts at the free position nearest to its recorded
/// start: the original's grid has coarser cells than ours.
pub(crate) fn people(
    source: &Source,
    setup: &Setup,
    yaws_deg: [f32; 3],
) -> Result<Vec<AgentSpec>, ImportError> {
    let surroundings = Surroundings::new(setup);
    let mut people: Vec<AgentSpec> = Vec::new();
    for (agent, kind) in kinds(source.task).into_iter().enumerate() {
        let recorded = start(source, agent)?;
        let radius_m = kind.capability().radius_m;
        let apart = |p: &AgentSpec| (to_xz(p.pose.position), p.capability().radius_m + radius_m);
        let apart: Vec<(Vec2, f32)> = people.iter().map(apart).collect();
        // Bodies keep a distance of 1 cm, so that nothing touches at the start.
        let free = surroundings.free_position(to_xz(recorded), radius_m + 0.01, &apart);
        let p = free.unwrap_or(to_xz(recorded));
        let pose = Pose {
            position: mm3(Vec3::new(p.x, 0.0, p.y)),
            yaw_rad: mm(axes::yaw_rad(yaws_deg[agent])),
        };
        people.push(person(source, agent, kind, pose));
    }
    Ok(people)
}

/// Returns a person; appearances vary between episodes.
fn person(source: &Source, agent: usize, kind: PersonKind, pose: Pose) -> AgentSpec {
    AgentSpec::new(kind, pose, ((3 * source.index + 5 * agent) % 16) as u8)
}

/// Returns an object after the commands, before it falls.
pub(crate) fn object(
    source: &Source,
    i: usize,
    package: &Package,
) -> Result<ObjectSpec, ImportError> {
    let object = &source.objects[i];
    let posed = PosedModel {
        model: &object.model,
        position: object.position.into(),
        euler_deg: object.euler_deg.into(),
        scale: object.scale.into(),
    };
    to_object(&posed, package).map_err(|problem| {
        ImportError::field(&source.commands_path, format!("object {i}, name"), problem)
    })
}
