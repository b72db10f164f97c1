//! The plan of a study: its conditions, episodes and digest, and the trials of each slot.

use std::collections::BTreeSet;

use chaic_core::FRAMES_PER_SECOND;
use chaic_env::RunKey;
use chaic_episodes::{Episode, SplitError, find_episode};
use serde::Serialize;
use sha2::{Digest as _, Sha256};

use crate::assignment::Assignment;
use crate::error::Result;
use crate::forms::Questionnaire;
use crate::study::{Design, Input, PERSON, Seat, Study};

/// Maximum number of conditions of a Latin square, which every participant plays.
const MAX_WITHIN: usize = 16;
/// Maximum number of conditions between participants.
const MAX_BETWEEN: usize = 64;
/// Maximum number of different episodes, which bounds the size of the page.
const MAX_RESOLVED: usize = 200;
/// Seed of every episode, so that all participants play the same one.
pub const SEED: u32 = 0;
/// Reading speed of the estimated length, words per minute.
const WORDS_PER_MINUTE: f64 = 200.0;
/// Time for an item of a form in the estimated length, seconds.
const ITEM_SECS: f64 = 6.0;

/// Number of digits of a digest in messages and names.
const SHORT_DIGITS: usize = 8;

/// Problem with the keys of `study.toml`.
type Problem = String;
/// Result of a lookup of episodes.
type LookupResult<T> = std::result::Result<T, SplitError>;

/// A combination of factor levels.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Condition {
    /// Levels as `factor=level`, separated by spaces; `all` without factors.
    pub name: String,
    /// Names of the factors with their levels.
    pub levels: Vec<(&'static str, String)>,
    /// Agent that the person controls.
    pub seat: Seat,
    /// Helper beside a person who plays the partner.
    pub helper: String,
    /// Level of the decisions.
    pub input: Input,
    /// Indices of the episodes in [`StudyPlan::episodes`].
    #[serde(skip)]
    pub episodes: Vec<usize>,
}

/// An episode that a participant plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trial {
    /// Position of the condition, from 1; 0 for practice.
    pub position: u32,
    /// Index of the condition. Practice has the first one, without its helper.
    pub condition: usize,
    /// Index of the episode in [`StudyPlan::episodes`].
    pub episode: usize,
}

/// A study with its episodes.
#[derive(Clone, Debug)]
pub struct StudyPlan {
    study: Study,
    conditions: Vec<Condition>,
    episodes: Vec<Episode>,
    practice: Vec<usize>,
    digest: String,
    assignment: Assignment,
}

impl StudyPlan {
    /// Plans a study.
    ///
    /// # Errors
    /// [`crate::StudyError`] if an episode does not exist, or `path` names too many conditions or too few
    /// episodes.
    pub fn new(study: Study, path: &std::path::Path) -> Result<StudyPlan> {
        let wrong =
            |problem: Problem| crate::StudyError::Definition { path: path.to_owned(), problem };
        let no_episode = |problem| crate::StudyError::Episode { path: path.to_owned(), problem };
        let mut conditions = conditions(&study);
        let max = match study.design {
            Design::LatinSquare => MAX_WITHIN,
            Design::BlockRandom => MAX_BETWEEN,
        };
        if conditions.len() > max {
            return Err(wrong(format!(
                "`factors` give {} conditions; this design has at most {max}",
                conditions.len()
            )));
        }
        if let Some(id) = repeated_house(&study).map_err(no_episode)? {
            return Err(wrong(format!("`practice` and `episodes` have the house of `{id}` twice")));
        }
        let mut pool = EpisodePool::default();
        let practice = study.practice.iter().map(|id| pool.add(id.clone()));
        let practice = practice.collect::<LookupResult<Vec<usize>>>().map_err(no_episode)?;
        for condition in &mut conditions {
            condition.episodes = pool.of_condition(&study, condition).map_err(no_episode)?;
            if pool.episodes.len() > MAX_RESOLVED {
                let text = "`episodes` and `factors.person` give more than";
                return Err(wrong(format!("{text} {MAX_RESOLVED} different episodes")));
            }
        }
        if let Some(problem) = too_few(&study, &conditions) {
            return Err(wrong(problem));
        }
        let digest = digest(&study, &pool.episodes);
        let seed = u64::from_str_radix(&digest[..16], 16).expect("hexadecimal digits");
        let assignment = Assignment::new(study.design, conditions.len(), seed);
        Ok(StudyPlan { study, conditions, episodes: pool.episodes, practice, digest, assignment })
    }

    /// Returns the definition of the study.
    pub fn study(&self) -> &Study {
        &self.study
    }

    /// Returns the conditions.
    pub fn conditions(&self) -> &[Condition] {
        &self.conditions
    }

    /// Returns the names of the helpers beside persons who play the partner, each once.
    pub fn helpers(&self) -> BTreeSet<&str> {
        let beside = self.conditions.iter().filter(|condition| condition.seat == Seat::Partner);
        beside.map(|condition| condition.helper.as_str()).collect()
    }

