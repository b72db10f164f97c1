//! Changes of a person: another persona, more impairments, another walking speed.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::body::Capability;
use super::impairment::{IMPAIRMENTS, Impairment, Impairments};
use super::person::{PersonKind, Persona};
use crate::rng::RngStream;

/// Prefix of the walking speed in a change, as in `speed80`.
const SPEED: &str = "speed";
/// Allowed walking speeds, percent of the person's own.
const SPEED_PERCENT: std::ops::RangeInclusive<u16> = 50..=200;
/// Lowest and highest walking speed of drawn changes, percent of the person's own.
const DRAWN_SPEED_PERCENT: [u16; 2] = [65, 150];
/// Probability of each impairment of [`DRAWN_IMPAIRMENTS`] in a drawn change.
const IMPAIRMENT_CHANCE: f32 = 0.25;
/// Impairments of drawn changes: those that a partner of any task can have. A one-handed person can
/// neither lift furniture nor push a bicycle.
const DRAWN_IMPAIRMENTS: [Impairment; 3] =
    [Impairment::LowVision, Impairment::Tires, Impairment::Tremor];

/// Change of a partner, written as words with `+` between them: a persona, impairments, and `speedN`
/// for N percent of the walking speed. `child+one_handed` is another person, and `+tires+speed80` is
/// the same person, who tires and walks more slowly.
///
/// ```
/// use chaic_core::capability::PersonChange;
/// let change: PersonChange = "+speed80+tires".parse().unwrap();
/// assert_eq!(change.to_string(), "+tires+speed80");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct PersonChange {
    persona: Option<Persona>,
    impairments: Impairments,
    speed_percent: u16,
}

impl PersonChange {
    const NONE: PersonChange =
        PersonChange { persona: None, impairments: Impairments::NONE, speed_percent: 100 };

    /// Returns all words and their syntax, for messages.
    pub fn choices() -> String {
        let (low, high) = (SPEED_PERCENT.start(), SPEED_PERCENT.end());
        let people = partner_personas().map(Persona::name).collect::<Vec<_>>().join(", ");
        let impairments = IMPAIRMENTS.map(|i| i.name).join(", ");
        format!(
            "one of {people}; add + and a name for each impairment: {impairments}, and +{SPEED}N for a \
             walking speed of N percent, {low} to {high}; without a person, the changes apply to the person \
             of the episode, like +{}",
            IMPAIRMENTS[0].name,
        )
    }

    /// Returns the new persona; `None` if the change keeps the persona.
    pub fn persona(self) -> Option<Persona> {
        self.persona
    }

    /// Returns the additional impairments.
    pub fn impairments(self) -> Impairments {
        self.impairments
    }

    /// Returns the capability with the changed walking speed; `None` if the change keeps the speed.
    pub fn with_speed(self, capability: Capability) -> Option<Capability> {
        let factor = f32::from(self.speed_percent) / 100.0;
        (self.speed_percent != 100).then_some(Capability {
            speed_m_per_frame: factor * capability.speed_m_per_frame,
            approach_speed_m_per_frame: factor * capability.approach_speed_m_per_frame,
            ..capability
        })
    }

    /// Draws a change that a partner of any task can have. Each of three impairments has probability
    /// 0.25. In half of the cases, the speed becomes 65 to 150 percent. `None` if nothing changes.
    pub fn draw(seed: u64) -> Option<PersonChange> {
        let mut stream = RngStream::new(seed, "drawn person", 0);
        let impairments =
            DRAWN_IMPAIRMENTS.into_iter().filter(|_| stream.chance(IMPAIRMENT_CHANCE)).collect();
        let [slowest, fastest] = DRAWN_SPEED_PERCENT;
        let speed_percent = match stream.chance(0.5) {
            true => slowest + stream.below(usize::from(fastest - slowest) + 1) as u16,
            false => 100,
        };
        let change = PersonChange { persona: None, impairments, speed_percent };
        (change != PersonChange::NONE).then_some(change)
    }
}

/// Returns the personas that a partner can have.
fn partner_personas() -> impl Iterator<Item = Persona> {
    Persona::ALL.into_iter().filter(|persona| *persona != Persona::Helper)
}

impl From<PersonKind> for PersonChange {
    fn from(kind: PersonKind) -> PersonChange {
        let PersonKind { persona, impairments } = kind;
        PersonChange { persona: Some(persona), impairments, ..PersonChange::NONE }
    }
}

impl From<PersonChange> for String {
    fn from(change: PersonChange) -> String {
        change.to_string()
    }
}

