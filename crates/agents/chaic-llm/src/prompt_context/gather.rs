//! Prompt context from an agent's memory.

use chaic_agents::behavior::ObservedInteraction;
use chaic_agents::decision::{Context, Plan};
use chaic_agents::mapping::MappedObject;
use chaic_agents::memory::Memory;
use chaic_agents::track::CarriedObject;
use chaic_agents::{Intent, TrackId};
use chaic_core::briefing::CompanionRole;
use chaic_core::capability::{Capability, Gait, Impairments, PersonKind, Persona};
use chaic_core::geom::{horizontal_distance, to_xz};
use chaic_core::{Action, AgentId, ClassId, Frame, Outcome, Role};

use super::hands::put_away;
use super::{
    BodyFacts, ClassCount, DisclosedFacts, GoalPlace, Interaction, ListLimits, MapFacts,
    ObjectFacts, PersonFacts, PlanFacts, ProgressFacts, PromptContext, SelfFacts, plain, plan_text,
};
use crate::prompt_track::PromptTrack;

/// Distance from its guardian beyond which a child is lost, meters (docs/metrics.md, emergency
/// rate).
const AWAY_M: f32 = 3.5;
/// Maximum age of compared positions, frames.
const FRESH_FRAMES: Frame = 150;
/// Maximum number of listed goal places.
const MAX_GOAL_PLACES: usize = 3;
/// Ratio of actual walking time, with turns, to distance at full speed.
const WALK_FACTOR: f32 = 1.5;

impl PromptContext {
    /// Builds the prompt context of an agent, and the list of `plans`. Plans of one kind are sorted
    /// by distance.
    pub fn new(
        track: PromptTrack,
        context: &Context<'_>,
        plans: &[Plan],
        last_plan: Option<Plan>,
        images: usize,
        length: ListLimits,
    ) -> (PromptContext, Vec<Plan>) {
        let Context { briefing, memory, .. } = *context;
        let listed = keep_nearest(plans, length.plans_per_kind);
        let labels = |classes: &[ClassId]| {
            let mut names: Vec<String> = classes.iter().map(|c| plain(c.info().label)).collect();
            let mut seen = std::collections::BTreeSet::new();
            names.retain(|n| seen.insert(n.clone()));
            names
        };
        let speed = briefing.capability.speed_m_per_frame.max(1e-3);
        let wanted = briefing.goal.iter().filter(|_| track == PromptTrack::Partner);
        let facts = PromptContext {
            track,
            goal_place: labels(&briefing.goal_places).join(" or "),
            targets: labels(&briefing.possible_targets),
            containers: labels(&briefing.containers),
            obstacles: labels(&briefing.obstacles),
            capacity: briefing.container_capacity,
            is_moving_house: briefing
                .possible_targets
                .iter()
                .any(|c| c.info().role == Role::HeavyTarget),
            has_child: briefing.companion(CompanionRole::Child).is_some(),
            has_partner: briefing.companion(CompanionRole::Partner).is_some(),
            n_images: images,
            horizon: briefing.horizon,
            frames_per_10_m: (10.0 / speed / 10.0).round() as u32 * 10,
            me: body(&briefing.capability),
            disclosed: briefing.disclosure.filter(|_| track == PromptTrack::KnownTask).map(
                |disclosure| DisclosedFacts {
                    task: disclosure.task.name(),
                    partner: person(disclosure.partner),
                    reach: reach(&disclosure.partner.capability()),
                    strength_kg: disclosure.partner.capability().strength_kg as u32,
                },
            ),
            wanted: wanted
                .flat_map(|goal| &goal.targets)
                .map(|(class, n)| ClassCount { name: plain(class.info().label), count: *n })
                .collect(),
            own: self_facts(context, last_plan, length),
            others: other_agents(context, length),
            progress: progress(context),
            map: map(context, length),
            plans: listed.iter().map(|p| plan_facts(memory, p)).collect(),
            n_omitted_plans: plans.len() - listed.len(),
        };
        (facts, listed)
    }
}

