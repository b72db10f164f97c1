//! How a mind names things: by tracks of its own, never by what the world calls them.

use std::fmt;

use chaic_core::{Action, ClassId, EntityId, Target};

/// Names one thing within a mind: the same number means the same thing, as far as perception can
/// tell, for one episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TrackId(pub u32);

/// With ground truth, tracks and entities are the same, one to one.
impl From<EntityId> for TrackId {
    fn from(entity: EntityId) -> TrackId {
        TrackId(u32::from(entity.0))
    }
}

impl TrackId {
    /// The first of the names that perception gives by itself, beyond those of entities, which a grant
    /// may tell.
    pub const FIRST_OWN: TrackId = TrackId(1 << 20);
}

/// `#31` is an entity, `t31` a track that perception keeps by itself.
impl fmt::Display for TrackId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.checked_sub(TrackId::FIRST_OWN.0) {
            Some(n) => write!(f, "t{n}"),
            None => write!(f, "#{}", self.0),
        }
    }
}

/// An action as a mind means it, about a track.
pub type Intent = Action<TrackId>;

/// The action by which an intent is carried out; `None` if what it is about can't be named now.
pub fn named(intent: Intent, target: impl Fn(TrackId) -> Option<Target>) -> Option<Action> {
    let subject = intent.subject().map(target);
    if subject == Some(None) {
        return None;
    }
    let nothing = Target::Entity(EntityId::NOTHING);
    Some(intent.map(|_| subject.flatten().unwrap_or(nothing)))
}

/// What a hand holds, as far as its owner knows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Carried {
    /// Which thing; `None` if the owner did not see what it took.
    pub what: Option<(TrackId, ClassId)>,
    /// What is in it, in the order it was put in, as far as is known.
    pub contents: Vec<(TrackId, ClassId)>,
    /// How many things are in it, as the hand feels.
    pub n_contents: u32,
}

impl Carried {
    /// Its class, if it is known.
    pub fn class(&self) -> Option<ClassId> {
        self.what.map(|(_, class)| class)
    }

    /// It and all that is in it, as far as known.
    pub fn all(&self) -> impl Iterator<Item = (TrackId, ClassId)> {
        self.what.into_iter().chain(self.contents.iter().copied())
    }
}

/// What the two hands hold, left and right; furniture is in both.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hands {
    /// By hand.
    pub hands: [Option<Carried>; 2],
    /// Whether both hold one thing.
    pub is_joint: bool,
}

impl Hands {
    /// The distinct things held.
    pub fn held(&self) -> impl Iterator<Item = &Carried> {
        let [left, right] = &self.hands;
        let is_joint = self.is_joint;
        left.iter().chain(right.iter().filter(move |_| !is_joint))
    }

    /// Everything held, contents included, as far as known.
    pub fn all(&self) -> impl Iterator<Item = (TrackId, ClassId)> {
        self.held().flat_map(Carried::all)
    }

    /// Whether a hand holds this thing itself.
    pub fn holds(&self, track: TrackId) -> bool {
        self.held().any(|c| c.what.is_some_and(|(t, _)| t == track))
    }
}
