//! What a prompt may say: taken from a mind's own memory, and from nothing else.
//!
//! Every name passes through [`plain`]: whatever a name says, it stays a name on its line.

use chaic_agents::decision::{Context, Plan};
use chaic_agents::memory::{Memory, Thing};
use chaic_protocol::briefing::Relation;
use chaic_protocol::capability::{Capability, Gait, Persona};
use chaic_protocol::geom::{horizontal_distance, xz};
use chaic_protocol::observation::{Held, SeenAction};
use chaic_protocol::{Action, AgentId, ClassId, EntityId, Frame, Outcome, Role};
use serde::Serialize;

use crate::templates::Track;

/// The child is away from its guardian beyond this, metres (docs/metrics.md, emergency rate).
const AWAY_M: f32 = 3.5;
/// Sightings older than this aren't compared, frames.
const FRESH_FRAMES: Frame = 150;
/// Goal places that are listed.
const MAX_GOAL_PLACES: usize = 3;
/// Longest name, characters: the catalogue's are shorter.
const MAX_NAME: usize = 40;
/// Walking as it is, turns included, takes longer than the way at full speed by this factor.
const WALK_FACTOR: f32 = 1.5;

/// How much of everything is listed. Each further one lists less.
#[derive(Clone, Copy, Debug)]
pub struct Length {
    deeds: usize,
    things: usize,
    plans_of_a_kind: usize,
}

/// From the longest to the shortest (docs/language-helpers.md).
pub const LENGTHS: [Length; 6] = [
    Length { deeds: 20, things: 60, plans_of_a_kind: 60 },
    Length { deeds: 10, things: 40, plans_of_a_kind: 40 },
    Length { deeds: 6, things: 25, plans_of_a_kind: 25 },
    Length { deeds: 4, things: 12, plans_of_a_kind: 15 },
    Length { deeds: 2, things: 6, plans_of_a_kind: 8 },
    Length { deeds: 1, things: 0, plans_of_a_kind: 4 },
];

/// All that templates may name. Lengths in metres and coordinates are texts with one decimal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Facts {
    /// Whose prompt it is.
    pub track: Track,
    /// What the goal place is called.
    pub goal_place: String,
    /// Classes that may be targets.
    pub targets: Vec<String>,
    /// Classes that hold targets.
    pub containers: Vec<String>,
    /// Classes that may stand in the way.
    pub obstacles: Vec<String>,
    /// How many things a container or basket holds.
    pub capacity: u32,
    /// Whether it is furniture that is carried.
    pub moving: bool,
    /// Whether a child comes along.
    pub child: bool,
    /// Whether the reader has a partner.
    pub helped: bool,
    /// How many pictures come with the question.
    pub images: usize,
    /// Frames until time is up.
    pub horizon: Frame,
    /// Frames that the reader needs for ten metres.
    pub frames_per_10_m: u32,
    /// The reader's body.
    pub me: Body,
    /// What is told of the task, if that is granted.
    pub told: Option<ToldFacts>,
    /// What is wanted; empty for whom it isn't told.
    pub wanted: Vec<Count>,
    /// Self-information.
    pub own: Own,
    /// The others.
    pub others: Vec<Other>,
    /// Task progress.
    pub progress: ProgressFacts,
    /// Semantic map.
    pub map: Map,
    /// The plans that can be followed now, in the order of their numbers.
    pub plans: Vec<PlanFacts>,
    /// Plans left out for shortness.
    pub plans_left_out: usize,
}

/// A body in words and numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Body {
    /// What kind of person.
    pub kind: String,
    /// Lowest and highest reach, if they are limited.
    pub reach: Option<[String; 2]>,
    /// What it lifts, kilograms.
    pub strength_kg: u32,
    /// Whether it walks a bicycle.
    pub docks: bool,
    /// Whether it sits in a wheelchair.
    pub rolls: bool,
}

/// What is told of the task.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ToldFacts {
    /// The task's name.
    pub task: &'static str,
    /// What kind of person the partner is.
    pub partner: String,
    /// The partner's reach, if it is limited.
    pub reach: Option<[String; 2]>,
    /// What the partner lifts, kilograms.
    pub strength_kg: u32,
}

/// So many of a kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Count {
    /// The kind.
    pub name: String,
    /// How many.
    pub count: u32,
}

