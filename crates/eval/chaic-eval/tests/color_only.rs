//! Somebody who is granted nothing and looks at color alone can point at what it sees, pick it up
//! and deliver it: what learned perception stands on.

use chaic_core::briefing::Goal;
use chaic_core::capability::Persona;
use chaic_core::geom::{Pose, Rect};
use chaic_core::observation::{Grants, Senses};
use chaic_core::{
    Action, Agent, AgentError, Briefing, ClassId, Hand, Observation, Outcome, Target, TaskId, Vec2,
    Vec3,
};
use chaic_env::rules::RuleSet;
use chaic_env::{Appearance, Env, EpisodeConfig, Flow, Idle, Seat};
use chaic_episodes::Episode;
use chaic_world::{Person, Room, RoomKind, Setup, Thing, Wall};

/// Side of its images, pixels.
const SIZE: u32 = 512;
/// Something this low in the image is near enough to point at: on the floor, 2.6 m away.
const NEAR_ROW: u32 = 400;
/// Something within so many columns of the middle is straight ahead.
const AHEAD_COLUMNS: f32 = 40.0;
/// Pixels this near to each other, in columns, belong to one thing.
const TOGETHER_COLUMNS: u32 = 40;

/// Fetches what is red and brings it to what is blue.
#[derive(Default)]
struct ColorOnly {
    /// Turns to the side that are left to do.
    detour: u32,
}

impl Agent for ColorOnly {
    fn senses(&self) -> Senses {
        Senses { image_size: SIZE, rgb: true, depth: false, ids: false, film: None }
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, seen: &Observation) -> Result<Action, AgentError> {
        assert!(seen.images.ids.is_none() && seen.images.depth_m.is_none());
        let holds = seen.own.held().next().is_some();
        if let Some((Action::MoveForward, Outcome::Failure(_))) = seen.own.last {
            self.detour = 3;
        }
        if self.detour > 0 {
            self.detour -= 1;
            return Ok(if self.detour == 0 { Action::MoveForward } else { Action::TurnLeft });
        }
        let rgb = seen.images.rgb.as_deref().expect("it asked for color");
        let Some(blob) = Blob::of(rgb, if holds { is_blue } else { is_red }) else {
            return Ok(Action::TurnLeft);
        };
        let off = blob.middle.x - 0.5 * SIZE as f32;
        let (hand, [column, row]) = (Hand::Right, blob.pixel);
        Ok(match off {
            _ if off < -AHEAD_COLUMNS => Action::TurnLeft,
            _ if off > AHEAD_COLUMNS => Action::TurnRight,
            _ if blob.lowest < NEAR_ROW => Action::MoveForward,
            _ if holds => Action::PutOn { place: Target::Pixel { column, row }, hand },
            _ => Action::PickUp { object: Target::Pixel { column, row }, hand },
        })
    }
}

fn is_red([r, g, b]: [f32; 3]) -> bool {
    r > 60.0 && r > 1.8 * g && r > 1.8 * b
}

fn is_blue([r, g, b]: [f32; 3]) -> bool {
    b > 60.0 && b > 1.3 * r && b > 1.1 * g
}

/// The pixels of one color around the lowest of them: the nearest thing of that color.
struct Blob {
    middle: Vec2,
    lowest: u32,
    /// The pixel of that color nearest to the middle.
    pixel: [u32; 2],
}

impl Blob {
    fn of(rgb: &[u8], is_wanted: fn([f32; 3]) -> bool) -> Option<Blob> {
        let mut pixels: Vec<[u32; 2]> = rgb
            .chunks_exact(3)
            .zip(0..)
            .filter(|(c, _)| is_wanted([f32::from(c[0]), f32::from(c[1]), f32::from(c[2])]))
            .map(|(_, i)| [i % SIZE, i / SIZE])
            .collect();
        let [anchor, lowest] = *pixels.iter().max_by_key(|p| p[1])?;
        pixels.retain(|p| p[0].abs_diff(anchor) < TOGETHER_COLUMNS);
        let at = |[column, row]: [u32; 2]| Vec2::new(column as f32, row as f32);
        let middle = pixels.iter().map(|p| at(*p)).sum::<Vec2>() / pixels.len() as f32;
        let off = |p: &[u32; 2]| at(*p).distance_squared(middle);
        let pixel = *pixels.iter().min_by(|p, q| off(p).total_cmp(&off(q)))?;
        (pixels.len() > 8).then_some(Blob { middle, lowest, pixel })
    }
}

/// A hall of 10 by 10 m with a bed and an apple, which is wanted.
fn hall() -> Setup {
    let thing = |class, at: [f32; 3]| Thing::new(ClassId::named(class), Vec3::from(at), 0.0);
    let person = |persona, x, z, yaw_rad| {
        // In green and gray: nothing red or blue about anybody.
        let look = 2;
        Person::new(persona, Pose { position: Vec3::new(x, 0.0, z), yaw_rad }, look)
    };
    let corners = [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0], [-5.0, -5.0]];
    let wall = |ends: &[[f32; 2]]| Wall {
        a: Vec2::from(ends[0]),
        b: Vec2::from(ends[1]),
        thickness_m: 0.12,
        bottom_m: 0.0,
        top_m: 2.9,
        color: [200, 200, 190],
    };
    Setup {
        task: TaskId::NoConstraint,
        seed: 1,
        horizon: 3000,
        bounds: Rect::new([-5.0, -5.0], [5.0, 5.0]),
        ceiling_m: Some(2.9),
        rooms: vec![Room { kind: RoomKind::Bedroom, rect: Rect::new([-5.0, -5.0], [5.0, 5.0]) }],
        walls: corners.windows(2).map(wall).collect(),
        openings: vec![],
        floors: vec![],
        things: vec![thing("bed", [-3.0, 0.0, -3.0]), thing("apple", [3.0, 0.0, 2.0])],
        people: vec![person(Persona::Adult, 4.5, 4.5, 0.0), person(Persona::Helper, 0.0, 0.0, 1.0)],
        goal: Goal { targets: vec![(ClassId::named("apple"), 1)] },
        goal_places: vec![Setup::entity(0)],
    }
}

#[test]
fn whoever_sees_color_alone_points_picks_up_and_delivers() {
    let episode = Episode::new("no_constraint/hall/0", "hall", None, hall()).unwrap();
    let seats = vec![
        Seat::of_mind(Box::new(Idle), Grants::NONE),
        Seat::of_mind(Box::new(ColorOnly::default()), Grants::NONE),
    ];
    let config = EpisodeConfig {
        episode: &episode,
        seed: 0,
        rules: RuleSet::PAPER,
        helper: "color_only",
        partner: None,
        image_size: None,
        appearance: Appearance::Canonical,
    };
    let mut env = Env::with_seats(config, seats).unwrap();
    let flow = env.advance(None);
    assert_eq!(flow, Ok(Flow::Ended));
    assert!(env.world().is_complete(), "the apple is where it was wanted");
}
