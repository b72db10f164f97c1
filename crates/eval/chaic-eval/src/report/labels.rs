//! Row labels: each helper's title is followed by its grants.

use std::collections::BTreeMap;

use chaic_agents::HelperInfo;
use chaic_agents::partners::PARTNER_GRANTS;
use chaic_core::observation::Grants;
use chaic_env::helper_registry::NONE;
use serde::Serialize;

use crate::run::RunGrants;

/// Maximum line length of a label in a terminal, characters; keeps tables within 120 columns.
const MAX_LINE: usize = 21;

/// Row labels from the grants of a run.
#[derive(Clone, Copy, Debug)]
pub struct Labels<'a> {
    /// Recorded grants; `None` if the run has none.
    pub granted: Option<&'a RunGrants>,
}

/// Grants of one agent, as in `scores.json`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RecordedGrants {
    /// Names of the grants.
    pub grants: Vec<String>,
    /// Source of ids and classes: `ground_truth` if granted, `own` if the agent infers them from
    /// images, `none` without helper, or the name of the perception model.
    pub perception: String,
    /// Isolation of the helper's process; absent for helpers in this process.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub isolation: Option<String>,
    /// Digest of the helper's weights; absent for helpers without trained weights.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weights: Option<String>,
}

impl Labels<'_> {
    /// Returns the helper's title, with "+BM" for language helpers with a behavior network, as the
    /// paper names them.
    pub fn name(&self, helper: &str) -> String {
        let is_behavior = |part: &str| part.starts_with("behavior ");
        let perception = self.granted.and_then(|granted| granted.perception.get(helper));
        let has_network = perception.is_some_and(|text| text.split(", ").any(is_behavior));
        let is_language = ["llm", "vlm"].contains(&helper);
        if has_network && is_language { title(helper) + "+BM" } else { title(helper) }
    }

    /// Returns the helper's title and grants on one line.
    pub fn title(&self, helper: &str) -> String {
        match self.grants(helper) {
            Some(words) => format!("{} ({})", self.name(helper), words.join(", ")),
            None => self.name(helper),
        }
    }

    /// Returns the label on several lines, each short enough for the first column of a table.
    pub fn lines(&self, helper: &str) -> String {
        let mut lines = vec![self.name(helper)];
        for words in self.grants(helper).unwrap_or_default() {
            let mut line = String::new();
            for word in words.split(' ') {
                if !line.is_empty() && line.len() + 1 + word.len() > MAX_LINE {
                    lines.push(std::mem::take(&mut line));
                }
                line += if line.is_empty() { "" } else { " " };
                line += word;
            }
            lines.push(line);
        }
        lines.join("\n")
    }

    /// Returns a sentence with the grants of these helpers, and of the partner if it has more than
    /// the default; `None` if there is nothing to report.
    pub fn sentence(&self, helpers: &[String]) -> Option<String> {
        let each = helpers
            .iter()
            .filter_map(|h| Some(format!("{}: {}", self.name(h), self.grants(h)?.join(", "))));
        let all: Vec<String> = each.chain(self.partner()).collect();
        (!all.is_empty()).then(|| format!("Granted: {}.", all.join("; ")))
    }

    /// Returns the grants of all helpers of the run by name, as in `scores.json`; `none` has no
    /// grants.
    pub fn helper_grants(&self, helpers: &[String]) -> Option<BTreeMap<String, RecordedGrants>> {
        let granted = self.granted?;
        let file = |name: &String| {
            let perception = granted.perception.get(name);
            let grants =
                granted.helpers.get(name).map(|grants| RecordedGrants::new(grants, perception));
            let none = || RecordedGrants {
                grants: Vec::new(),
                perception: "none".to_owned(),
                isolation: None,
                weights: None,
            };
            let isolation = granted.isolation.get(name).cloned();
            let weights = granted.weights.get(name).cloned();
            (name.clone(), RecordedGrants { isolation, weights, ..grants.unwrap_or_else(none) })
        };
        Some(helpers.iter().map(file).collect())
    }

    /// Returns the grants of the partner, as in `scores.json`.
    pub fn partner_grants(&self) -> Option<RecordedGrants> {
        self.granted.map(|g| RecordedGrants::new(&g.partner, None))
    }

    /// Returns the grants of a helper in words; `None` for `none`.
    fn grants(&self, helper: &str) -> Option<Vec<String>> {
        let unknown = || vec!["grants not recorded".to_owned()];
        let grants = self.granted.and_then(|g| g.helpers.get(helper));
        let perception = self.granted.and_then(|g| g.perception.get(helper));
        let isolation = self.granted.and_then(|g| g.isolation.get(helper));
        let isolation = isolation.map(|kind| match kind.as_str() {
            "trusted" => "trusted process".to_owned(),
            kind => format!("process in a {kind}"),
        });
        let describe = |grants| describe(grants, perception.map(String::as_str));
        let all = || grants.map_or_else(unknown, describe).into_iter().chain(isolation).collect();
        (helper != NONE).then(all)
    }

    /// Returns the partner's grants beyond the default ones in words.
    fn partner(&self) -> Option<String> {
        let default = names(&PARTNER_GRANTS);
        let more: Vec<String> =
            names(&self.granted?.partner).into_iter().filter(|n| !default.contains(n)).collect();
        (!more.is_empty())
            .then(|| format!("additional grants of the partner: {}", readable_names(&more)))
    }
}