/// Self-information.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Own {
    /// Where one stands.
    pub x: String,
    /// Where one stands.
    pub z: String,
    /// What the hands hold.
    pub hands: Vec<String>,
    /// Hands with nothing in them.
    pub free_hands: usize,
    /// Own actions other than walking, oldest first.
    pub history: Vec<Deed>,
    /// Earlier ones that are left out.
    pub history_left_out: usize,
    /// The last plan.
    pub plan: Option<String>,
}

/// Something that was done.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Deed {
    /// When.
    pub frame: Frame,
    /// What.
    pub what: String,
    /// How it ended, if it has.
    pub outcome: Option<String>,
}

/// Another person.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Other {
    /// What it is to the reader.
    pub who: &'static str,
    /// Whether it was ever seen.
    pub seen: bool,
    /// Whether it is seen now.
    pub in_view: bool,
    /// How long ago it was seen last.
    pub frames_ago: Frame,
    /// Where.
    pub x: String,
    /// Where.
    pub z: String,
    /// How far from the reader, as the crow flies.
    pub distance_m: String,
    /// For a child that is away: how far from the reader's partner.
    pub away_m: Option<String>,
    /// What it is known to have taken.
    pub took: Vec<String>,
    /// What it held when that was known last.
    pub holds: Vec<String>,
    /// What else it was seen to do, oldest first.
    pub actions: Vec<Deed>,
    /// Earlier ones that are left out.
    pub actions_left_out: usize,
}

/// Task progress.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProgressFacts {
    /// Frames that have passed.
    pub frame: Frame,
    /// Known goal places, nearest first.
    pub goal_places: Vec<GoalPlace>,
    /// What is known to be there.
    pub delivered: Vec<Count>,
}

/// A goal place.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GoalPlace {
    /// Its name.
    pub name: String,
    /// Where.
    pub x: String,
    /// Where.
    pub z: String,
    /// The way to it.
    pub way_m: String,
    /// How long that takes, about.
    pub frames: u32,
}

/// Semantic map.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Map {
    /// Things of use, nearest first.
    pub things: Vec<ThingFacts>,
    /// Farther ones that are left out.
    pub left_out: usize,
    /// Whether everything that one can get to is explored.
    pub explored: bool,
}

/// A thing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ThingFacts {
    /// `container` or `obstacle`; nothing for a possible target.
    pub kind: Option<&'static str>,
    /// Its name.
    pub name: String,
    /// Where.
    pub x: String,
    /// Where.
    pub z: String,
    /// Height of its top.
    pub top_m: String,
    /// What else is to be known.
    pub note: Option<String>,
}

/// A plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanFacts {
    /// In words.
    pub text: String,
    /// The way to what it is about.
    pub way_m: Option<String>,
}

/// A name as it may stand in a prompt: letters, digits and a few signs, on one line, not long.
pub fn plain(name: &str) -> String {
    let is_fine = |c: char| c.is_alphanumeric() || " -_#'".contains(c);
    let clean: String = name.chars().map(|c| if is_fine(c) { c } else { ' ' }).collect();
    let words: Vec<&str> = clean.split_whitespace().collect();
    words.join(" ").chars().take(MAX_NAME).collect()
}

/// A plan in words.
pub fn plan_text(plan: &Plan) -> String {
    let words = plan.to_string();
    let is_fine = |c: char| c.is_alphanumeric() || " -_#',".contains(c);
    words.chars().map(|c| if is_fine(c) { c } else { ' ' }).collect()
}

