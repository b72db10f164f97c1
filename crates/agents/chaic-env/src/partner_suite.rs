//! Lists of partners: the bundled suite, and lists in files.

use std::collections::BTreeSet;

use chaic_agents::partners::{HabitsError, PartnerHabits, partner_habits, recorded_partner_name};
use chaic_core::capability::PersonChange;
use serde::{Deserialize, Serialize};

use crate::error::{EnvError, Result};
use crate::helper_registry::RULES;

/// Format of a list in a file.
const FORMAT: &str = "chaic-partners";
/// Version of the format.
const VERSION: u32 = 1;
/// Maximum length of a name, characters; a name is a file name.
const MAX_NAME: usize = 40;

/// Name of the bundled suite in commands.
pub const SUITE: &str = "suite";
/// Maximum number of partners in a list.
pub const MAX_PARTNERS: usize = 100;
/// Maximum size of a list's file, bytes: a hundred partners with all parameters take 30 KiB.
pub const MAX_FILE_BYTES: u64 = 256 << 10;

/// Partner of a list: the agent that controls it, and its body.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SuitePartner {
    /// Name in the list and of the partner's run folder.
    pub name: String,
    /// Agent that controls the partner, as in `--partner`; `None` for the rules.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub partner: Option<String>,
    /// Change of the partner's body, as in `--person`; `None` for the person of the episode.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub person: Option<PersonChange>,
}

/// List of partners that a run plays beside the ordinary partner: the rules, and the person of each
/// episode.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartnerSuite {
    partners: Vec<SuitePartner>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SuiteFile {
    format: String,
    version: u32,
    partners: Vec<SuitePartner>,
}

/// Entry of [`BUNDLED`].
struct BundledPartner {
    name: &'static str,
    partner: Option<&'static str>,
    person: Option<&'static str>,
}

const fn agent(name: &'static str) -> BundledPartner {
    BundledPartner { name, partner: Some(name), person: None }
}

const fn body(name: &'static str, person: &'static str) -> BundledPartner {
    BundledPartner { name, partner: None, person: Some(person) }
}

/// Partners of the bundled suite. Every partner can play every task.
static BUNDLED: [BundledPartner; 13] = [
    agent("farthest"),
    agent("shuffled"),
    agent("noisy"),
    agent("slow"),
    agent("no_containers"),
    agent("forgetful"),
    agent("one_by_one"),
    // The registry of chaic-learn creates it.
    agent("cloned"),
    body("fast_walker", "+speed150"),
    body("slow_walker", "+speed65"),
    body("tires_trembles", "+tires+tremor"),
    body("sees_little", "+low_vision+speed80"),
    BundledPartner {
        name: "erratic",
        partner: Some("habits:order=random,noise=20,pause=30,memory=150"),
        person: Some("+tremor"),
    },
];

impl SuitePartner {
    /// Returns the ordinary partner.
    pub fn ordinary() -> SuitePartner {
        SuitePartner { name: RULES.to_owned(), partner: None, person: None }
    }

    /// Draws the habits and the body of a partner.
    pub fn drawn(name: String, seed: u64) -> SuitePartner {
        let partner = Some(PartnerHabits::draw(seed).to_string());
        SuitePartner { name, partner, person: PersonChange::draw(seed) }
    }

    /// Returns the problem of an entry. Its agent must be a plain name, or one that needs no registry.
    fn problem(&self) -> Option<String> {
        let SuitePartner { name, partner, person } = self;
        let is_name = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
        if name.is_empty() || name.len() > MAX_NAME || !name.chars().all(is_name) {
            return Some(format!(
                "the name `{}` must have 1 to {MAX_NAME} letters, digits, _ or -",
                name.escape_debug()
            ));
        }
        if name == RULES {
            return Some(format!("`{RULES}` is the ordinary partner, which every run plays"));
        }
        // The ordinary rules are no deviation.
        match partner.as_deref().filter(|name| *name != RULES).map(partner_habits) {
            None if person.is_none() && partner.is_some() => Some(format!(
                "`{name}` has the partner `{RULES}` and no `person`, so it is the ordinary partner, \
                 which every run plays"
            )),
            None if person.is_none() => Some(format!("`{name}` has no `partner` and no `person`")),
            Some(Err(HabitsError::Invalid(problem))) => Some(format!("`{name}`: {problem}")),
            _ => None,
        }
    }
}

impl PartnerSuite {
    /// Returns the bundled suite.
    pub fn bundled() -> PartnerSuite {
        let partners = BUNDLED.iter().map(|row| SuitePartner {
            name: row.name.to_owned(),
            partner: row.partner.map(str::to_owned),
            person: row.person.map(|text| text.parse().expect("a test parses every row")),
        });
        PartnerSuite { partners: partners.collect() }
    }

    /// Creates a list of partners, with names that [`recorded_partner_name`] returns.
    ///
    /// # Errors
    /// One line that describes the first problem: no or too many partners, a name that is invalid or
    /// repeated, wrong parameters.
    pub fn new(partners: Vec<SuitePartner>) -> std::result::Result<PartnerSuite, String> {
        if partners.is_empty() || partners.len() > MAX_PARTNERS {
            return Err(format!(
                "it has {} partners, expected 1 to {MAX_PARTNERS}",
                partners.len()
            ));
        }
        let mut names = BTreeSet::new();
        for entry in &partners {
            if let Some(problem) = entry.problem() {
                return Err(problem);
            }
            // The names are names of folders, and some file systems ignore case.
            if !names.insert(entry.name.to_lowercase()) {
                return Err(format!("two partners have the name `{}`", entry.name));
            }
        }
        let recorded = |entry: SuitePartner| SuitePartner {
            partner: entry
                .partner
                .as_deref()
                .filter(|name| *name != RULES)
                .map(recorded_partner_name),
            ..entry
        };
        Ok(PartnerSuite { partners: partners.into_iter().map(recorded).collect() })
    }

