//! Personas, and kinds of people: a persona with impairments.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::body::{Capability, Gait, UsableHands};
use super::impairment::{IMPAIRMENTS, Impairments};

/// Personas: the kinds of people of the paper (section 3.1).
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Persona {
    /// An adult without constraint.
    Adult,
    /// The helper: as able as an adult.
    Helper,
    /// A child of 1.2 m who reaches [0, 1.5] m.
    Child,
    /// A wheelchair user who reaches [0.25, 1.5] m and is blocked by obstacles.
    Wheelchair,
    /// A person who walks a bicycle: slow, and docks it before a pick-up.
    Rider,
    /// A frail person with a sixth of the helper's strength.
    Frail,
}

/// Height range of people without a height limit (facts S1.1).
const FREE_RANGE_M: [f32; 2] = [0.0, 3.0];
/// Mean speed of the walk cycle in recordings of the original (facts S1.5).
const ADULT_SPEED: f32 = 0.047;
/// The original's child and rider walk at half of the adult speed (facts S1.5, measured).
const SLOW_SPEED: f32 = 0.0236;

const ADULT: Capability = Capability {
    pick_range_m: FREE_RANGE_M,
    put_range_m: FREE_RANGE_M,
    strength_kg: 600.0,
    speed_m_per_frame: ADULT_SPEED,
    approach_speed_m_per_frame: ADULT_SPEED,
    radius_m: 0.20,
    height_m: 1.75,
    eye_height_m: 1.65,
    gait: Gait::Walk,
    docking_frames: 0,
    breaks_fragile: false,
    removes_obstacles: true,
    carries_containers: true,
    lifts_furniture: true,
    hands: UsableHands::Both,
    eyesight: None,
    endurance: None,
    tremor: None,
};

impl Persona {
    /// All personas.
    pub const ALL: [Persona; 6] = [
        Persona::Adult,
        Persona::Helper,
        Persona::Child,
        Persona::Wheelchair,
        Persona::Rider,
        Persona::Frail,
    ];

    /// Returns the name in files and commands.
    pub fn name(self) -> &'static str {
        match self {
            Persona::Adult => "adult",
            Persona::Helper => "helper",
            Persona::Child => "child",
            Persona::Wheelchair => "wheelchair",
            Persona::Rider => "rider",
            Persona::Frail => "frail",
        }
    }

    /// Returns the physical limits and dimensions of this persona.
    pub const fn capability(self) -> Capability {
        match self {
            Persona::Adult | Persona::Helper => ADULT,
            Persona::Child => Capability {
                pick_range_m: [0.0, 1.5],
                put_range_m: [0.0, 1.5],
                strength_kg: 100.0,
                speed_m_per_frame: SLOW_SPEED,
                approach_speed_m_per_frame: SLOW_SPEED,
                radius_m: 0.15,
                height_m: 1.2,
                eye_height_m: 1.08,
                breaks_fragile: true,
                ..ADULT
            },
            Persona::Wheelchair => Capability {
                pick_range_m: [0.25, 1.5],
                put_range_m: [0.25, 1.5],
                strength_kg: 500.0,
                radius_m: 0.35,
                height_m: 1.35,
                eye_height_m: 1.2,
                gait: Gait::Roll,
                removes_obstacles: false,
                ..ADULT
            },
            // The original's rider does not push the bicycle during an approach (facts S8.2), so it
            // has the speed of an adult.
            Persona::Rider => Capability {
                speed_m_per_frame: SLOW_SPEED,
                gait: Gait::WalkBike,
                docking_frames: 50,
                ..ADULT
            },
            Persona::Frail => {
                Capability { strength_kg: 100.0, height_m: 1.65, eye_height_m: 1.55, ..ADULT }
            }
        }
    }
}

/// A persona with impairments, written `child` or `child+one_handed`.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(into = "String", try_from = "String")]
#[schemars(with = "String")]
pub struct PersonKind {
    /// The persona.
    pub persona: Persona,
    /// Additional impairments.
    pub impairments: Impairments,
}

impl PersonKind {
    /// Returns all names and their syntax, for messages.
    pub fn choices() -> String {
        let people = Persona::ALL.map(Persona::name).join(", ");
        let impairments = IMPAIRMENTS.map(|i| i.name).join(", ");
        format!("one of {people}; add + and a name for each impairment: {impairments}")
    }

    /// Returns the capability: that of the persona with the impairments applied.
    pub fn capability(self) -> Capability {
        self.impairments.apply(self.persona.capability())
    }
}

impl From<Persona> for PersonKind {
    fn from(persona: Persona) -> PersonKind {
        PersonKind { persona, impairments: Impairments::NONE }
    }
}

impl From<PersonKind> for String {
    fn from(kind: PersonKind) -> String {
        kind.to_string()
    }
}

impl TryFrom<String> for PersonKind {
    type Error = UnknownPerson;

    fn try_from(text: String) -> Result<PersonKind, UnknownPerson> {
        text.parse()
    }
}

impl fmt::Display for PersonKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.persona.name())?;
        self.impairments.iter().try_for_each(|i| write!(f, "+{}", i.info().name))
    }
}

/// A text that is not a kind of person.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownPerson(pub String);

impl fmt::Display for UnknownPerson {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "unknown kind of person `{}`; use {}", self.0, PersonKind::choices())
    }
}

impl std::error::Error for UnknownPerson {}

impl FromStr for PersonKind {
    type Err = UnknownPerson;

    fn from_str(text: &str) -> Result<PersonKind, UnknownPerson> {
        let unknown = || UnknownPerson(text.to_owned());
        let mut words = text.split('+');
        let persona = words.next().unwrap_or_default();
        let persona = Persona::ALL.into_iter().find(|p| p.name() == persona).ok_or_else(unknown)?;
        let mut kind = PersonKind::from(persona);
        for word in words {
            let info = IMPAIRMENTS.iter().find(|i| i.name == word).ok_or_else(unknown)?;
            kind.impairments = kind.impairments.with(info.id);
        }
        Ok(kind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_and_strengths_match_the_paper() {
        assert_eq!(Persona::Child.capability().pick_range_m, [0.0, 1.5]);
        assert_eq!(Persona::Wheelchair.capability().pick_range_m, [0.25, 1.5]);
        let (frail, helper) = (Persona::Frail.capability(), Persona::Helper.capability());
        assert_eq!(frail.strength_kg * 6.0, helper.strength_kg);
        assert_eq!(Persona::Child.capability().height_m, 1.2);
    }

    #[test]
    fn kinds_of_people_roundtrip_through_text() {
        for text in ["child", "child+one_handed", "frail+one_handed+low_vision+tires+tremor"] {
            let kind: PersonKind = text.parse().expect("a valid kind");
            assert_eq!(kind.to_string(), text);
        }
        assert_eq!(
            "adult+tremor+tires".parse::<PersonKind>().unwrap().to_string(),
            "adult+tires+tremor"
        );
        for text in ["", "ogre", "child+", "child+wheelchair", "one_handed"] {
            let error = text.parse::<PersonKind>().unwrap_err().to_string();
            assert!(error.contains("one_handed"), "{error}");
        }
        for persona in Persona::ALL {
            let json = serde_json::to_string(&persona).unwrap();
            assert_eq!(json, format!("\"{}\"", persona.name()));
        }
    }

    #[test]
    fn optional_limits_are_not_serialized_without_impairments() {
        let json = serde_json::to_value(Persona::Child.capability()).unwrap();
        assert_eq!(json.as_object().map(|fields| fields.len()), Some(12));
    }
}