impl Facts {
    /// What a mind with this memory may say, and which of `plans` are listed: those of one kind
    /// come nearest first.
    pub fn of(
        track: Track,
        context: &Context<'_>,
        plans: &[Plan],
        last_plan: Option<Plan>,
        images: usize,
        length: Length,
    ) -> (Facts, Vec<Plan>) {
        let Context { briefing, memory, .. } = *context;
        let listed = shorten(plans, length.plans_of_a_kind);
        let labels = |classes: &[ClassId]| {
            let mut names: Vec<String> = classes.iter().map(|c| plain(c.info().label)).collect();
            names.dedup();
            let mut seen = std::collections::BTreeSet::new();
            names.retain(|n| seen.insert(n.clone()));
            names
        };
        let speed = briefing.capability.speed_m_per_frame.max(1e-3);
        let wanted = briefing.goal.iter().filter(|_| track == Track::Partner);
        let facts = Facts {
            track,
            goal_place: plain(briefing.goal_place.info().label),
            targets: labels(&briefing.possible_targets),
            containers: labels(&briefing.containers),
            obstacles: labels(&briefing.obstacles),
            capacity: briefing.container_capacity,
            moving: briefing.possible_targets.iter().any(|c| c.info().role == Role::HeavyTarget),
            child: briefing.companion(Relation::Child).is_some(),
            helped: briefing.companion(Relation::Partner).is_some(),
            images,
            horizon: briefing.horizon,
            frames_per_10_m: (10.0 / speed / 10.0).round() as u32 * 10,
            me: body(&briefing.capability),
            told: briefing.told.filter(|_| track == Track::Told).map(|told| ToldFacts {
                task: told.task.name(),
                partner: persona(told.partner),
                reach: reach(&told.partner.capability()),
                strength_kg: told.partner.capability().strength_kg as u32,
            }),
            wanted: wanted
                .flat_map(|goal| &goal.targets)
                .map(|(class, n)| Count { name: plain(class.info().label), count: *n })
                .collect(),
            own: own(context, last_plan, length),
            others: others(context, length),
            progress: progress(context),
            map: map(context, length),
            plans: listed.iter().map(|p| plan_facts(memory, p)).collect(),
            plans_left_out: plans.len() - listed.len(),
        };
        (facts, listed)
    }
}

/// So many plans of each kind that is about an object: the nearest.
fn shorten(plans: &[Plan], of_a_kind: usize) -> Vec<Plan> {
    let mut kept: Vec<Plan> = Vec::new();
    for plan in plans {
        let is_same = |p: &&Plan| std::mem::discriminant(*p) == std::mem::discriminant(plan);
        if kept.iter().filter(is_same).count() < of_a_kind {
            kept.push(*plan);
        }
    }
    kept
}

fn metres(x: f32) -> String {
    let text = format!("{x:.1}");
    if text == "-0.0" { "0.0".to_owned() } else { text }
}

fn named(entity: EntityId, class: Option<ClassId>) -> String {
    let label = class.map_or("something".to_owned(), |c| plain(c.info().label));
    format!("{label} {entity}")
}

fn reach(capability: &Capability) -> Option<[String; 2]> {
    let [low, high] = capability.pick_range_m;
    let is_limited = capability.pick_range_m != Persona::Adult.capability().pick_range_m;
    let height = |m: f32| format!("{m:.2}").trim_end_matches('0').trim_end_matches('.').to_owned();
    is_limited.then(|| [height(low), height(high)])
}

fn body(capability: &Capability) -> Body {
    let height_m = capability.height_m;
    let kind = match capability.gait {
        Gait::Roll => "a person in a wheelchair".to_owned(),
        Gait::WalkBike => "a person who walks a bicycle".to_owned(),
        Gait::Walk => format!("a person of {height_m:.2} m"),
    };
    Body {
        kind,
        reach: reach(capability),
        strength_kg: capability.strength_kg as u32,
        docks: capability.docking_frames > 0,
        rolls: capability.gait == Gait::Roll,
    }
}

fn persona(persona: Persona) -> String {
    let height_m = persona.capability().height_m;
    match persona {
        Persona::Adult | Persona::Helper => "an adult without any constraint".to_owned(),
        Persona::Child => format!("a child of {height_m:.1} m who walks at half your speed"),
        Persona::Wheelchair => "a person in a wheelchair".to_owned(),
        Persona::Rider => {
            "a person who walks a bicycle with a basket, at half your speed, with a child along"
                .to_owned()
        }
        Persona::Frail => "a frail person".to_owned(),
    }
}

fn holding(held: &Held) -> String {
    let name = named(held.entity, Some(held.class));
    let inside: Vec<String> = held.contents.iter().map(|(e, c)| named(*e, Some(*c))).collect();
    let is_holder = matches!(held.class.info().role, Role::Container | Role::Vehicle);
    match (is_holder, inside.is_empty()) {
        (true, true) => format!("{name} with nothing in it"),
        (true, false) => format!("{name} with {} in it", inside.join(", ")),
        (false, _) => name,
    }
}