/// Name of perception by ground-truth ids in files.
const GROUND_TRUTH: &str = "ground_truth";

impl RecordedGrants {
    fn new(grants: &Grants, perception: Option<&String>) -> RecordedGrants {
        let default = if grants.ids { GROUND_TRUTH } else { "own" };
        let perception = perception.map_or_else(|| default.to_owned(), String::clone);
        RecordedGrants { grants: names(grants), perception, isolation: None, weights: None }
    }
}

/// Returns the names of the grants in alphabetical order.
fn names(grants: &Grants) -> Vec<String> {
    let granted = grants.named().into_iter().filter(|(_, is_granted)| *is_granted);
    let mut names: Vec<String> = granted.map(|(name, _)| name.to_owned()).collect();
    names.sort_unstable();
    names
}

fn describe(grants: &Grants, perception: Option<&str>) -> Vec<String> {
    let other_grants = names(&Grants { ids: false, ..*grants });
    let ids = grants.ids.then(|| "ids from ground truth".to_owned());
    // The digest that names the weights is only for files.
    let parts = perception
        .into_iter()
        .flat_map(|text| text.split(", "))
        .filter(|part| *part != GROUND_TRUTH);
    let own = parts.map(|part| match part.strip_prefix("behavior ") {
        Some(behavior) => format!("{} behavior", behavior.split(' ').next().unwrap_or_default()),
        None => format!("{} perception", part.split(' ').next().unwrap_or_default()),
    });
    let other_grants =
        (!other_grants.is_empty()).then(|| format!("granted {}", readable_names(&other_grants)));
    let all: Vec<String> = ids.into_iter().chain(own).chain(other_grants).collect();
    if all.is_empty() { vec!["no grants".to_owned()] } else { all }
}

fn readable_names(names: &[String]) -> String {
    names.iter().map(|n| n.replace('_', " ")).collect::<Vec<_>>().join(", ")
}

/// Titles of helpers that other crates register.
const EXTERNAL_TITLES: [(&str, &str); 10] = [
    (NONE, "w/o"),
    ("cloned", "Cloned"),
    ("rl", "RL"),
    ("rl_paper", "RL from images"),
    ("smart_help", "Smart-Help"),
    ("smart_help_plus", "Smart-Help+"),
    ("llm", "LLM"),
    ("llm_known_task", "LLM, known task"),
    ("vlm", "VLM"),
    ("vlm_known_task", "VLM, known task"),
];

/// Returns the title of a helper in tables.
pub fn title(helper: &str) -> String {
    let built_in = HelperInfo::find_helper(helper).map(|info| info.title);
    let external =
        || EXTERNAL_TITLES.iter().find(|(name, _)| *name == helper).map(|(_, title)| *title);
    built_in.or_else(external).unwrap_or(helper).to_owned()
}
