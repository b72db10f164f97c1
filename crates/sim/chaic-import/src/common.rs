//! What indoor and outdoor episodes share.

use chaic_core::briefing::Goal;
use chaic_core::capability::{PersonKind, Persona};
use chaic_core::geom::{Pose, xz};
use chaic_core::{ClassId, TaskId, Vec2, Vec3};
use chaic_episodes::{mm, mm3};
use chaic_world::{Person, Setup, Thing};

use crate::dataset::Source;
use crate::package::Package;
use crate::piece::{Posed, thing};
use crate::settle::Surroundings;
use crate::tables::MODELS;
use crate::{ImportError, axes};

/// What the partner wants.
pub(crate) fn goal(source: &Source) -> Result<Goal, ImportError> {
    let mut targets: Vec<(ClassId, u32)> = Vec::new();
    for (i, (model, wanted)) in source.entry.task.goal_task.iter().enumerate() {
        let class = MODELS.get(model).map(|m| m.class).ok_or_else(|| {
            let field = format!("[{}].task.goal_task[{i}]", source.index);
            let problem = format!("names {model:?}, a model without a class");
            ImportError::field(&source.list_path, field, problem)
        })?;
        match targets.iter_mut().find(|(c, _)| *c == class) {
            Some((_, n)) => *n += wanted,
            None => targets.push((class, *wanted)),
        }
    }
    targets.sort();
    Ok(Goal { targets })
}

/// Who takes part, in the order of agents.
fn kinds(task: TaskId) -> Vec<PersonKind> {
    let mut kinds = vec![task.info().partner, Persona::Helper.into()];
    kinds.extend(task.info().has_child.then_some(PersonKind::from(Persona::Child)));
    kinds
}

/// Where an agent stands at the start.
fn start(source: &Source, agent: usize) -> Result<Vec3, ImportError> {
    let start = source.metadata.agent.get(&agent.to_string()).ok_or_else(|| {
        let problem = format!("has no {agent}, expected where agent {agent} starts");
        ImportError::field(&source.metadata_path, "agent", problem)
    })?;
    // Outdoors agents are dropped from 0.1 m.
    let p = axes::point(start.position());
    Ok(mm3(Vec3::new(p.x, 0.0, p.z)))
}

/// The people of an episode, each as near to its recorded start as the surroundings have room for
/// its body: the original keeps them clear of its own grid, whose cells are coarser than ours.
pub(crate) fn people(
    source: &Source,
    setup: &Setup,
    yaws_deg: [f32; 3],
) -> Result<Vec<Person>, ImportError> {
    let around = Surroundings::of(setup);
    let mut people: Vec<Person> = Vec::new();
    for (agent, kind) in kinds(source.task).into_iter().enumerate() {
        let recorded = start(source, agent)?;
        let radius_m = kind.capability().radius_m;
        let apart = |p: &Person| (xz(p.pose.position), p.capability().radius_m + radius_m);
        let apart: Vec<(Vec2, f32)> = people.iter().map(apart).collect();
        // Bodies keep a centimetre apart, so that nobody starts in touch with anything.
        let free = around.free_place(xz(recorded), radius_m + 0.01, &apart);
        let p = free.unwrap_or(xz(recorded));
        let pose = Pose {
            position: mm3(Vec3::new(p.x, 0.0, p.y)),
            yaw_rad: mm(axes::yaw_rad(yaws_deg[agent])),
        };
        people.push(person(source, agent, kind, pose));
    }
    Ok(people)
}

/// A person; looks differ from episode to episode.
fn person(source: &Source, agent: usize, kind: PersonKind, pose: Pose) -> Person {
    Person::new(kind, pose, ((3 * source.index + 5 * agent) % 16) as u8)
}

/// An object as the commands leave it, before it falls.
pub(crate) fn object(source: &Source, i: usize, package: &Package) -> Result<Thing, ImportError> {
    let object = &source.objects[i];
    let posed = Posed {
        model: &object.model,
        position: object.position.into(),
        euler_deg: object.euler_deg.into(),
        scale: object.scale.into(),
    };
    thing(&posed, package).map_err(|problem| {
        ImportError::field(&source.commands_path, format!("object {i}, name"), problem)
    })
}