    /// Returns all episodes of practice and conditions.
    pub fn episodes(&self) -> &[Episode] {
        &self.episodes
    }

    /// Returns the SHA-256 of definition and episodes, as 64 hexadecimal digits.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// Returns the seed of all random draws: the first 8 bytes of the digest.
    pub fn seed(&self) -> u64 {
        u64::from_str_radix(&self.digest[..16], 16).expect("hexadecimal digits")
    }

    /// Returns the assignment of slots to orders.
    pub fn assignment(&self) -> &Assignment {
        &self.assignment
    }

    /// Returns the trials of a slot: practice, then the conditions in their order.
    ///
    /// The episodes of a condition rotate with each complete block of slots, so that every condition meets
    /// every episode. No participant plays an episode twice.
    pub fn trials(&self, slot: u32) -> Vec<Trial> {
        // Practice has the seat and the input of the first condition.
        let first = self.assignment.order(slot)[0];
        let practice = self.practice.iter();
        let mut trials: Vec<Trial> = practice
            .map(|episode| Trial { position: 0, condition: first, episode: *episode })
            .collect();
        let block = self.assignment.block(slot);
        let mut uses: Vec<(Vec<usize>, usize)> = Vec::new();
        for (position, condition) in (1..).zip(self.assignment.order(slot)) {
            let pool = &self.conditions[*condition].episodes;
            // Persons differ, but the house is the same: pools of one task count as one.
            let key = self.base_of(*condition);
            let found = uses.iter().position(|(known, _)| *known == key);
            let k = found.unwrap_or_else(|| {
                uses.push((key, 0));
                uses.len() - 1
            });
            for _ in 0..self.study.trials {
                let episode = pool[(block + uses[k].1) % pool.len()];
                uses[k].1 += 1;
                trials.push(Trial { position, condition: *condition, episode });
            }
        }
        trials
    }

    /// Returns the indices of the listed episodes of a condition.
    fn base_of(&self, condition: usize) -> Vec<usize> {
        listed(&self.study, &self.conditions[condition])
    }

    /// Returns the key of the trace of a trial.
    pub fn key(&self, trial: Trial) -> RunKey {
        let episode = &self.episodes[trial.episode];
        RunKey {
            task: episode.task(),
            helper: self.helper(trial).to_owned(),
            episode: episode.id().to_owned(),
            seed: SEED,
        }
    }

    /// Returns the name of the helper in the trace of a trial: the person's, or that of the helper beside
    /// them. Practice has no helper.
    pub fn helper(&self, trial: Trial) -> &str {
        let condition = &self.conditions[trial.condition];
        match condition.seat {
            Seat::Helper => PERSON,
            Seat::Partner if trial.position == 0 => chaic_env::helper_registry::NONE,
            Seat::Partner => &condition.helper,
        }
    }

    /// Returns the forms that the study uses, with their names.
    pub fn forms(&self) -> Vec<(&str, Questionnaire)> {
        let names = self.study.form_names().into_iter();
        names
            .map(|name| {
                (name, Questionnaire::standard(name).expect("checked when the study was read"))
            })
            .collect()
    }

    /// Returns the shortest length of a participation with complete episodes, minutes: reading, the world's
    /// time and forms. A world that waits takes longer.
    pub fn length_minutes(&self) -> f64 {
        let Study { consent, instructions, debrief, play, forms, .. } = &self.study;
        let words: usize = [consent, instructions, debrief]
            .iter()
            .map(|text| text.split_whitespace().count())
            .sum();
        let trials = self.trials(1);
        let horizon = |trial: &Trial| f64::from(self.episodes[trial.episode].setup().horizon);
        let frames: f64 = trials.iter().map(horizon).sum();
        let n_positions = trials.last().map_or(0, |trial| trial.position);
        let n_items = |names: &[String]| -> f64 {
            let forms = names.iter().filter_map(|name| Questionnaire::standard(name));
            forms.map(|form| form.items.len() as f64).sum()
        };
        let items =
            n_items(&forms.after_condition) * f64::from(n_positions) + n_items(&forms.at_end);
        let played_secs = frames / f64::from(FRAMES_PER_SECOND) / f64::from(play.speed);
        words as f64 / WORDS_PER_MINUTE + (played_secs + items * ITEM_SECS) / 60.0
    }
}

/// Returns the first listed episode that has the house of an earlier one.
fn repeated_house(study: &Study) -> LookupResult<Option<String>> {
    let mut houses = BTreeSet::new();
    for id in study.practice.iter().chain(&study.episodes) {
        let episode = find_episode(id)?;
        // Without the person of TASK/SPLIT/NUMBER/PERSON.
        let house: Vec<&str> = episode.id().split('/').take(3).collect();
        if !houses.insert(house.join("/")) {
            return Ok(Some(id.clone()));
        }
    }
    Ok(None)
}

