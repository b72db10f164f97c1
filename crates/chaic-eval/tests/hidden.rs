//! What is hidden from a helper is hidden: goal and constraint of the partner reach it neither
//! through its briefing nor through anything it perceives, as long as the partner does nothing that
//! shows them.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

use chaic_agents::PlannerRules;
use chaic_episodes::{Episode, find_episode};
use chaic_eval::Appearance;
use chaic_eval::helpers::{BuiltIn, Helpers as _};
use chaic_eval::play::{Actor, Cast, Play, Staging};
use chaic_eval::rules::RuleSet;
use chaic_protocol::briefing::Goal;
use chaic_protocol::capability::Capability;
use chaic_protocol::observation::{Grants, Senses};
use chaic_protocol::{Action, Agent, Briefing, ClassId, Observation};
use chaic_world::Setup;

/// Long enough to explore, to pick up and to deliver.
const FRAMES: u32 = 1200;

#[derive(Clone, Debug, Default, PartialEq)]
struct Seen {
    briefing: Option<Briefing>,
    observations: Vec<Observation>,
    actions: Vec<Action>,
}

/// Notes all that a mind is told.
struct Spy {
    mind: Box<dyn Agent>,
    seen: Arc<Mutex<Seen>>,
}

impl Agent for Spy {
    fn senses(&self) -> Senses {
        // Color too: nothing of what is hidden may be painted on anything.
        Senses { rgb: true, ..self.mind.senses() }
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.seen.lock().unwrap().briefing = Some(briefing.clone());
        self.mind.reset(briefing);
    }

    fn act(&mut self, observation: &Observation) -> Action {
        let action = self.mind.act(observation);
        let mut seen = self.seen.lock().unwrap();
        seen.observations.push(observation.clone());
        seen.actions.push(action);
        action
    }
}

/// Stands there.
struct Waiter;

impl Agent for Waiter {
    fn senses(&self) -> Senses {
        Senses::NONE
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, _: &Observation) -> Action {
        Action::Wait { frames: 25 }
    }
}

fn seen_in(id: &str, helper: &str, grants: Option<Grants>, change: &dyn Fn(&mut Setup)) -> Seen {
    let mut setup = find_episode(id).unwrap().into_setup();
    setup.horizon = FRAMES;
    change(&mut setup);
    let episode = Episode::new(id, "hidden", None, setup).unwrap();
    let seen = Arc::new(Mutex::new(Seen::default()));
    let built_in = BuiltIn.make(helper, PlannerRules::paper()).unwrap();
    let spy = Spy { mind: built_in.mind, seen: Arc::clone(&seen) };
    let mut actors = vec![Actor::new(Box::new(Waiter), Grants::PARTNER)];
    actors.push(Actor::new(Box::new(spy), grants.unwrap_or(built_in.grants)));
    for _ in 2..episode.setup().people.len() {
        actors.push(Actor::new(Box::new(Waiter), Grants::NONE));
    }
    let rules = RuleSet::PAPER;
    let (episode, image_size) = (&episode, Some(48));
    let appearance = Appearance::Canonical;
    let staging =
        Staging { episode, seed: 0, rules, helper, partner: None, image_size, appearance };
    let mut play = Play::with_cast(staging, Cast { actors }).unwrap();
    assert!(play.run(&AtomicBool::new(false), None, &mut |_| Ok(())).unwrap());
    let seen = seen.lock().unwrap().clone();
    assert!(seen.observations.len() > 20, "the helper did something");
    seen
}

/// Another goal on the same things: each wanted class is replaced by one that isn't wanted.
fn other_goal(setup: &mut Setup) {
    let is_there = |c: ClassId| setup.things.iter().any(|t| t.class == c && !t.fixed);
    let unwanted = ClassId::all()
        .find(|c| c.info().is_possible_target() && is_there(*c) && setup.goal.wanted(*c) == 0);
    match unwanted {
        Some(class) => setup.goal = Goal { targets: vec![(class, 1)] },
        // Moving house wants all there is: one less.
        None => setup.goal.targets.truncate(setup.goal.targets.len() - 1),
    }
}

fn other_constraint(setup: &mut Setup) {
    let own = setup.people[0].capability();
    setup.people[0].capability = Some(Capability {
        pick_range_m: [0.0, 3.0],
        put_range_m: [0.0, 3.0],
        strength_kg: 600.0,
        speed_m_per_frame: 0.04,
        approach_speed_m_per_frame: 0.04,
        docking_frames: 7,
        breaks_fragile: !own.breaks_fragile,
        ..own
    });
}

fn check(id: &str, helper: &str) {
    let as_it_is = seen_in(id, helper, None, &|_| ());
    for (what, change) in
        [("goal", &other_goal as &dyn Fn(&mut Setup)), ("constraint", &other_constraint)]
    {
        let changed = seen_in(id, helper, None, change);
        assert_eq!(as_it_is.briefing, changed.briefing, "{id}: the briefing tells the {what}");
        assert_eq!(as_it_is.actions, changed.actions, "{id}: {helper} acts on the {what}");
        let same = as_it_is.observations == changed.observations;
        assert!(same, "{id}: an observation tells the {what}");
    }
}

#[test]
fn a_house_hides_goal_and_constraint() {
    check("high_target/test/00", "rhp");
    check("obstacle/test/01", "rhp");
}

#[test]
fn a_street_and_a_yard_hide_goal_and_constraint() {
    check("shopping/test/00", "rhp");
    check("moving_house/test/00", "rhp");
}

#[test]
fn the_same_look_finds_what_is_granted() {
    let goal_of = |change: &dyn Fn(&mut Setup)| {
        let seen = seen_in("high_target/test/00", "oracle", None, change);
        seen.briefing.and_then(|b| b.goal)
    };
    assert_ne!(goal_of(&|_| ()), goal_of(&other_goal), "the oracle is told the goal");
}

#[test]
fn without_grants_there_are_images_and_own_state_only() {
    let seen = seen_in("no_constraint/test/00", "random", Some(Grants::NONE), &|_| ());
    assert_eq!(seen.briefing.as_ref().and_then(|b| b.goal.clone()), None);
    for o in &seen.observations {
        assert!(o.images.ids.is_none() && o.images.rgb.is_some() && o.images.depth_m.is_some());
        assert_eq!(o.granted, chaic_protocol::observation::Granted::default());
    }
}

#[test]
fn what_is_delivered_is_known_where_the_goal_place_is_in_view_or_near() {
    let id = "low_target/test/00";
    let setup = find_episode(id).unwrap().into_setup();
    let seen = seen_in(id, "rhp", None, &|_| ());
    let (mut known, mut unknown) = (0, 0);
    for o in &seen.observations {
        let ids = o.images.ids.as_ref().expect("rhp is granted ids");
        let in_view = setup.goal_places.iter().any(|g| ids.contains(&g.0));
        let near = setup.goal_places.iter().any(|g| {
            let place = setup.thing(*g).expect("a goal place is a thing");
            // Delivery radius: 2 m and half of the longer side.
            let radius = 2.0 + 0.5 * place.size_m().x.max(place.size_m().z);
            chaic_protocol::geom::horizontal_distance(place.position, o.own.pose.position) <= radius
        });
        assert_eq!(o.delivered.is_some(), in_view || near, "frame {}", o.frame);
        *(if in_view || near { &mut known } else { &mut unknown }) += 1;
    }
    assert!(known > 0 && unknown > 0, "both occur: {known}, {unknown}");
}
