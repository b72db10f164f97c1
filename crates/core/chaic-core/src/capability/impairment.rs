//! Impairments: changes of a [`Capability`] that combine with each other and with any
//! [`Persona`](crate::capability::Persona).

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::body::{Capability, Endurance, Eyesight, Tremor, UsableHands};

/// An impairment.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Impairment {
    /// One arm is in a sling.
    OneHanded,
    /// Sees only 2 m far, and blurred.
    LowVision,
    /// Tires by work and recovers by rest.
    Tires,
    /// Trembling hands, from which objects slip.
    Tremor,
}

/// Description of an impairment.
#[derive(Clone, Copy, Debug)]
pub struct ImpairmentInfo {
    /// The impairment.
    pub id: Impairment,
    /// Name in commands and files.
    pub name: &'static str,
    /// Predicate of a sentence about a person, such as `recovers by rest`; for prompts and tables.
    pub about: &'static str,
    /// Change of a capability.
    pub change: fn(Capability) -> Capability,
}

/// Blur that corresponds to a visual acuity of 3/60, as a standard deviation, radians. Details
/// under 20 minutes of arc merge. The World Health Organization classifies a lower acuity as
/// blindness (ICD-11, 9D90).
const LOW_ACUITY_RAD: f32 = 20.0 / 60.0 * std::f32::consts::PI / 180.0;

/// Table of all impairments. The values are ours: large enough for visible effects on scores.
pub static IMPAIRMENTS: [ImpairmentInfo; 4] = [
    ImpairmentInfo {
        id: Impairment::OneHanded,
        name: "one_handed",
        about: "can use the right hand only, so neither fills containers nor lifts furniture",
        change: |capability| Capability {
            hands: UsableHands::Right,
            carries_containers: false,
            lifts_furniture: false,
            ..capability
        },
    },
    ImpairmentInfo {
        id: Impairment::LowVision,
        name: "low_vision",
        about: "sees nothing that is farther away than 2 m, and nothing sharply",
        change: |capability| Capability {
            eyesight: Some(Eyesight {
                range_m: 2.0,
                blur_rad: LOW_ACUITY_RAD,
                field_rad: std::f32::consts::PI,
                lowered_rad: 30.0 / 180.0 * std::f32::consts::PI,
            }),
            ..capability
        },
    },
    ImpairmentInfo {
        id: Impairment::Tires,
        name: "tires",
        about: "gets slow and weak by work, and recovers by rest",
        change: |capability| Capability {
            endurance: Some(Endurance {
                work_frames: 400.0,
                rest_frames: 200.0,
                min_fraction: 0.4,
            }),
            ..capability
        },
    },
    ImpairmentInfo {
        id: Impairment::Tremor,
        name: "tremor",
        about: "has trembling hands, from which things slip",
        // In 300 frames of walking, a held object drops with a chance of about one fourth.
        change: |capability| Capability {
            tremor: Some(Tremor { slip_chance: 0.35, drop_chance: 0.001 }),
            ..capability
        },
    },
];

impl Impairment {
    /// Returns the table entry.
    pub fn info(self) -> &'static ImpairmentInfo {
        IMPAIRMENTS.iter().find(|i| i.id == self).expect("the table lists every impairment")
    }

    const fn bit(self) -> u8 {
        1 << self as u8
    }
}

/// A set of impairments; serialized as a list of names.
#[derive(
    Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(into = "Vec<Impairment>", from = "Vec<Impairment>")]
#[schemars(with = "Vec<Impairment>")]
pub struct Impairments(u8);

impl Impairments {
    /// The empty set.
    pub const NONE: Impairments = Impairments(0);

    /// Creates a set of one impairment.
    pub const fn new(impairment: Impairment) -> Impairments {
        Impairments(impairment.bit())
    }

    /// Returns the set with one more impairment.
    #[must_use]
    pub const fn with(self, impairment: Impairment) -> Impairments {
        Impairments(self.0 | impairment.bit())
    }

    /// Returns the impairments that are already part of a capability: applying them would not
    /// change it.
    pub fn from_capability(capability: &Capability) -> Impairments {
        let rows = IMPAIRMENTS.iter().filter(|i| (i.change)(*capability) == *capability);
        rows.map(|i| i.id).collect()
    }

    /// Returns whether the set contains this impairment.
    pub const fn has(self, impairment: Impairment) -> bool {
        self.0 & impairment.bit() != 0
    }

    /// Returns whether the set is empty.
    // `skip_serializing_if` passes a reference.
    #[allow(clippy::trivially_copy_pass_by_ref)]
    pub fn is_empty(&self) -> bool {
        self.0 == 0
    }

    /// Returns the impairments in the order of the table.
    pub fn iter(self) -> impl Iterator<Item = Impairment> {
        IMPAIRMENTS.iter().map(|i| i.id).filter(move |i| self.has(*i))
    }

    /// Applies the impairments to a capability.
    pub fn apply(self, capability: Capability) -> Capability {
        self.iter().fold(capability, |capability, i| (i.info().change)(capability))
    }
}

impl FromIterator<Impairment> for Impairments {
    fn from_iter<I: IntoIterator<Item = Impairment>>(iter: I) -> Impairments {
        iter.into_iter().fold(Impairments::NONE, Impairments::with)
    }
}

impl From<Vec<Impairment>> for Impairments {
    fn from(list: Vec<Impairment>) -> Impairments {
        list.into_iter().collect()
    }
}

impl From<Impairments> for Vec<Impairment> {
    fn from(set: Impairments) -> Vec<Impairment> {
        set.iter().collect()
    }
}

impl fmt::Debug for Impairments {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capability::Persona;

    #[test]
    fn sets_are_serialized_as_ordered_lists() {
        let set: Impairments = serde_json::from_str("[\"tremor\",\"one_handed\"]").unwrap();
        assert_eq!(serde_json::to_string(&set).unwrap(), "[\"one_handed\",\"tremor\"]");
        assert!(set.has(Impairment::Tremor) && !set.has(Impairment::Tires));
    }

    #[test]
    fn impairments_compose_in_any_order() {
        let child = Persona::Child.capability();
        let all = Impairments::from_iter(IMPAIRMENTS.iter().map(|i| i.id)).apply(child);
        let reversed = IMPAIRMENTS.iter().rev().fold(child, |body, i| (i.change)(body));
        assert_eq!(all, reversed);
        assert!(all.hands == UsableHands::Right && all.eyesight.is_some());
        assert!(all.endurance.is_some() && all.tremor.is_some());
        assert_eq!(all.pick_range_m, child.pick_range_m);
        assert_eq!(Impairments::NONE.apply(child), child);
        for info in &IMPAIRMENTS {
            assert_eq!(
                Impairments::from_capability(&(info.change)(child)),
                Impairments::new(info.id)
            );
        }
    }
}