/// Keeps the nearest plans of each kind that concerns an object.
pub(super) fn keep_nearest(plans: &[Plan], max_per_kind: usize) -> Vec<Plan> {
    let mut kept: Vec<Plan> = Vec::new();
    for plan in plans {
        let is_same_kind = |p: &&Plan| std::mem::discriminant(*p) == std::mem::discriminant(plan);
        if kept.iter().filter(is_same_kind).count() < max_per_kind {
            kept.push(*plan);
        }
    }
    kept
}

/// Keeps the last entries of a list; returns them and the number of omitted ones.
pub(super) fn keep_last<T>(mut list: Vec<T>, limit: usize) -> (Vec<T>, usize) {
    let n_omitted = list.len().saturating_sub(limit);
    list.drain(..n_omitted);
    (list, n_omitted)
}

pub(super) fn meters(x: f32) -> String {
    let text = format!("{x:.1}");
    if text == "-0.0" { "0.0".to_owned() } else { text }
}

fn named(track: TrackId, class: Option<ClassId>) -> String {
    let label = class.map_or("something".to_owned(), |c| plain(c.info().label));
    format!("{label} {track}")
}

pub(super) fn reach(capability: &Capability) -> Option<[String; 2]> {
    let [low, high] = capability.pick_range_m;
    let is_limited = capability.pick_range_m != Persona::Adult.capability().pick_range_m;
    let height = |m: f32| format!("{m:.2}").trim_end_matches('0').trim_end_matches('.').to_owned();
    is_limited.then(|| [height(low), height(high)])
}

pub(super) fn body(capability: &Capability) -> BodyFacts {
    let height_m = capability.height_m;
    let kind = match capability.gait {
        Gait::Roll => "a person in a wheelchair".to_owned(),
        Gait::WalkBike => "a person who walks a bicycle".to_owned(),
        Gait::Walk => format!("a person of {height_m:.2} m"),
    };
    BodyFacts {
        kind: impaired(kind, Impairments::from_capability(capability)),
        reach: reach(capability),
        strength_kg: capability.strength_kg as u32,
        n_hands: capability.hands.all().len(),
        carries_containers: capability.carries_containers,
        lifts_furniture: capability.lifts_furniture,
        walks_bicycle: capability.docking_frames > 0,
        uses_wheelchair: capability.gait == Gait::Roll,
    }
}

pub(super) fn person(kind: PersonKind) -> String {
    let PersonKind { persona, impairments } = kind;
    let height_m = persona.capability().height_m;
    let description = match persona {
        Persona::Adult | Persona::Helper if impairments.is_empty() => {
            "an adult without any constraint".to_owned()
        }
        Persona::Adult | Persona::Helper => "an adult".to_owned(),
        Persona::Child => format!("a child of {height_m:.1} m who walks at half your speed"),
        Persona::Wheelchair => "a person in a wheelchair".to_owned(),
        Persona::Rider => {
            "a person who walks a bicycle with a basket, at half your speed, with a child along"
                .to_owned()
        }
        Persona::Frail => "a frail person".to_owned(),
    };
    impaired(description, impairments)
}

/// Describes a person with impairments.
fn impaired(who: String, impairments: Impairments) -> String {
    let sentence = |text: String, about: &str| format!("{text} and who {about}");
    let mut descriptions = impairments.iter().map(|i| i.info().about);
    let Some(first) = descriptions.next() else { return who };
    descriptions.fold(format!("{who} who {first}"), sentence)
}

fn describe_held(held: &CarriedObject) -> String {
    let name = held.object.map_or("something".to_owned(), |(t, class)| named(t, Some(class)));
    let mut inside: Vec<String> = held.contents.iter().map(|(t, c)| named(*t, Some(*c))).collect();
    inside.resize(held.n_contents as usize, "something".to_owned());
    let role = held.class().map(|class| class.info().role);
    let is_container = matches!(role, Some(Role::Container | Role::Vehicle));
    match (is_container, inside.is_empty()) {
        (true, true) => format!("{name} with nothing in it"),
        (true, false) => format!("{name} with {} in it", inside.join(", ")),
        (false, _) => name,
    }
}

