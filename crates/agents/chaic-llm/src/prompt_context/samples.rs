//! Sample contexts that validate templates.

use chaic_core::capability::Persona;

use super::gather::{body, meters, person, reach};
use super::{
    ClassCount, DisclosedFacts, GoalPlace, Interaction, MapFacts, ObjectFacts, PersonFacts,
    PlanFacts, ProgressFacts, PromptContext, SelfFacts,
};
use crate::prompt_track::PromptTrack;

impl PromptContext {
    /// Samples of each track, with all variables of the track filled and with all empty.
    pub(crate) fn samples() -> Vec<PromptContext> {
        let full = |track: PromptTrack| PromptContext {
            track,
            goal_place: "bed".to_owned(),
            targets: vec!["apple".to_owned(), "bread".to_owned()],
            containers: vec!["wicker basket".to_owned()],
            obstacles: vec!["chair".to_owned()],
            capacity: 3,
            is_moving_house: false,
            has_child: true,
            has_partner: true,
            n_images: 10,
            horizon: 3000,
            frames_per_10_m: 210,
            me: body(&Persona::Child.capability()),
            disclosed: (track == PromptTrack::KnownTask).then(|| DisclosedFacts {
                task: "shopping",
                partner: person(Persona::Rider.into()),
                reach: reach(&Persona::Wheelchair.capability()),
                strength_kg: 100,
            }),
            wanted: match track {
                PromptTrack::Partner => vec![ClassCount { name: "apple".to_owned(), count: 2 }],
                PromptTrack::Hidden | PromptTrack::KnownTask => Vec::new(),
            },
            own: SelfFacts {
                x: meters(1.0),
                z: meters(-2.0),
                hands: vec!["apple #31".to_owned()],
                free_hands: 1,
                history: vec![Interaction {
                    frame: 10,
                    action: "pick up apple #31".to_owned(),
                    outcome: Some("done".to_owned()),
                }],
                n_omitted_interactions: 3,
                plan: Some("explore".to_owned()),
            },
            others: vec![PersonFacts {
                name: "your partner",
                was_seen: true,
                in_view: false,
                frames_ago: 30,
                x: meters(3.0),
                z: meters(4.0),
                distance_m: meters(5.0),
                m_from_partner: Some(meters(6.0)),
                picked_up: vec!["apple #32".to_owned()],
                n_omitted_picked_up: 7,
                holds: vec!["apple #32".to_owned()],
                n_omitted_held: 6,
                actions: vec![Interaction {
                    frame: 20,
                    action: "pick up bread #40".to_owned(),
                    outcome: None,
                }],
                n_omitted_interactions: 2,
            }],
            progress: ProgressFacts {
                frame: 400,
                goal_places: vec![GoalPlace {
                    name: "bed #50".to_owned(),
                    x: meters(5.0),
                    z: meters(5.0),
                    path_m: meters(7.0),
                    frames: 220,
                }],
                delivered: vec![ClassCount { name: "apple".to_owned(), count: 1 }],
            },
            map: MapFacts {
                objects: vec![ObjectFacts {
                    kind: Some("container"),
                    name: "wicker basket #60".to_owned(),
                    x: meters(2.0),
                    z: meters(2.0),
                    top_m: meters(0.4),
                    note: Some("in somebody's hands".to_owned()),
                }],
                n_omitted: 4,
                explored: true,
            },
            plans: vec![
                PlanFacts { text: "explore".to_owned(), path_m: None },
                PlanFacts {
                    text: "go to apple #33 and pick it up".to_owned(),
                    path_m: Some(meters(3.0)),
                },
            ],
            n_omitted_plans: 5,
        };
        let empty = |track| {
            let all = full(track);
            PromptContext {
                containers: Vec::new(),
                obstacles: Vec::new(),
                is_moving_house: true,
                has_child: false,
                has_partner: false,
                n_images: 0,
                me: body(&Persona::Helper.capability()),
                disclosed: all.disclosed.map(|disclosed| DisclosedFacts {
                    task: "moving_house",
                    reach: None,
                    ..disclosed
                }),
                own: SelfFacts {
                    hands: vec![],
                    history: vec![],
                    plan: None,
                    free_hands: 0,
                    ..all.own
                },
                others: vec![PersonFacts {
                    was_seen: false,
                    picked_up: vec![],
                    holds: vec![],
                    actions: vec![],
                    ..all.others[0].clone()
                }],
                progress: ProgressFacts { frame: 0, goal_places: vec![], delivered: vec![] },
                map: MapFacts { objects: vec![], n_omitted: 0, explored: false },
                n_omitted_plans: 0,
                ..all
            }
        };
        let alone = |track| PromptContext { others: Vec::new(), ..empty(track) };
        let tracks = [PromptTrack::Hidden, PromptTrack::KnownTask, PromptTrack::Partner];
        tracks.into_iter().flat_map(|t| [full(t), empty(t), alone(t)]).collect()
    }
}
