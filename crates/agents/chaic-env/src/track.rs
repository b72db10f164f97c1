//! Tracks: bounds on the grants of the helpers of a run.
//!
//! A [`Track`] bounds grants, not names of helpers, so that it holds for helpers of every kind. A run
//! checks all its helpers before it begins and each helper again before an episode; `verify` checks
//! the grants in each trace.

use std::fmt;
use std::str::FromStr;

use chaic_core::observation::Grants;
use chaic_world::JointLift;
use serde::{Deserialize, Serialize};

use crate::rules::RuleSet;

/// Bounds on what the helpers of a run may know.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Track {
    /// Helpers may have any grant that they ask for.
    #[default]
    #[serde(alias = "told")]
    Unrestricted,
    /// Helpers perceive pixels and their own body; the goal place is the only grant.
    Hidden,
}

/// Bounds and requirements of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrackInfo {
    /// Name in commands and files.
    pub name: &'static str,
    /// Grants that a helper may have.
    pub allowed: Grants,
    /// Perception and behavior recognition that helpers must use, with or without a file of weights
    /// (`learned`, `learned:FILE`); `None` for any.
    pub perception: Option<&'static str>,
    /// True if rules are allowed that disclose information without a grant.
    pub allows_disclosing_rules: bool,
    /// True if helpers in other processes may run in a sandbox that lacks a part.
    pub allows_partial_sandbox: bool,
}

const UNRESTRICTED: TrackInfo = TrackInfo {
    name: "unrestricted",
    allowed: Grants::ALL,
    perception: None,
    allows_disclosing_rules: true,
    allows_partial_sandbox: true,
};
const HIDDEN: TrackInfo = TrackInfo {
    name: "hidden",
    allowed: Grants { goal_place: true, ..Grants::NONE },
    perception: Some("learned"),
    allows_disclosing_rules: false,
    allows_partial_sandbox: false,
};

/// A rule by its name, and whether it discloses something in this rule set.
type DisclosingRule = (&'static str, fn(&RuleSet) -> bool);

/// Rules that disclose to helpers what they can neither see nor feel (docs/grants.md).
const DISCLOSING_RULES: [DisclosingRule; 4] = [
    // A briefing without containers means that the partner uses a wheelchair.
    ("world.containers_with_wheelchair", |rules| !rules.world.containers_with_wheelchair),
    // Helpers feel which piece of furniture the partner chooses, at any distance.
    ("world.joint_lift", |rules| rules.world.joint_lift == JointLift::LastChoice),
    ("world.announces_removed_obstacles", |rules| rules.world.announces_removed_obstacles),
    ("planner.knows_partner_behavior", |rules| rules.planner.knows_partner_behavior),
];

impl Track {
    /// All tracks.
    pub const ALL: [Track; 2] = [Track::Unrestricted, Track::Hidden];

    /// Returns what the track allows and requires.
    pub const fn info(self) -> &'static TrackInfo {
        match self {
            Track::Unrestricted => &UNRESTRICTED,
            Track::Hidden => &HIDDEN,
        }
    }

    /// Checks the grants of a helper of any kind.
    ///
    /// # Errors
    /// One line with the helper, the refused grants and the track.
    pub fn check_grants(self, helper: &str, grants: Grants) -> Result<(), String> {
        let TrackInfo { name, allowed, .. } = self.info();
        let refused = grants.names_beyond(*allowed);
        if refused.is_empty() {
            return Ok(());
        }
        Err(format!(
            "helper `{helper}` is granted {}, which the {name} track refuses (it allows {}); withdraw \
             these grants, or leave out the helper or --track {name}",
            refused.join(", "),
            allowed.names_beyond(Grants::NONE).join(", "),
        ))
    }

    /// Checks the confinement of a helper's process, as the agent records it: `sandbox`, `trusted`, or
    /// `sandbox without` the missing parts. `None` is a helper within this process.
    ///
    /// # Errors
    /// One line with the helper, what is missing and what to do.
    pub fn check_isolation(self, helper: &str, isolation: Option<&str>) -> Result<(), String> {
        let TrackInfo { name, allows_partial_sandbox, .. } = self.info();
        let partial = isolation.filter(|isolation| isolation.starts_with("sandbox without"));
        match partial.filter(|_| !allows_partial_sandbox) {
            None => Ok(()),
            Some(isolation) => Err(format!(
                "helper `{helper}` runs in a {isolation}, and the {name} track needs the whole sandbox; if \
                 you trust the helper, give --exec-trust"
            )),
        }
    }

    /// Checks the perception and behavior recognition of helpers, as `--perception` and
    /// `--behavior` name them; `None` is ground truth.
    ///
    /// # Errors
    /// One line with the option, its value and the track.
    pub fn check_perception(
        self,
        perception: Option<&str>,
        behavior: Option<&str>,
    ) -> Result<(), String> {
        let TrackInfo { name, perception: Some(required), .. } = self.info() else { return Ok(()) };
        for (option, given) in [("--perception", perception), ("--behavior", behavior)] {
            let kind = given.map(|given| given.split_once(':').map_or(given, |(kind, _)| kind));
            if kind != Some(required) {
                let given = given.unwrap_or("gt");
                return Err(format!(
                    "the {name} track needs {option} {required} or {required}:FILE, not {given}"
                ));
            }
        }
        Ok(())
    }

    /// Checks that no rule discloses to helpers what their grants don't give.
    ///
    /// # Errors
    /// One line with the rules, the track and what to set.
    pub fn check_rules(self, rules: &RuleSet) -> Result<(), String> {
        let TrackInfo { name, allows_disclosing_rules, .. } = self.info();
        let disclosing = DISCLOSING_RULES.iter().filter(|(_, discloses)| discloses(rules));
        let names: Vec<&str> = disclosing.map(|(name, _)| *name).collect();
        if *allows_disclosing_rules || names.is_empty() {
            return Ok(());
        }
        let settings: Vec<String> =
            names.iter().map(|rule| format!("--set {rule}=paper")).collect();
        Err(format!(
            "the {name} track refuses rules that disclose hidden state to helpers: {}; add {}, or use \
             --rules paper",
            names.join(", "),
            settings.join(" "),
        ))
    }

    /// Returns the perception or behavior recognition to use: the given one, or the one that the
    /// track requires.
    pub fn perception_or(self, given: Option<String>) -> Option<String> {
        given.or_else(|| self.info().perception.map(str::to_owned))
    }
}