fn self_facts(context: &Context<'_>, last_plan: Option<Plan>, length: ListLimits) -> SelfFacts {
    let Context { memory, briefing, .. } = *context;
    let (hands, usable) = (&memory.hands, briefing.capability.hands.all().iter());
    let here = memory.position();
    let interactions: Vec<Interaction> = memory
        .history
        .iter()
        .zip(put_away(&memory.history, |track| memory.class_of(track)))
        .map(|(record, put)| {
            interaction(memory, record.frame, record.action, Some(record.outcome), put)
        })
        .collect();
    let (history, n_omitted_interactions) = keep_last(interactions, length.interactions);
    SelfFacts {
        x: meters(here.x),
        z: meters(here.y),
        hands: hands.held().map(describe_held).collect(),
        free_hands: usable.filter(|h| hands.hands[h.index()].is_none()).count(),
        history,
        n_omitted_interactions,
        plan: last_plan.map(|p| plan_text(&p)),
    }
}

/// Describes an interaction; `put` is the object put away, if known.
fn interaction(
    memory: &Memory,
    frame: Frame,
    action: Intent,
    outcome: Option<Outcome>,
    put: Option<TrackId>,
) -> Interaction {
    let name = |track| named(track, memory.class_of(track));
    let put = put.map_or("something".to_owned(), name);
    let action = match action {
        Action::PickUp { object, .. } => format!("pick up {}", name(object)),
        Action::PutOn { place, .. } => format!("put {put} on {}", name(place)),
        Action::RemoveObstacle { obstacle, .. } => format!("clear away {}", name(obstacle)),
        Action::PutIn => format!("put {put} into a container"),
        Action::Wait { .. } => "wait".to_owned(),
        Action::MoveForward | Action::TurnLeft | Action::TurnRight => "walk".to_owned(),
    };
    let outcome = outcome.map(|outcome| match outcome {
        Outcome::Success => "done".to_owned(),
        Outcome::Failure(reason) => format!("failed ({reason})"),
    });
    Interaction { frame, action, outcome }
}

fn other_agents(context: &Context<'_>, length: ListLimits) -> Vec<PersonFacts> {
    let Context { briefing, memory, behavior, .. } = *context;
    let partner = briefing.companion(CompanionRole::Partner);
    // A partner is the guardian itself.
    let guardian =
        partner.filter(|_| briefing.me != AgentId::PARTNER).and_then(|p| memory.people.get(p));
    let other = |companion: &chaic_core::briefing::Companion| {
        let name = match (companion.role, briefing.me) {
            (CompanionRole::Child, _) => "the child",
            (CompanionRole::Guardian, _) => "the child's guardian",
            (CompanionRole::Partner, AgentId::PARTNER) => "your helper",
            (CompanionRole::Partner, _) => "your partner",
        };
        let is_partner = Some(companion.agent) == partner;
        let seen = memory.people.get(companion.agent);
        let pair = seen.zip(guardian).filter(|(child, guardian)| {
            let is_fresh = |f: Frame| f + FRESH_FRAMES > memory.frame;
            companion.role == CompanionRole::Child
                && is_fresh(child.frame)
                && is_fresh(guardian.frame)
        });
        let apart_m = pair
            .map(|(c, g)| horizontal_distance(c.position_in_world, g.position_in_world))
            .filter(|m| *m > AWAY_M);
        let names = |list: &[(TrackId, ClassId)]| -> (Vec<String>, usize) {
            let listed = list.iter().filter(|_| is_partner);
            let names = listed.map(|(track, class)| named(*track, Some(*class))).collect();
            keep_last(names, 2 * length.interactions)
        };
        let (picked_up, n_omitted_picked_up) = names(&behavior.partner_taken);
        let (holds, n_omitted_held) = names(&behavior.partner_holds);
        let is_listed_pick_up = |seen: &&ObservedInteraction| {
            matches!(seen.action, Action::PickUp { object, .. } if seen.outcome == Some(Outcome::Success)
                && behavior.partner_taken.iter().any(|(e, _)| *e == object))
        };
        let actions: Vec<Interaction> = behavior
            .actions
            .iter()
            .filter(|a| a.agent == companion.agent)
            .filter(|a| !(is_partner && is_listed_pick_up(a)))
            .map(|a| interaction(memory, a.frame, a.action, a.outcome, None))
            .collect();
        let (actions, n_omitted_interactions) = keep_last(actions, length.interactions);
        let at = seen.map(|p| to_xz(p.position_in_world)).unwrap_or_default();
        PersonFacts {
            name,
            was_seen: seen.is_some(),
            in_view: seen.is_some_and(|p| p.is_in_view),
            frames_ago: seen.map_or(0, |p| memory.frame.saturating_sub(p.frame)),
            x: meters(at.x),
            z: meters(at.y),
            distance_m: meters(at.distance(memory.position())),
            m_from_partner: apart_m.map(meters),
            picked_up,
            n_omitted_picked_up,
            holds,
            n_omitted_held,
            actions,
            n_omitted_interactions,
        }
    };
    briefing.companions.iter().map(other).collect()
}