impl TryFrom<String> for PersonChange {
    type Error = UnknownPersonChange;

    fn try_from(text: String) -> Result<PersonChange, UnknownPersonChange> {
        text.parse()
    }
}

impl fmt::Display for PersonChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.persona.map_or("", Persona::name))?;
        self.impairments.iter().try_for_each(|i| write!(f, "+{}", i.info().name))?;
        match self.speed_percent {
            100 => Ok(()),
            percent => write!(f, "+{SPEED}{percent}"),
        }
    }
}

/// Error: the text is not a change of a person.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownPersonChange(String);

impl fmt::Display for UnknownPersonChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "unknown kind of person `{}`; use {}", self.0, PersonChange::choices())
    }
}

impl std::error::Error for UnknownPersonChange {}

impl FromStr for PersonChange {
    type Err = UnknownPersonChange;

    fn from_str(text: &str) -> Result<PersonChange, UnknownPersonChange> {
        let unknown = || UnknownPersonChange(text.to_owned());
        let mut change = PersonChange::NONE;
        for (k, word) in text.split('+').enumerate() {
            let impairment = IMPAIRMENTS.iter().find(|i| i.name == word);
            match (k, word.strip_prefix(SPEED), impairment) {
                (0, ..) if word.is_empty() => {}
                (0, ..) => {
                    let persona = partner_personas().find(|p| p.name() == word);
                    change.persona = Some(persona.ok_or_else(unknown)?);
                }
                (_, _, Some(info)) => change.impairments = change.impairments.with(info.id),
                (_, Some(percent), None) if change.speed_percent == 100 => {
                    let percent = percent.parse().ok().filter(|p| SPEED_PERCENT.contains(p));
                    change.speed_percent = percent.ok_or_else(unknown)?;
                }
                _ => return Err(unknown()),
            }
        }
        if change == PersonChange::NONE { Err(unknown()) } else { Ok(change) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_roundtrip_through_text() {
        for text in ["child", "child+one_handed", "+tires", "+speed150", "frail+tremor+speed50"] {
            let change: PersonChange = text.parse().expect("a valid change");
            assert_eq!(change.to_string(), text);
        }
        let kind: PersonKind = "child+one_handed".parse().expect("a valid kind");
        assert_eq!("child+one_handed".parse(), Ok(PersonChange::from(kind)));
        let bad = ["", "+", "ogre", "child+", "tires", "+child", "+speed100", "+speed49"];
        for text in bad.into_iter().chain(["+speed201", "+speed", "+speed-70", "+speed70+speed70"])
        {
            let error = text.parse::<PersonChange>().expect_err(text).to_string();
            assert!(error.contains("50 to 200") && !error.contains('\n'), "{error}");
        }
        // A partner is no helper.
        let error = "helper+tires".parse::<PersonChange>().expect_err("no partner").to_string();
        assert!(error.contains("one of adult, child, wheelchair, rider, frail;"), "{error}");
    }

    #[test]
    fn the_speed_is_relative_to_that_of_the_person() {
        let child = Persona::Child.capability();
        let fast: PersonChange = "+speed150".parse().expect("a valid change");
        let changed = fast.with_speed(child).expect("another speed");
        assert_eq!(changed.speed_m_per_frame, 1.5 * child.speed_m_per_frame);
        assert_eq!(changed.approach_speed_m_per_frame, 1.5 * child.approach_speed_m_per_frame);
        assert_eq!(changed.strength_kg, child.strength_kg);
        let tires: PersonChange = "+tires".parse().expect("a valid change");
        assert_eq!(tires.with_speed(child), None);
    }

    #[test]
    fn drawn_changes_follow_from_the_seed() {
        let drawn: Vec<Option<PersonChange>> = (0..300).map(PersonChange::draw).collect();
        assert_eq!(drawn, (0..300).map(PersonChange::draw).collect::<Vec<_>>());
        let unchanged = drawn.iter().filter(|change| change.is_none()).count();
        // The expected number is 300 * 0.75^3 / 2 = 63.
        assert!((40..90).contains(&unchanged), "{unchanged}");
        let drawn: Vec<PersonChange> = drawn.into_iter().flatten().collect();
        for impairment in DRAWN_IMPAIRMENTS {
            let n = drawn.iter().filter(|change| change.impairments.has(impairment)).count();
            assert!((50..100).contains(&n), "{impairment:?}: {n}");
        }
        for change in drawn {
            assert_eq!(change.to_string().parse(), Ok(change));
        }
    }
}