fn own(context: &Context<'_>, last_plan: Option<Plan>, length: Length) -> Own {
    let Context { memory, own, .. } = *context;
    let here = memory.here();
    let deeds: Vec<Deed> = memory
        .history
        .iter()
        .map(|done| deed(memory, done.frame, done.action, Some(done.outcome)))
        .collect();
    let left_out = deeds.len().saturating_sub(length.deeds);
    Own {
        x: metres(here.x),
        z: metres(here.y),
        hands: own.held().map(holding).collect(),
        free_hands: own.hands.iter().filter(|h| h.is_none()).count(),
        history: deeds[left_out..].to_vec(),
        history_left_out: left_out,
        plan: last_plan.map(|p| plan_text(&p)),
    }
}

fn deed(memory: &Memory, frame: Frame, action: Action, outcome: Option<Outcome>) -> Deed {
    let name = |entity| named(entity, memory.class_of(entity));
    let what = match action {
        Action::PickUp { object, .. } => format!("pick up {}", name(object)),
        Action::PutOn { place, .. } => format!("put something on {}", name(place)),
        Action::RemoveObstacle { obstacle, .. } => format!("clear away {}", name(obstacle)),
        Action::PutIn => "put something into a container".to_owned(),
        Action::Wait { .. } => "wait".to_owned(),
        Action::MoveForward | Action::TurnLeft | Action::TurnRight => "walk".to_owned(),
    };
    let outcome = outcome.map(|outcome| match outcome {
        Outcome::Success => "done".to_owned(),
        Outcome::Failure(reason) => format!("failed ({reason})"),
    });
    Deed { frame, what, outcome }
}

fn others(context: &Context<'_>, length: Length) -> Vec<Other> {
    let Context { briefing, memory, behavior, .. } = *context;
    let partner = briefing.companion(Relation::Partner);
    let guardian = partner.and_then(|p| memory.people.get(p));
    let other = |companion: &chaic_protocol::briefing::Companion| {
        let who = match (companion.relation, briefing.me) {
            (Relation::Child, _) => "the child",
            (Relation::Guardian, _) => "the child's guardian",
            (Relation::Partner, AgentId::PARTNER) => "your helper",
            (Relation::Partner, _) => "your partner",
        };
        let is_partner = Some(companion.agent) == partner;
        let seen = memory.people.get(companion.agent);
        let apart = seen.zip(guardian).filter(|(child, guardian)| {
            let fresh = |f: Frame| f + FRESH_FRAMES > memory.frame;
            companion.relation == Relation::Child && fresh(child.frame) && fresh(guardian.frame)
        });
        let apart = apart
            .map(|(c, g)| horizontal_distance(c.position_in_world, g.position_in_world))
            .filter(|m| *m > AWAY_M);
        let took = |list: &[(EntityId, ClassId)]| -> Vec<String> {
            let skip = list.len().saturating_sub(2 * length.deeds);
            list[skip..].iter().map(|(e, c)| named(*e, Some(*c))).collect()
        };
        let is_told_by_taking = |seen: &&SeenAction| {
            matches!(seen.action, Action::PickUp { object, .. } if seen.outcome == Some(Outcome::Success)
                && behavior.partner_took.iter().any(|(e, _)| *e == object))
        };
        let actions: Vec<Deed> = behavior
            .actions
            .iter()
            .filter(|a| a.agent == companion.agent)
            .filter(|a| !(is_partner && is_told_by_taking(a)))
            .map(|a| deed(memory, a.frame, a.action, a.outcome))
            .collect();
        let left_out = actions.len().saturating_sub(length.deeds);
        let at = seen.map(|p| xz(p.position_in_world)).unwrap_or_default();
        Other {
            who,
            seen: seen.is_some(),
            in_view: seen.is_some_and(|p| p.is_in_view),
            frames_ago: seen.map_or(0, |p| memory.frame.saturating_sub(p.frame)),
            x: metres(at.x),
            z: metres(at.y),
            distance_m: metres(at.distance(memory.here())),
            away_m: apart.map(metres),
            took: if is_partner { took(&behavior.partner_took) } else { Vec::new() },
            holds: if is_partner { took(&behavior.partner_holds) } else { Vec::new() },
            actions: actions[left_out..].to_vec(),
            actions_left_out: left_out,
        }
    };
    briefing.companions.iter().map(other).collect()
}

