//! Tracks: an agent's own names for objects, independent of the world's entity ids.

use std::fmt;

use chaic_core::{Action, ClassId, EntityId, Target};

/// Identifies an object within one agent's episode. As far as perception can tell, the same id
/// always means the same object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TrackId(pub u32);

/// With ground truth, tracks and entities correspond one to one.
impl From<EntityId> for TrackId {
    fn from(entity: EntityId) -> TrackId {
        TrackId(u32::from(entity.0))
    }
}

impl TrackId {
    /// First id that a perception assigns itself. Smaller ids are entity ids, which may be granted.
    pub const FIRST_SELF_ASSIGNED: TrackId = TrackId(1 << 20);
}

/// Formats an entity as `#31`, and a track assigned by perception as `t31`.
impl fmt::Display for TrackId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.checked_sub(TrackId::FIRST_SELF_ASSIGNED.0) {
            Some(n) => write!(f, "t{n}"),
            None => write!(f, "#{}", self.0),
        }
    }
}

/// Action whose target is a track.
pub type Intent = Action<TrackId>;

/// Converts an intent to an action; `None` if the action cannot refer to its target now.
pub fn resolve_target(
    intent: Intent,
    target: impl Fn(TrackId) -> Option<Target>,
) -> Option<Action> {
    let subject = intent.subject().map(target);
    if subject == Some(None) {
        return None;
    }
    let nothing = Target::Entity(EntityId::NOTHING);
    Some(intent.map(|_| subject.flatten().unwrap_or(nothing)))
}

/// Object in a hand, as far as its owner knows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CarriedObject {
    /// The object; `None` if its owner did not see what it picked up.
    pub object: Option<(TrackId, ClassId)>,
    /// Known contents, in the order in which they were put in.
    pub contents: Vec<(TrackId, ClassId)>,
    /// Number of objects inside, as sensed by the hand.
    pub n_contents: u32,
}

impl CarriedObject {
    /// Class of the object, if known.
    pub fn class(&self) -> Option<ClassId> {
        self.object.map(|(_, class)| class)
    }

    /// Returns the object and all its known contents.
    pub fn all(&self) -> impl Iterator<Item = (TrackId, ClassId)> {
        self.object.into_iter().chain(self.contents.iter().copied())
    }
}

/// Objects held by the two hands, left and right. Furniture is in both.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hands {
    /// Objects by hand.
    pub hands: [Option<CarriedObject>; 2],
    /// True if both hands hold the same object.
    pub is_joint: bool,
}

impl Hands {
    /// Returns the distinct objects held.
    pub fn held(&self) -> impl Iterator<Item = &CarriedObject> {
        let [left, right] = &self.hands;
        let is_joint = self.is_joint;
        left.iter().chain(right.iter().filter(move |_| !is_joint))
    }

    /// Returns all objects held, including known contents.
    pub fn all(&self) -> impl Iterator<Item = (TrackId, ClassId)> {
        self.held().flat_map(CarriedObject::all)
    }

    /// Returns whether a hand holds this object itself.
    pub fn holds(&self, track: TrackId) -> bool {
        self.held().any(|c| c.object.is_some_and(|(t, _)| t == track))
    }
}