impl fmt::Display for Track {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.info().name)
    }
}

impl FromStr for Track {
    type Err = String;

    fn from_str(text: &str) -> Result<Track, String> {
        let found = Track::ALL.into_iter().find(|track| track.info().name == text);
        found.ok_or_else(|| format!("unknown track `{text}`; write unrestricted or hidden"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hidden_track_refuses_each_grant_but_the_goal_place() {
        for (name, _) in Grants::NONE.named() {
            let grants = Grants::from_names([name]).unwrap();
            assert_eq!(Track::Unrestricted.check_grants("mine", grants), Ok(()));
            let checked = Track::Hidden.check_grants("mine", grants);
            if name == "goal_place" {
                assert_eq!(checked, Ok(()));
                continue;
            }
            let refused = checked.unwrap_err();
            for expected in ["`mine`", name, "hidden track", "allows goal_place"] {
                assert!(refused.contains(expected), "{expected}: {refused}");
            }
        }
        let refused = Track::Hidden.check_grants("mine", Grants::ALL).unwrap_err();
        let all = "ids, goal, progress, behavior, positions, task, state,";
        assert!(refused.contains(all), "{refused}");
    }

    #[test]
    fn the_hidden_track_needs_learned_perception_and_behavior() {
        let check = |perception, behavior| Track::Hidden.check_perception(perception, behavior);
        assert_eq!(check(Some("learned"), Some("learned:mine.safetensors")), Ok(()));
        for (perception, behavior) in
            [(None, Some("learned")), (Some("learned"), Some("gt")), (Some("learnedly"), None)]
        {
            assert!(check(perception, behavior).unwrap_err().contains("hidden track needs"));
        }
        assert_eq!(Track::Unrestricted.check_perception(None, None), Ok(()));
        assert_eq!(Track::Unrestricted.perception_or(None), None);
        assert_eq!(Track::Hidden.perception_or(None).as_deref(), Some("learned"));
        assert_eq!(Track::Hidden.perception_or(Some("mine".into())).as_deref(), Some("mine"));
    }

    #[test]
    fn rules_that_disclose_are_named_with_what_to_set() {
        assert_eq!(Track::Unrestricted.check_rules(&RuleSet::COMPAT), Ok(()));
        assert_eq!(Track::Hidden.check_rules(&RuleSet::PAPER), Ok(()));
        let refused = Track::Hidden.check_rules(&RuleSet::COMPAT).unwrap_err();
        let mut rules = RuleSet::COMPAT;
        for (name, _) in DISCLOSING_RULES {
            let setting = format!("{name}=paper");
            assert!(refused.contains(&format!("--set {setting}")), "{refused}");
            assert!(Track::Hidden.check_rules(&rules).unwrap_err().contains(name));
            rules = rules.with(&setting).unwrap();
        }
        assert_eq!(Track::Hidden.check_rules(&rules), Ok(()), "all named settings suffice");
    }

    #[test]
    fn the_hidden_track_needs_the_whole_sandbox_or_trust() {
        let partial = Some("sandbox without landlock");
        assert_eq!(Track::Unrestricted.check_isolation("mine", partial), Ok(()));
        for whole in [None, Some("sandbox"), Some("trusted")] {
            assert_eq!(Track::Hidden.check_isolation("mine", whole), Ok(()));
        }
        let refused = Track::Hidden.check_isolation("mine", partial).unwrap_err();
        assert!(
            refused.contains("without landlock") && refused.contains("--exec-trust"),
            "{refused}"
        );
    }

    #[test]
    fn a_track_is_read_as_it_is_written() {
        for track in Track::ALL {
            assert_eq!(track.to_string().parse(), Ok(track));
            assert_eq!(serde_json::to_value(track).unwrap(), track.info().name);
        }
        assert!("open".parse::<Track>().unwrap_err().contains("unrestricted or hidden"));
    }
}
