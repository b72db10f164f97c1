//! What rows are called: a helper's name never stands without what it is granted.

use std::collections::BTreeMap;

use chaic_agents::HelperInfo;
use chaic_agents::partners::PARTNER_GRANTS;
use chaic_core::observation::Grants;
use chaic_env::minds::NONE;
use serde::Serialize;

use crate::run::RunGrants;

/// Longest line of a row's name in a terminal, characters: tables stay within 120.
const MAX_LINE: usize = 21;

/// Names of rows, from what a run granted.
#[derive(Clone, Copy, Debug)]
pub struct Labels<'a> {
    /// `None` where nobody has recorded it.
    pub granted: Option<&'a RunGrants>,
}

/// What somebody is granted, as `scores.json` has it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct GrantsFile {
    /// The names of the grants.
    pub grants: Vec<String>,
    /// `ground_truth` where ids and classes of what is in the image are given, `own` where they have
    /// to be found in the image, `none` where there is nobody to perceive; or the name of what finds
    /// them.
    pub perception: String,
    /// How the helper's process is confined; absent for helpers within this process.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub isolation: Option<String>,
}

impl Labels<'_> {
    /// The helper's title with what it is granted, on one line.
    pub fn title(&self, helper: &str) -> String {
        match self.grants(helper) {
            Some(words) => format!("{} ({})", title(helper), words.join(", ")),
            None => title(helper),
        }
    }

    /// The same on lines that are short enough for the first column of a table.
    pub fn lines(&self, helper: &str) -> String {
        let mut lines = vec![title(helper)];
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

    /// What all these helpers are granted, and the partner where that is more than usual, as a
    /// sentence; nothing where there is nothing to say.
    pub fn sentence(&self, helpers: &[String]) -> Option<String> {
        let each = helpers
            .iter()
            .filter_map(|h| Some(format!("{}: {}", title(h), self.grants(h)?.join(", "))));
        let all: Vec<String> = each.chain(self.partner()).collect();
        (!all.is_empty()).then(|| format!("Granted: {}.", all.join("; ")))
    }

    /// Every helper of the run by name, with nobody for `none`, as `scores.json` has them.
    pub fn helpers_file(&self, helpers: &[String]) -> Option<BTreeMap<String, GrantsFile>> {
        let granted = self.granted?;
        let file = |name: &String| {
            let by = granted.perception.get(name);
            let grants = granted.helpers.get(name).map(|grants| GrantsFile::of(grants, by));
            let perception = "none".to_owned();
            let nobody = GrantsFile { grants: Vec::new(), perception, isolation: None };
            let isolation = granted.isolation.get(name).cloned();
            (name.clone(), GrantsFile { isolation, ..grants.unwrap_or(nobody) })
        };
        Some(helpers.iter().map(file).collect())
    }

    /// The partner's.
    pub fn partner_file(&self) -> Option<GrantsFile> {
        self.granted.map(|g| GrantsFile::of(&g.partner, None))
    }

    /// What a helper is granted, in words, kind by kind; `None` for nobody.
    fn grants(&self, helper: &str) -> Option<Vec<String>> {
        let unknown = || vec!["grants not recorded".to_owned()];
        let grants = self.granted.and_then(|g| g.helpers.get(helper));
        let by = self.granted.and_then(|g| g.perception.get(helper));
        let confined = self.granted.and_then(|g| g.isolation.get(helper));
        let confined = confined.map(|how| match how.as_str() {
            "trusted" => "trusted process".to_owned(),
            how => format!("process in a {how}"),
        });
        let words = |grants| words(grants, by.map(String::as_str));
        let all = || grants.map_or_else(unknown, words).into_iter().chain(confined).collect();
        (helper != NONE).then(all)
    }

    /// What the partner is granted beyond what every partner is.
    fn partner(&self) -> Option<String> {
        let usual = names(&PARTNER_GRANTS);
        let more: Vec<String> =
            names(&self.granted?.partner).into_iter().filter(|n| !usual.contains(n)).collect();
        (!more.is_empty()).then(|| format!("the partner is told more than usual: {}", told(&more)))
    }
}

/// What files call perception by ids from ground truth.
const GIVEN: &str = "ground_truth";

impl GrantsFile {
    fn of(grants: &Grants, by: Option<&String>) -> GrantsFile {
        let usual = if grants.ids { GIVEN } else { "own" };
        let perception = by.map_or_else(|| usual.to_owned(), String::clone);
        GrantsFile { grants: names(grants), perception, isolation: None }
    }
}

/// The names of what is granted, in alphabetical order.
fn names(grants: &Grants) -> Vec<String> {
    let given = grants.named().into_iter().filter(|(_, is_given)| *is_given);
    let mut names: Vec<String> = given.map(|(name, _)| name.to_owned()).collect();
    names.sort_unstable();
    names
}

fn words(grants: &Grants, by: Option<&str>) -> Vec<String> {
    let others = names(&Grants { ids: false, ..*grants });
    let ids = grants.ids.then(|| "ids from ground truth".to_owned());
    // The digits that name the weights are for files.
    let parts = by.into_iter().flat_map(|by| by.split(", ")).filter(|part| *part != GIVEN);
    let own = parts.map(|part| match part.strip_prefix("behavior ") {
        Some(behavior) => format!("{} behavior", behavior.split(' ').next().unwrap_or_default()),
        None => format!("{} perception", part.split(' ').next().unwrap_or_default()),
    });
    let others = (!others.is_empty()).then(|| format!("told {}", told(&others)));
    let all: Vec<String> = ids.into_iter().chain(own).chain(others).collect();
    if all.is_empty() { vec!["own eyes only".to_owned()] } else { all }
}

fn told(names: &[String]) -> String {
    names.iter().map(|n| n.replace('_', " ")).collect::<Vec<_>>().join(", ")
}

/// Titles of helpers that other crates make: a report knows names only.
const ELSEWHERE: [(&str, &str); 5] = [
    (NONE, "w/o"),
    // Without "BM": no behavior model of ours sees failures, as the paper's does.
    ("llm", "LLM"),
    ("llm-told", "LLM, told"),
    ("vlm", "VLM"),
    ("vlm-told", "VLM, told"),
];

/// What a table calls a helper.
pub fn title(helper: &str) -> String {
    let built_in = HelperInfo::named(helper).map(|info| info.title);
    let of_elsewhere =
        || ELSEWHERE.iter().find(|(name, _)| *name == helper).map(|(_, title)| *title);
    built_in.or_else(of_elsewhere).unwrap_or(helper).to_owned()
}