fn progress(context: &Context<'_>) -> ProgressFacts {
    let Context { briefing, memory, .. } = *context;
    let speed = briefing.capability.speed_m_per_frame.max(1e-3);
    let mut delivered: Vec<Count> = Vec::new();
    for class in memory.delivered.iter().filter_map(|e| memory.class_of(*e)) {
        let name = plain(class.info().label);
        match delivered.iter_mut().find(|c| c.name == name) {
            Some(count) => count.count += 1,
            None => delivered.push(Count { name, count: 1 }),
        }
    }
    let place = |(thing, way_m): &(&Thing, f32)| GoalPlace {
        name: named(thing.entity, Some(thing.class)),
        x: metres(thing.position_in_world.x),
        z: metres(thing.position_in_world.z),
        way_m: metres(*way_m),
        frames: (WALK_FACTOR * way_m / speed / 10.0).round() as u32 * 10,
    };
    let places = memory.goal_places();
    ProgressFacts {
        frame: memory.frame,
        goal_places: places.iter().take(MAX_GOAL_PLACES).map(place).collect(),
        delivered,
    }
}

fn map(context: &Context<'_>, length: Length) -> Map {
    let Context { briefing, memory, is_explored, .. } = *context;
    let kind = |class: ClassId| match () {
        () if briefing.possible_targets.contains(&class) => Some(None),
        () if briefing.containers.contains(&class) => Some(Some("container")),
        () if briefing.obstacles.contains(&class) => Some(Some("obstacle")),
        () => None,
    };
    let here = memory.here();
    let mut things: Vec<(f32, &Thing)> = memory
        .things
        .iter()
        .filter(|t| t.is_present && !t.is_gone && kind(t.class).is_some())
        .map(|t| (memory.way_to(t).unwrap_or_else(|| 2.0 * t.distance_from(here)), t))
        .collect();
    things.sort_by(|a, b| a.0.total_cmp(&b.0));
    let left_out = things.len().saturating_sub(length.things);
    things.truncate(length.things);
    let facts = |(_, thing): &(f32, &Thing)| {
        let info = thing.class.info();
        let note = if memory.frame < thing.held_until {
            Some("in somebody's hands".to_owned())
        } else if memory.frame < thing.ignore_until {
            Some("you tried in vain lately".to_owned())
        } else if info.role == Role::Fragile {
            Some("fragile".to_owned())
        } else if info.role == Role::HeavyTarget {
            Some(format!("{} kg", info.mass_kg))
        } else {
            None
        };
        ThingFacts {
            kind: kind(thing.class).flatten(),
            name: named(thing.entity, Some(thing.class)),
            x: metres(thing.position_in_world.x),
            z: metres(thing.position_in_world.z),
            top_m: metres(thing.top_m),
            note,
        }
    };
    Map { things: things.iter().map(facts).collect(), left_out, explored: is_explored }
}

fn plan_facts(memory: &Memory, plan: &Plan) -> PlanFacts {
    let subject = match plan {
        Plan::PickUp(s) | Plan::PickContainer(s) | Plan::RemoveObstacle(s) | Plan::LiftWith(s) => {
            memory.things.get(s.entity).and_then(|t| memory.way_to(t))
        }
        Plan::Deliver => memory.goal_places().first().map(|(_, way_m)| *way_m),
        _ => None,
    };
    PlanFacts { text: plan_text(plan), way_m: subject.map(metres) }
}