/// Episodes that were looked up, each once.
#[derive(Default)]
struct EpisodePool {
    episodes: Vec<Episode>,
}

impl EpisodePool {
    /// Returns the index of the episode with an id.
    fn add(&mut self, id: String) -> LookupResult<usize> {
        if let Some(found) = self.episodes.iter().position(|episode| episode.id() == id) {
            return Ok(found);
        }
        // Numbers have several forms, as in `gen/5` and `gen/05`.
        let episode = find_episode(&id)?;
        if let Some(found) = self.episodes.iter().position(|known| known.id() == episode.id()) {
            return Ok(found);
        }
        self.episodes.push(episode);
        Ok(self.episodes.len() - 1)
    }

    /// Returns the indices of the episodes of a condition.
    fn of_condition(&mut self, study: &Study, condition: &Condition) -> LookupResult<Vec<usize>> {
        let person = condition.levels.iter().find(|(factor, _)| *factor == "person");
        let suffix = person.map_or(String::new(), |(_, level)| format!("/{level}"));
        let listed = listed(study, condition).into_iter();
        listed.map(|k| self.add(format!("{}{suffix}", study.episodes[k]))).collect()
    }
}

/// Returns the indices of the listed episodes that a condition selects by its task.
fn listed(study: &Study, condition: &Condition) -> Vec<usize> {
    let task = condition.levels.iter().find(|(factor, _)| *factor == "task");
    let is_selected = |id: &str| {
        task.is_none_or(|(_, task)| {
            id.strip_prefix(task.as_str()).is_some_and(|rest| rest.starts_with('/'))
        })
    };
    (0..study.episodes.len()).filter(|k| is_selected(&study.episodes[*k])).collect()
}

/// Returns all combinations of factor levels.
fn conditions(study: &Study) -> Vec<Condition> {
    let factors = &study.factors;
    let all: [(&'static str, Vec<String>); 5] = [
        ("helper", factors.helper.clone()),
        ("task", factors.task.iter().map(ToString::to_string).collect()),
        ("person", factors.person.iter().map(ToString::to_string).collect()),
        ("seat", factors.seat.iter().map(|seat| seat.name().to_owned()).collect()),
        ("input", factors.input.iter().map(|input| input.name().to_owned()).collect()),
    ];
    let mut combined: Vec<Vec<(&'static str, usize, String)>> = vec![Vec::new()];
    for (factor, levels) in all.into_iter().filter(|(_, levels)| !levels.is_empty()) {
        let extended = combined.iter().flat_map(|before| {
            levels.iter().enumerate().map(|(k, level)| {
                let mut after = before.clone();
                after.push((factor, k, level.clone()));
                after
            })
        });
        combined = extended.collect();
    }
    combined.into_iter().map(|levels| condition(study, &levels)).collect()
}

/// Creates the condition with these levels: factor, index of the level, and its name.
fn condition(study: &Study, chosen: &[(&'static str, usize, String)]) -> Condition {
    let index = |factor: &str| chosen.iter().find(|(name, ..)| *name == factor).map(|(_, k, _)| *k);
    let factors = &study.factors;
    let names: Vec<String> =
        chosen.iter().map(|(factor, _, level)| format!("{factor}={level}")).collect();
    Condition {
        name: if names.is_empty() { "all".to_owned() } else { names.join(" ") },
        seat: index("seat").map_or(study.play.seat, |k| factors.seat[k]),
        helper: index("helper").map_or(study.play.helper.clone(), |k| factors.helper[k].clone()),
        input: index("input").map_or(study.play.input, |k| factors.input[k]),
        levels: chosen.iter().map(|(factor, _, level)| (*factor, level.clone())).collect(),
        episodes: Vec::new(),
    }
}

/// Returns a problem if a participant would play an episode twice.
fn too_few(study: &Study, conditions: &[Condition]) -> Option<Problem> {
    for condition in conditions {
        let pool = listed(study, condition);
        let n_sharing = match study.design {
            Design::LatinSquare => conditions.iter().filter(|c| listed(study, c) == pool).count(),
            Design::BlockRandom => 1,
        };
        let needed = n_sharing * study.trials as usize;
        if pool.len() < needed {
            return Some(format!(
                "`episodes` has {} for the condition `{}`, but a participant plays {needed} of them; \
                 list more, so that none is played twice",
                pool.len(),
                condition.name
            ));
        }
    }
    None
}

/// Returns the SHA-256 of definition and episodes.
fn digest(study: &Study, episodes: &[Episode]) -> String {
    let mut hash = Sha256::new();
    hash.update(serde_json::to_vec(study).expect("a study has string keys"));
    for episode in episodes {
        hash.update("\n");
        hash.update(episode.to_json_line());
    }
    hex(&hash.finalize())
}

/// Returns bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Returns the first digits of a digest.
pub(crate) fn short_digest(digest: &str) -> String {
    digest.chars().take(SHORT_DIGITS).collect()
}