fn progress(context: &Context<'_>) -> ProgressFacts {
    let Context { briefing, memory, .. } = *context;
    let speed = briefing.capability.speed_m_per_frame.max(1e-3);
    let mut delivered: Vec<ClassCount> = Vec::new();
    for class in memory.delivered.iter().filter_map(|e| memory.class_of(*e)) {
        let name = plain(class.info().label);
        match delivered.iter_mut().find(|c| c.name == name) {
            Some(count) => count.count += 1,
            None => delivered.push(ClassCount { name, count: 1 }),
        }
    }
    let place = |(object, path_m): &(&MappedObject, f32)| GoalPlace {
        name: named(object.track, Some(object.class)),
        x: meters(object.position_in_world.x),
        z: meters(object.position_in_world.z),
        path_m: meters(*path_m),
        frames: (WALK_FACTOR * path_m / speed / 10.0).round() as u32 * 10,
    };
    let places = memory.goal_places();
    ProgressFacts {
        frame: memory.frame,
        goal_places: places.iter().take(MAX_GOAL_PLACES).map(place).collect(),
        delivered,
    }
}

fn map(context: &Context<'_>, length: ListLimits) -> MapFacts {
    let Context { briefing, memory, is_explored, .. } = *context;
    let kind = |class: ClassId| match () {
        () if briefing.possible_targets.contains(&class) => Some(None),
        () if briefing.containers.contains(&class) => Some(Some("container")),
        () if briefing.obstacles.contains(&class) => Some(Some("obstacle")),
        () => None,
    };
    let here = memory.position();
    let mut objects: Vec<(f32, &MappedObject)> = memory
        .objects
        .iter()
        .filter(|t| t.is_present && !t.is_out_of_play && kind(t.class).is_some())
        .map(|t| (memory.path_length_to(t).unwrap_or_else(|| 2.0 * t.distance_from(here)), t))
        .collect();
    objects.sort_by(|a, b| a.0.total_cmp(&b.0));
    let n_omitted = objects.len().saturating_sub(length.objects);
    objects.truncate(length.objects);
    let facts = |(_, object): &(f32, &MappedObject)| {
        let info = object.class.info();
        let note = if memory.frame < object.held_until {
            Some("in somebody's hands".to_owned())
        } else if memory.frame < object.ignore_until {
            Some("your recent attempt failed".to_owned())
        } else if info.role == Role::Fragile {
            Some("fragile".to_owned())
        } else if info.role == Role::HeavyTarget {
            Some(format!("{} kg", info.mass_kg))
        } else {
            None
        };
        ObjectFacts {
            kind: kind(object.class).flatten(),
            name: named(object.track, Some(object.class)),
            x: meters(object.position_in_world.x),
            z: meters(object.position_in_world.z),
            top_m: meters(object.top_m),
            note,
        }
    };
    MapFacts { objects: objects.iter().map(facts).collect(), n_omitted, explored: is_explored }
}

fn plan_facts(memory: &Memory, plan: &Plan) -> PlanFacts {
    let path_m = match plan {
        Plan::PickUp(s) | Plan::PickContainer(s) | Plan::RemoveObstacle(s) | Plan::LiftWith(s) => {
            memory.objects.get(s.track).and_then(|t| memory.path_length_to(t))
        }
        Plan::Deliver => memory.goal_places().first().map(|(_, path_m)| *path_m),
        _ => None,
    };
    PlanFacts { text: plan_text(plan), path_m: path_m.map(meters) }
}
