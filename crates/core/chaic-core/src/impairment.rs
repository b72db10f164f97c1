//! What impairs a body beside the kind of person that it is: rows that change a [`Capability`], any of
//! them together and with any [`Persona`](crate::capability::Persona).

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::capability::{Capability, Endurance, Sight, Tremor, UsableHands};

/// One impairment.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Impairment {
    /// One arm is in a sling.
    OneHanded,
    /// Sees two metres far, and not sharply.
    LowVision,
    /// Tires by work and recovers by rest.
    Tires,
    /// Trembles, so that things slip.
    Tremor,
}

/// What is fixed for an impairment.
#[derive(Clone, Copy, Debug)]
pub struct ImpairmentInfo {
    /// The impairment.
    pub id: Impairment,
    /// Name in commands and files.
    pub name: &'static str,
    /// In a sentence about a person, for prompts and tables.
    pub about: &'static str,
    /// What it does to what a body can do.
    pub change: fn(Capability) -> Capability,
}

/// 3/60, below which the World Health Organization (ICD-11, 9D90) calls vision blindness: details
/// under 20 minutes of arc run together. As the blur's standard deviation, radians.
const LOW_ACUITY_RAD: f32 = 20.0 / 60.0 * std::f32::consts::PI / 180.0;

/// All of them. Their numbers are ours: large enough to be seen in the scores of an episode.
pub static IMPAIRMENTS: [ImpairmentInfo; 4] = [
    ImpairmentInfo {
        id: Impairment::OneHanded,
        name: "one_handed",
        about: "can use the right hand only, so neither fills containers nor lifts furniture",
        change: |body| Capability {
            hands: UsableHands::Right,
            carries_containers: false,
            lifts_furniture: false,
            ..body
        },
    },
    ImpairmentInfo {
        id: Impairment::LowVision,
        name: "low_vision",
        about: "sees nothing that is farther away than 2 m, and nothing sharply",
        change: |body| Capability {
            sight: Some(Sight {
                range_m: 2.0,
                blur_rad: LOW_ACUITY_RAD,
                field_rad: std::f32::consts::PI,
                lowered_rad: 30.0 / 180.0 * std::f32::consts::PI,
            }),
            ..body
        },
    },
    ImpairmentInfo {
        id: Impairment::Tires,
        name: "tires",
        about: "gets slow and weak by work, and recovers by rest",
        change: |body| Capability {
            endurance: Some(Endurance { work_frames: 400.0, rest_frames: 200.0, least: 0.4 }),
            ..body
        },
    },
    ImpairmentInfo {
        id: Impairment::Tremor,
        name: "tremor",
        about: "has trembling hands, from which things slip",
        // In 300 frames on the way a thing is dropped with a chance of about a fourth.
        change: |body| Capability {
            tremor: Some(Tremor { slip_chance: 0.35, drop_chance: 0.001 }),
            ..body
        },
    },
];

impl Impairment {
    /// What is fixed for it.
    pub fn info(self) -> &'static ImpairmentInfo {
        IMPAIRMENTS.iter().find(|i| i.id == self).expect("the table lists every impairment")
    }

    const fn bit(self) -> u8 {
        1 << self as u8
    }
}

/// A set of impairments; written as a list of names.
#[derive(
    Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(into = "Vec<Impairment>", from = "Vec<Impairment>")]
#[schemars(with = "Vec<Impairment>")]
pub struct Impairments(u8);

impl Impairments {
    /// None at all.
    pub const NONE: Impairments = Impairments(0);

    /// This one alone.
    pub const fn of(impairment: Impairment) -> Impairments {
        Impairments(impairment.bit())
    }

    /// These and one more.
    #[must_use]
    pub const fn with(self, impairment: Impairment) -> Impairments {
        Impairments(self.0 | impairment.bit())
    }

    /// Those that this body shows: which would change nothing more about it.
    pub fn seen_in(body: &Capability) -> Impairments {
        let rows = IMPAIRMENTS.iter().filter(|i| (i.change)(*body) == *body);
        rows.map(|i| i.id).collect()
    }

    /// Whether this is one of them.
    pub const fn has(self, impairment: Impairment) -> bool {
        self.0 & impairment.bit() != 0
    }

    /// Whether there are none.
    // `skip_serializing_if` hands over a reference.
    #[allow(clippy::trivially_copy_pass_by_ref)]
    pub fn is_empty(&self) -> bool {
        self.0 == 0
    }

    /// Each of them, in the table's order.
    pub fn iter(self) -> impl Iterator<Item = Impairment> {
        IMPAIRMENTS.iter().map(|i| i.id).filter(move |i| self.has(*i))
    }

    /// What is left of a body's limits and measures.
    pub fn apply(self, body: Capability) -> Capability {
        self.iter().fold(body, |body, impairment| (impairment.info().change)(body))
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
    fn sets_are_lists_in_files_and_keep_their_order() {
        let set: Impairments = serde_json::from_str("[\"tremor\",\"one_handed\"]").unwrap();
        assert_eq!(serde_json::to_string(&set).unwrap(), "[\"one_handed\",\"tremor\"]");
        assert!(set.has(Impairment::Tremor) && !set.has(Impairment::Tires));
    }

    #[test]
    fn impairments_compose_in_any_order() {
        let child = Persona::Child.capability();
        let all = Impairments::from_iter(IMPAIRMENTS.iter().map(|i| i.id)).apply(child);
        let backwards = IMPAIRMENTS.iter().rev().fold(child, |body, i| (i.change)(body));
        assert_eq!(all, backwards);
        assert!(all.hands == UsableHands::Right && all.sight.is_some());
        assert!(all.endurance.is_some() && all.tremor.is_some());
        assert_eq!(all.pick_range_m, child.pick_range_m);
        assert_eq!(Impairments::NONE.apply(child), child);
        for info in &IMPAIRMENTS {
            assert_eq!(Impairments::seen_in(&(info.change)(child)), Impairments::of(info.id));
        }
    }
}
