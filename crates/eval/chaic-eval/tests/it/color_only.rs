//! Promise: an agent without grants that only sees color can point at objects, pick them up and
//! deliver them. Learned perception depends on this.

use chaic_core::briefing::Goal;
use chaic_core::capability::Persona;
use chaic_core::geom::{Pose, Rect};
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{
    Action, Agent, AgentError, Briefing, ClassId, Hand, Observation, Outcome, Target, TaskId, Vec2,
    Vec3,
};
use chaic_env::{AdvanceOutcome, AgentSlot, Env, EpisodeConfig, NoopAgent};
use chaic_episodes::Episode;
use chaic_world::{AgentSpec, ObjectSpec, Room, RoomKind, Setup, Wall};

/// Side of the images, pixels.
const SIZE: u32 = 512;
/// Row below which an object on the floor is within 2.6 m, near enough to point at.
const NEAR_ROW: u32 = 400;
/// Maximum distance from the middle column of an object straight ahead.
const MAX_AHEAD_COLUMNS: f32 = 40.0;
/// Maximum column distance of pixels of one object.
const MAX_BLOB_COLUMNS: u32 = 40;

/// Agent that fetches the red object and brings it to the blue one.
#[derive(Default)]
struct ColorOnly {
    /// Remaining actions of a detour.
    detour: u32,
}

impl Agent for ColorOnly {
    fn sensors(&self) -> SensorConfig {
        SensorConfig { image_size: SIZE, rgb: true, depth: false, ids: false, frame_history: None }
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        assert!(observation.images.ids.is_none() && observation.images.depth_m.is_none());
        let holds = observation.proprioception.held().next().is_some();
        if let Some((Action::MoveForward, Outcome::Failure(_))) = observation.proprioception.last {
            self.detour = 3;
        }
        if self.detour > 0 {
            self.detour -= 1;
            return Ok(if self.detour == 0 { Action::MoveForward } else { Action::TurnLeft });
        }
        let rgb = observation.images.rgb.as_deref().expect("it asked for color");
        let Some(blob) = Blob::find(rgb, if holds { is_blue } else { is_red }) else {
            return Ok(Action::TurnLeft);
        };
        let offset = blob.middle.x - 0.5 * SIZE as f32;
        let (hand, [column, row]) = (Hand::Right, blob.pixel);
        Ok(match offset {
            _ if offset < -MAX_AHEAD_COLUMNS => Action::TurnLeft,
            _ if offset > MAX_AHEAD_COLUMNS => Action::TurnRight,
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

/// Pixels of one color around the lowest of them: the nearest object of that color.
struct Blob {
    middle: Vec2,
    lowest: u32,
    /// Pixel of that color nearest to the middle.
    pixel: [u32; 2],
}

impl Blob {
    fn find(rgb: &[u8], is_wanted: fn([f32; 3]) -> bool) -> Option<Blob> {
        let mut pixels: Vec<[u32; 2]> = rgb
            .chunks_exact(3)
            .zip(0..)
            .filter(|(c, _)| is_wanted([f32::from(c[0]), f32::from(c[1]), f32::from(c[2])]))
            .map(|(_, i)| [i % SIZE, i / SIZE])
            .collect();
        let [anchor, lowest] = *pixels.iter().max_by_key(|p| p[1])?;
        pixels.retain(|p| p[0].abs_diff(anchor) < MAX_BLOB_COLUMNS);
        let at = |[column, row]: [u32; 2]| Vec2::new(column as f32, row as f32);
        let middle = pixels.iter().map(|p| at(*p)).sum::<Vec2>() / pixels.len() as f32;
        let off = |p: &[u32; 2]| at(*p).distance_squared(middle);
        let pixel = *pixels.iter().min_by(|p, q| off(p).total_cmp(&off(q)))?;
        (pixels.len() > 8).then_some(Blob { middle, lowest, pixel })
    }
}

/// Returns a hall of 10 by 10 m with a bed and an apple, which is the goal.
fn hall() -> Setup {
    let object = |class, at: [f32; 3]| ObjectSpec::new(ClassId::named(class), Vec3::from(at), 0.0);
    let person = |persona, x, z, yaw_rad| {
        // Green and gray clothes, so that only the objects are red or blue.
        let appearance = 2;
        AgentSpec::new(persona, Pose { position: Vec3::new(x, 0.0, z), yaw_rad }, appearance)
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
        things: vec![object("bed", [-3.0, 0.0, -3.0]), object("apple", [3.0, 0.0, 2.0])],
        people: vec![person(Persona::Adult, 4.5, 4.5, 0.0), person(Persona::Helper, 0.0, 0.0, 1.0)],
        goal: Goal { targets: vec![(ClassId::named("apple"), 1)] },
        goal_places: vec![Setup::entity(0)],
    }
}

#[test]
fn an_agent_that_sees_color_only_picks_up_and_delivers() {
    let episode = Episode::new("no_constraint/hall/0", "hall", None, hall()).unwrap();
    let slots = vec![
        AgentSlot::with_agent(Box::new(NoopAgent), Grants::NONE),
        AgentSlot::with_agent(Box::new(ColorOnly::default()), Grants::NONE),
    ];
    let config = EpisodeConfig::new(&episode, "color_only");
    let mut env = Env::with_slots(config, slots).unwrap();
    let outcome = env.advance(None);
    assert_eq!(outcome, Ok(AdvanceOutcome::Ended));
    assert!(env.world().is_complete(), "the apple is delivered");
}
