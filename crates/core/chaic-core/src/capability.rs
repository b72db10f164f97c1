//! What a body can do. A constraint is a value of [`Capability`], never a piece of code.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::action::Hand;
pub use crate::impairment::{IMPAIRMENTS, Impairment, ImpairmentInfo, Impairments};

/// The kinds of people of the paper (section 3.1).
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
    /// Somebody in a wheelchair who reaches [0.25, 1.5] m and whom obstacles block.
    Wheelchair,
    /// Somebody walking a bicycle: slow, and docks it before picking up.
    Rider,
    /// A frail person with a sixth of the helper's strength.
    Frail,
}

/// How a body gets about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Gait {
    /// On two feet.
    Walk,
    /// In a wheelchair.
    Roll,
    /// Walking beside a bicycle, one hand on it.
    WalkBike,
}

/// Limits and measures of one body. All heights are above the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Capability {
    /// Lowest and highest top of an object that this person picks up without risk of failing,
    /// metres (paper section 3.1; facts S1.1).
    pub pick_range_m: [f32; 2],
    /// The same for the top of a surface that something is put on, metres.
    pub put_range_m: [f32; 2],
    /// Heaviest mass lifted without risk of failing, kilograms (facts S1.1).
    pub strength_kg: f32,
    /// Distance covered in a frame of walking, metres (facts S1.5).
    pub speed_m_per_frame: f32,
    /// Distance covered in a frame while stepping up to an object that is being picked up or put
    /// somewhere, metres.
    pub approach_speed_m_per_frame: f32,
    /// Radius of the upright cylinder that collides, metres. Adult: half of the original probe's
    /// mean width (0.64 by 0.18 m). Wheelchair: half of an ISO 7176 occupied width of 0.7 m.
    pub radius_m: f32,
    /// Height of the body, metres.
    pub height_m: f32,
    /// Height of the eyes, metres.
    pub eye_height_m: f32,
    /// Way of moving.
    pub gait: Gait,
    /// Frames to dock a vehicle before the hands are free, 0 without vehicle (facts S8.2).
    pub docking_frames: u32,
    /// Whether fragile things may break in these hands (facts S6).
    pub breaks_fragile: bool,
    /// Whether this person can lift obstacles out of the way (paper section 3.1: somebody in a
    /// wheelchair can't).
    #[serde(default = "able")]
    pub removes_obstacles: bool,
    /// Whether this person can take containers, which the other hand fills.
    #[serde(default = "able", skip_serializing_if = "is_able")]
    pub carries_containers: bool,
    /// Whether this person can get hold of furniture, alone or with somebody.
    #[serde(default = "able", skip_serializing_if = "is_able")]
    pub lifts_furniture: bool,
    /// The hands that this person can use.
    #[serde(default, skip_serializing_if = "UsableHands::are_both")]
    pub hands: UsableHands,
    /// How far and how sharply this person sees, if not as the benchmark's cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sight: Option<Sight>,
    /// How this person tires, if it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub endurance: Option<Endurance>,
    /// How things slip from this person's hands, if they do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tremor: Option<Tremor>,
}

/// What an ability is where a file says nothing of it.
fn able() -> bool {
    true
}

// `skip_serializing_if` hands over a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_able(able: &bool) -> bool {
    *able
}

/// The hands that somebody can use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum UsableHands {
    /// The left and the right.
    #[default]
    Both,
    /// The right one.
    Right,
}

impl UsableHands {
    /// Each of them, left before right.
    pub fn all(self) -> &'static [Hand] {
        match self {
            UsableHands::Both => &Hand::BOTH,
            UsableHands::Right => &[Hand::Right],
        }
    }

    /// Whether this is one of them.
    pub fn include(self, hand: Hand) -> bool {
        self.all().contains(&hand)
    }

    // `skip_serializing_if` hands over a reference.
    #[allow(clippy::trivially_copy_pass_by_ref)]
    fn are_both(&self) -> bool {
        *self == UsableHands::Both
    }
}

/// How far, how sharply and how widely somebody sees. What is not seen has no color, no instance id,
/// and depth 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sight {
    /// Nothing farther away than this, measured over the floor, is seen, metres.
    pub range_m: f32,
    /// Standard deviation of the blur, radians of visual angle at the middle of the image.
    pub blur_rad: f32,
    /// Angle of the cone that is seen, radians.
    pub field_rad: f32,
    /// How far the gaze is lowered from level, radians: who sees little looks before the feet.
    pub lowered_rad: f32,
}

/// How somebody tires: fatigue grows by `1 / work_frames` in each frame of walking, handling or
/// carrying along, falls by `1 / rest_frames` in any other, and stays within 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Endurance {
    /// Frames of work after which somebody rested is exhausted.
    pub work_frames: f32,
    /// Frames of rest after which somebody exhausted is rested.
    pub rest_frames: f32,
    /// Part of speed and strength that is left when exhausted.
    pub least: f32,
}

impl Endurance {
    /// Fatigue a frame later.
    pub fn after_frame(&self, fatigue: f32, works: bool) -> f32 {
        let change = if works { 1.0 / self.work_frames } else { -1.0 / self.rest_frames };
        (fatigue + change).clamp(0.0, 1.0)
    }

    /// Part of speed and strength that is left.
    pub fn part_left(&self, fatigue: f32) -> f32 {
        1.0 - (1.0 - self.least) * fatigue
    }
}

/// How things slip from somebody's hands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tremor {
    /// Chance that a grasp slips that would have held.
    pub slip_chance: f32,
    /// Chance to drop what a hand holds, in each frame of walking or standing.
    pub drop_chance: f32,
}