    /// Parses a list; `source_name` names its file in errors.
    ///
    /// # Errors
    /// [`EnvError::Partners`] with the problem in one line.
    pub fn parse(bytes: &[u8], source_name: &str) -> Result<PartnerSuite> {
        let partners_error =
            |problem: String| EnvError::Partners { source_name: source_name.to_owned(), problem };
        let file: SuiteFile =
            serde_json::from_slice(bytes).map_err(|error| partners_error(error.to_string()))?;
        if file.format != FORMAT || file.version != VERSION {
            let found = file.format.escape_debug();
            return Err(partners_error(format!(
                "`{found}` {}, expected `{FORMAT}` {VERSION}",
                file.version
            )));
        }
        PartnerSuite::new(file.partners).map_err(partners_error)
    }

    /// Returns the content of a file.
    pub fn to_json(&self) -> String {
        let (format, partners) = (FORMAT.to_owned(), self.partners.clone());
        let file = SuiteFile { format, version: VERSION, partners };
        serde_json::to_string_pretty(&file).expect("plain fields") + "\n"
    }

    /// Returns the partners without the ordinary one.
    pub fn partners(&self) -> &[SuitePartner] {
        &self.partners
    }

    /// Returns the ordinary partner, and then the partners of the list.
    pub fn with_ordinary(&self) -> Vec<SuitePartner> {
        [SuitePartner::ordinary()].into_iter().chain(self.partners.iter().cloned()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_partner_of_the_bundled_suite_is_valid_and_different() {
        let suite = PartnerSuite::bundled();
        assert_eq!(PartnerSuite::new(suite.partners().to_vec()).as_ref(), Ok(&suite));
        let parsed = PartnerSuite::parse(suite.to_json().as_bytes(), "suite").expect("its format");
        assert_eq!(parsed, suite);
        for (k, entry) in suite.partners.iter().enumerate() {
            let is_same = |other: &&SuitePartner| {
                other.partner == entry.partner && other.person == entry.person
            };
            assert!(!suite.partners[..k].iter().any(|other| is_same(&other)), "{entry:?}");
        }
        assert_eq!(suite.with_ordinary().len(), suite.partners().len() + 1);
    }

    #[test]
    fn drawn_partners_follow_from_their_seed() {
        let drawn = |seed| SuitePartner::drawn("a".to_owned(), seed);
        assert_eq!(drawn(7), drawn(7));
        assert_ne!(drawn(7), drawn(8));
        // A list keeps the parameters, so that it does not depend on their distribution.
        let suite = PartnerSuite::new(vec![drawn(7)]).expect("a valid list");
        assert_eq!(suite.partners(), [drawn(7)]);
        assert!(suite.to_json().contains("habits:"), "{}", suite.to_json());
        let named = SuitePartner { partner: Some("drawn:7".to_owned()), ..drawn(7) };
        assert_eq!(PartnerSuite::new(vec![named]), Ok(suite));
    }

    #[test]
    fn wrong_lists_are_refused_with_one_line() {
        let entry = |fields: &str| {
            format!(r#"{{"format":"chaic-partners","version":1,"partners":[{fields}]}}"#)
        };
        let many = vec![r#"{"name":"a","partner":"slow"}"#; MAX_PARTNERS + 1].join(",");
        for (text, words) in [
            ("{".to_owned(), "EOF"),
            (entry("").replace("chaic-partners", "chaic-run"), "expected `chaic-partners` 1"),
            (entry("").replace(":1,", ":2,"), "expected `chaic-partners` 1"),
            (entry(""), "0 partners, expected 1 to 100"),
            (entry(&many), "101 partners"),
            (entry(r#"{"name":"a"}"#), "`a` has no `partner` and no `person`"),
            (
                entry(r#"{"name":"a","partner":"rules"}"#),
                "`a` has the partner `rules` and no `person`, so it is the ordinary partner",
            ),
            (entry(r#"{"name":"a/b","partner":"slow"}"#), "letters, digits"),
            (entry(r#"{"name":"","partner":"slow"}"#), "letters, digits"),
            (entry(r#"{"name":"rules","partner":"slow"}"#), "the ordinary partner"),
            (entry(r#"{"name":"a","partner":"habits:noise=900"}"#), "from 0 to 100"),
            (entry(r#"{"name":"a","person":"+ogre"}"#), "unknown kind of person `+ogre`"),
            (entry(r#"{"name":"a","partner":"slow","mood":"bad"}"#), "unknown field `mood`"),
            (
                entry(r#"{"name":"a","partner":"slow"},{"name":"A","partner":"noisy"}"#),
                "two partners have the name",
            ),
        ] {
            let error = PartnerSuite::parse(text.as_bytes(), "p.json").expect_err(&text);
            let error = error.to_string();
            assert!(error.starts_with("p.json: ") && error.contains(words), "{error}");
            assert!(!error.contains('\n'), "{error}");
        }
    }
}