impl Facts {
    /// One of each kind, with everything and with nothing in it, to try templates on.
    pub(crate) fn samples() -> Vec<Facts> {
        let full = |track| Facts {
            track,
            goal_place: "bed".to_owned(),
            targets: vec!["apple".to_owned(), "bread".to_owned()],
            containers: vec!["wicker basket".to_owned()],
            obstacles: vec!["chair".to_owned()],
            capacity: 3,
            moving: false,
            child: true,
            helped: true,
            images: 10,
            horizon: 3000,
            frames_per_10_m: 210,
            me: body(&Persona::Child.capability()),
            told: Some(ToldFacts {
                task: "shopping",
                partner: persona(Persona::Rider),
                reach: reach(&Persona::Wheelchair.capability()),
                strength_kg: 100,
            }),
            wanted: vec![Count { name: "apple".to_owned(), count: 2 }],
            own: Own {
                x: metres(1.0),
                z: metres(-2.0),
                hands: vec!["apple #31".to_owned()],
                free_hands: 1,
                history: vec![Deed {
                    frame: 10,
                    what: "pick up apple #31".to_owned(),
                    outcome: Some("done".to_owned()),
                }],
                history_left_out: 3,
                plan: Some("explore".to_owned()),
            },
            others: vec![Other {
                who: "your partner",
                seen: true,
                in_view: false,
                frames_ago: 30,
                x: metres(3.0),
                z: metres(4.0),
                distance_m: metres(5.0),
                away_m: Some(metres(6.0)),
                took: vec!["apple #32".to_owned()],
                holds: vec!["apple #32".to_owned()],
                actions: vec![Deed {
                    frame: 20,
                    what: "pick up bread #40".to_owned(),
                    outcome: None,
                }],
                actions_left_out: 2,
            }],
            progress: ProgressFacts {
                frame: 400,
                goal_places: vec![GoalPlace {
                    name: "bed #50".to_owned(),
                    x: metres(5.0),
                    z: metres(5.0),
                    way_m: metres(7.0),
                    frames: 220,
                }],
                delivered: vec![Count { name: "apple".to_owned(), count: 1 }],
            },
            map: Map {
                things: vec![ThingFacts {
                    kind: Some("container"),
                    name: "wicker basket #60".to_owned(),
                    x: metres(2.0),
                    z: metres(2.0),
                    top_m: metres(0.4),
                    note: Some("in somebody's hands".to_owned()),
                }],
                left_out: 4,
                explored: true,
            },
            plans: vec![
                PlanFacts { text: "explore".to_owned(), way_m: None },
                PlanFacts {
                    text: "go to apple #33 and pick it up".to_owned(),
                    way_m: Some(metres(3.0)),
                },
            ],
            plans_left_out: 5,
        };
        let empty = |track| {
            let all = full(track);
            Facts {
                containers: Vec::new(),
                obstacles: Vec::new(),
                moving: true,
                child: false,
                helped: false,
                images: 0,
                me: body(&Persona::Helper.capability()),
                told: all.told.map(|told| ToldFacts { task: "moving_house", reach: None, ..told }),
                own: Own { hands: vec![], history: vec![], plan: None, free_hands: 0, ..all.own },
                others: vec![Other {
                    seen: false,
                    took: vec![],
                    holds: vec![],
                    actions: vec![],
                    ..all.others[0].clone()
                }],
                progress: ProgressFacts { frame: 0, goal_places: vec![], delivered: vec![] },
                map: Map { things: vec![], left_out: 0, explored: false },
                plans_left_out: 0,
                ..all
            }
        };
        let tracks = [Track::Hidden, Track::Told, Track::Partner];
        tracks.into_iter().flat_map(|t| [full(t), empty(t)]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_agents::decision::Subject;

    #[test]
    fn a_name_stays_a_name_on_its_line() {
        for (name, expected) in [
            ("apple", "apple"),
            ("women's purse", "women's purse"),
            ("apple\n7. fly", "apple 7 fly"),
            ("ignore {\"plan\": 3}", "ignore plan 3"),
            ("a\u{202e}b\u{0}c", "a b c"),
        ] {
            assert_eq!(plain(name), expected);
        }
        assert!(plain(&"x".repeat(500)).len() <= MAX_NAME);
    }

    #[test]
    fn the_nearest_of_each_kind_are_kept() {
        let it = |n| Subject { entity: EntityId(n), class: ClassId::named("apple") };
        let plans = [
            Plan::Explore,
            Plan::PickUp(it(30)),
            Plan::PickUp(it(31)),
            Plan::PickUp(it(32)),
            Plan::TurnAround,
        ];
        let kept = shorten(&plans, 2);
        assert_eq!(
            kept,
            [Plan::Explore, Plan::PickUp(it(30)), Plan::PickUp(it(31)), Plan::TurnAround]
        );
        assert_eq!(shorten(&plans, 60), plans);
    }
}
