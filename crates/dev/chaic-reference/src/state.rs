//! Plain state of the reference.

use chaic_core::action::{FailureReason, Hand};
use chaic_core::{AgentId, EntityId, Frame, Outcome, ResolvedAction, Vec3};
use chaic_world::{Event, ObjectLocation, World};

use crate::scene::Scene;

/// Location of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Location {
    /// At rest on another object or on the ground.
    Rests(Option<EntityId>),
    /// In the air.
    Falls,
    /// In a hand, or in both hands (then `Right`).
    Held(AgentId, Hand),
    /// In a container or basket, in this slot.
    Inside(EntityId, u8),
    /// Broken.
    Broken,
}

impl Location {
    /// Reads the location of an object of the world.
    pub(crate) fn of(location: &ObjectLocation) -> Location {
        match *location {
            ObjectLocation::Resting { on } => Location::Rests(on),
            ObjectLocation::Falling { .. } => Location::Falls,
            ObjectLocation::Held { by, hand } => Location::Held(by, hand),
            ObjectLocation::Inside { container, slot } => Location::Inside(container, slot),
            ObjectLocation::Broken => Location::Broken,
        }
    }
}

/// An object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Thing {
    pub(crate) location: Location,
    pub(crate) delivered: Option<Frame>,
    pub(crate) delivered_by: Option<AgentId>,
    pub(crate) last_holder: Option<AgentId>,
    /// Goal place of the last successful put-on, until the next pick-up.
    pub(crate) put_at: Option<EntityId>,
}

/// A part of an action. Numbers are remaining frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Part {
    /// Stands, turns toward an object or docks a bicycle.
    Stand(u32),
    /// Moves arms.
    Arms(u32),
    /// Turns to a yaw.
    Turn { left: u32, yaw_rad: f32 },
    /// Walks ahead.
    Walk { left_m: f64, covered_m: f64 },
    /// Walks to an object; the number counts frames without approaching.
    Approach { to: EntityId, n_stuck: u32 },
    /// Stands at furniture until the other person stands there too.
    AwaitOther { object: EntityId, waited: u32, n_alone: u32 },
    /// Decides whether a pick-up succeeds; takes no time.
    DecideTake { hand: Option<Hand>, object: EntityId },
    /// Decides whether a put-on succeeds; takes no time.
    DecidePut { hand: Option<Hand>, place: EntityId },
    /// Closes the hand.
    Grasp { left: u32, hand: Option<Hand>, object: EntityId },
    /// Opens the hand after `open` frames, then watches the fall for at most `watch` frames.
    Release { open: u32, watch: u32, object: EntityId, on: Option<EntityId>, sets_down: bool },
    /// Opens the hand above a container after `open` frames, then stays for `rest` frames.
    Insert { open: u32, rest: u32, object: EntityId, container: EntityId, is_watched: bool },
    /// Follows with furniture until the leader puts it down.
    Follow,
}

/// An action in progress.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OngoingAction {
    pub(crate) action: ResolvedAction,
    pub(crate) since: Frame,
    /// Failure reason with which the action will end.
    pub(crate) failing: Option<FailureReason>,
    /// Remaining parts, the current one first.
    pub(crate) parts: Vec<Part>,
}

/// A person.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Person {
    pub(crate) hands: [Option<EntityId>; 2],
    pub(crate) ongoing: Option<OngoingAction>,
    pub(crate) last: Option<(ResolvedAction, Outcome)>,
    pub(crate) last_interaction: Option<(Frame, ResolvedAction, Outcome)>,
    pub(crate) in_stride: bool,
    pub(crate) fatigue: f32,
    pub(crate) n_break: u32,
    pub(crate) n_take: u32,
    pub(crate) n_put_on: u32,
    pub(crate) n_put_in: u32,
    pub(crate) n_slip: u32,
    pub(crate) n_drop: u32,
    pub(crate) progress_frame: Frame,
    pub(crate) progress_at: Vec3,
    pub(crate) is_stuck: bool,
}

/// Furniture in the hands of two people.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Carry {
    pub(crate) object: EntityId,
    pub(crate) leader: AgentId,
    pub(crate) follower: AgentId,
    /// True once the leader has grasped it.
    pub(crate) has_begun: bool,
}

/// State of the reference.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RefState {
    pub(crate) frame: Frame,
    pub(crate) things: Vec<Thing>,
    pub(crate) people: Vec<Person>,
    pub(crate) carry: Option<Carry>,
    pub(crate) child_away_frames: u32,
    pub(crate) child_is_away: bool,
    pub(crate) stuck_frames: u32,
    pub(crate) over: bool,
    /// Poses at this time, as given.
    pub(crate) scene: Scene,
    /// Events since the last comparison.
    pub(crate) events: Vec<Event>,
    /// Objects that a person took or released in this frame. Their positions are not known before
    /// its end.
    pub(crate) touched: Vec<EntityId>,
    /// Descriptions of impossible motions of people in the world.
    pub(crate) impossible_motions: Vec<String>,
}

impl RefState {
    /// Reads the initial state of a world: supports, and bicycles beside their riders.
    pub(crate) fn start(world: &World) -> RefState {
        let thing = |o: &chaic_world::ObjectState| Thing {
            location: Location::of(&o.location),
            delivered: None,
            delivered_by: None,
            last_holder: None,
            put_at: None,
        };
        let person = |a: &chaic_world::AgentState| Person {
            hands: a.hands,
            ongoing: None,
            last: None,
            last_interaction: None,
            in_stride: false,
            fatigue: 0.0,
            n_break: 0,
            n_take: 0,
            n_put_on: 0,
            n_put_in: 0,
            n_slip: 0,
            n_drop: 0,
            progress_frame: 0,
            progress_at: a.pose.position,
            is_stuck: false,
        };
        RefState {
            frame: 0,
            things: world.state().objects.iter().map(thing).collect(),
            people: world.state().agents.iter().map(person).collect(),
            carry: None,
            child_away_frames: 0,
            child_is_away: false,
            stuck_frames: 0,
            over: false,
            scene: Scene::of(world),
            events: Vec::new(),
            touched: Vec::new(),
            impossible_motions: Vec::new(),
        }
    }
}
