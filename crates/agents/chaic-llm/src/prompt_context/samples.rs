//! Sample contexts that validate templates.

use chaic_core::capability::Persona;

use super::gather::{body, metres, person, reach};
use super::{
    Count, DisclosedFacts, GoalPlace, Interaction, Map, ObjectFacts, PersonFacts, PlanFacts,
    ProgressFacts, PromptContext, SelfFacts,
};
use crate::prompt_track::PromptTrack;

impl PromptContext {
    /// Samples of each track, with all variables filled and with all empty.
    pub(crate) fn samples() -> Vec<PromptContext> {
        let full = |track| PromptContext {
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
            told: Some(DisclosedFacts {
                task: "shopping",
                partner: person(Persona::Rider.into()),
                reach: reach(&Persona::Wheelchair.capability()),
                strength_kg: 100,
            }),
            wanted: vec![Count { name: "apple".to_owned(), count: 2 }],
            own: SelfFacts {
                x: metres(1.0),
                z: metres(-2.0),
                hands: vec!["apple #31".to_owned()],
                free_hands: 1,
                history: vec![Interaction {
                    frame: 10,
                    what: "pick up apple #31".to_owned(),
                    outcome: Some("done".to_owned()),
                }],
                history_left_out: 3,
                plan: Some("explore".to_owned()),
            },
            others: vec![PersonFacts {
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
                actions: vec![Interaction {
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
                things: vec![ObjectFacts {
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
            PromptContext {
                containers: Vec::new(),
                obstacles: Vec::new(),
                moving: true,
                child: false,
                helped: false,
                images: 0,
                me: body(&Persona::Helper.capability()),
                told: all.told.map(|told| DisclosedFacts {
                    task: "moving_house",
                    reach: None,
                    ..told
                }),
                own: SelfFacts {
                    hands: vec![],
                    history: vec![],
                    plan: None,
                    free_hands: 0,
                    ..all.own
                },
                others: vec![PersonFacts {
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
        let alone = |track| PromptContext { others: Vec::new(), ..empty(track) };
        let tracks = [PromptTrack::Hidden, PromptTrack::KnownTask, PromptTrack::Partner];
        tracks.into_iter().flat_map(|t| [full(t), empty(t), alone(t)]).collect()
    }
}
