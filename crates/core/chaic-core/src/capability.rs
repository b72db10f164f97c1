//! Body capabilities. A constraint is a value of [`Capability`], never a branch in the code.

mod body;
mod impairment;
mod person;
mod person_change;

pub use body::{Capability, Endurance, Eyesight, Gait, LimitPenalty, Tremor, UsableHands, excess};
pub use impairment::{IMPAIRMENTS, Impairment, ImpairmentInfo, Impairments};
pub use person::{PersonKind, Persona, UnknownPerson};
pub use person_change::{PersonChange, UnknownPersonChange};