/// Heights that everybody without a limit reaches (facts S1.1).
const FREE_RANGE_M: [f32; 2] = [0.0, 3.0];
/// Mean of the walk cycle measured on the original's recordings (facts S1.5).
const ADULT_SPEED: f32 = 0.047;
/// The original's child and rider walk at half of it (facts S1.5, measured).
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
    sight: None,
    endurance: None,
    tremor: None,
};

impl Persona {
    /// Every kind.
    pub const ALL: [Persona; 6] = [
        Persona::Adult,
        Persona::Helper,
        Persona::Child,
        Persona::Wheelchair,
        Persona::Rider,
        Persona::Frail,
    ];

    /// Its name, as files and commands spell it.
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

    /// The limits and measures of this kind of person.
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
            // The original's rider lets go of the bicycle's pace to step up to an object
            // (facts S8.2): the approach is at an adult's speed.
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

/// What kind of person, and what impairs it: written `child` or `child+one_handed`.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(into = "String", try_from = "String")]
#[schemars(with = "String")]
pub struct PersonKind {
    /// The kind.
    pub persona: Persona,
    /// What impairs it besides.
    pub impairments: Impairments,
}

impl PersonKind {
    /// How people are written, for messages: all names that there are.
    pub fn choices() -> String {
        let people = Persona::ALL.map(Persona::name).join(", ");
        let impairments = IMPAIRMENTS.map(|i| i.name).join(", ");
        format!("one of {people}, and + before each of {impairments} that it has besides")
    }

    /// The limits and measures of such a person.
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

/// No person is called so.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownPerson(pub String);

impl fmt::Display for UnknownPerson {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no person is called `{}`; write {}", self.0, PersonKind::choices())
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

/// How far `value` lies outside `[low, high]`; 0 inside.
pub fn excess(value: f32, [low, high]: [f32; 2]) -> f32 {
    (low - value).max(value - high).max(0.0)
}

/// Success probability exp(-delta / alpha) / beta of exceeding one limit by `delta`, 1 within it
/// (paper section 3.1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LimitPenalty {
    /// Excess over which the chance falls to 1/e, in the unit of the limit.
    pub alpha: f32,
    /// Divisor that applies as soon as the limit is exceeded at all.
    pub beta: f32,
}

impl LimitPenalty {
    /// The chance of an action that exceeds its limit by `delta`.
    ///
    /// ```
    /// # use chaic_core::capability::LimitPenalty;
    /// let pick = LimitPenalty { alpha: 1.0, beta: 2.0 };
    /// assert_eq!(pick.chance(0.0), 1.0);
    /// assert!((pick.chance(0.25) - 0.389).abs() < 1e-3);
    /// ```
    pub fn chance(&self, delta: f32) -> f32 {
        if delta <= 0.0 { 1.0 } else { crate::geom::math::exp(-delta / self.alpha) / self.beta }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_ranges_and_strengths() {
        assert_eq!(Persona::Child.capability().pick_range_m, [0.0, 1.5]);
        assert_eq!(Persona::Wheelchair.capability().pick_range_m, [0.25, 1.5]);
        let (frail, helper) = (Persona::Frail.capability(), Persona::Helper.capability());
        assert_eq!(frail.strength_kg * 6.0, helper.strength_kg);
        assert_eq!(Persona::Child.capability().height_m, 1.2);
    }

    #[test]
    fn people_are_written_as_they_are_read() {
        for text in ["child", "child+one_handed", "frail+one_handed+low_vision+tires+tremor"] {
            let kind: PersonKind = text.parse().expect("it is a person");
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
    fn whom_nothing_impairs_is_written_as_before_there_were_impairments() {
        let json = serde_json::to_value(Persona::Child.capability()).unwrap();
        assert_eq!(json.as_object().map(|fields| fields.len()), Some(12));
    }

    #[test]
    fn who_tires_recovers() {
        let endurance = Endurance { work_frames: 100.0, rest_frames: 50.0, least: 0.4 };
        let after = |frames: u32, works: bool, from: f32| {
            (0..frames).fold(from, |fatigue, _| endurance.after_frame(fatigue, works))
        };
        assert!((after(50, true, 0.0) - 0.5).abs() < 1e-5 && after(200, true, 0.0) == 1.0);
        assert!((after(25, false, 1.0) - 0.5).abs() < 1e-5 && after(80, false, 1.0) == 0.0);
        assert!(endurance.part_left(0.0) == 1.0 && (endurance.part_left(1.0) - 0.4).abs() < 1e-6);
    }

    #[test]
    fn chances_match_the_hand_worked_table() {
        let (pick, put) =
            (LimitPenalty { alpha: 1.0, beta: 2.0 }, LimitPenalty { alpha: 1.0, beta: 1.0 });
        let lift = LimitPenalty { alpha: 50.0, beta: 1.0 };
        for (chance, expected) in [
            (pick.chance(0.10), 0.452),
            (pick.chance(0.80), 0.225),
            (put.chance(0.25), 0.779),
            (put.chance(0.60), 0.549),
            (lift.chance(20.0), 0.670),
            (lift.chance(100.0), 0.135),
        ] {
            assert!((chance - expected).abs() < 1e-3, "{chance} is not {expected}");
        }
        assert_eq!(excess(0.1, [0.25, 1.5]), 0.15);
        assert_eq!(excess(1.0, [0.25, 1.5]), 0.0);
    }
}
