//! Check of a participant's records against the plan, in the order in which they were written.

use std::collections::{BTreeMap, BTreeSet};

use crate::data::DataRecord;
use crate::plan::{StudyPlan, Trial, short_digest};

/// State of a check after some records. It holds no traces and no ratings.
#[derive(Clone, Debug)]
pub struct RecordCheck {
    slot: u32,
    trials: Vec<Trial>,
    /// Trials that have begun; true while they run.
    running: BTreeMap<usize, bool>,
    /// Position and name of each answered form.
    answered: BTreeSet<(u32, String)>,
    is_complete: bool,
}

impl RecordCheck {
    /// Starts the check of a participant with the digest of a study and a slot.
    ///
    /// # Errors
    /// Returns the problem if the participant is one of another study, or the study has no such slot.
    pub fn new(plan: &StudyPlan, study: &str, slot: u32) -> Result<RecordCheck, String> {
        if study != plan.digest() {
            return Err(format!(
                "the data are of another study: digest {}, expected {}; use the study.toml and the \
                 version of chaic that built the page",
                short_digest(study),
                short_digest(plan.digest())
            ));
        }
        if !(1..=plan.study().participants).contains(&slot) {
            return Err(format!("no slot {slot}"));
        }
        Ok(RecordCheck {
            slot,
            trials: plan.trials(slot),
            running: BTreeMap::new(),
            answered: BTreeSet::new(),
            is_complete: false,
        })
    }

    /// Returns the trials of the slot.
    pub fn trials(&self) -> &[Trial] {
        &self.trials
    }

    /// Returns whether a trial runs; `None` if it has not begun.
    pub fn is_running(&self, trial: usize) -> Option<bool> {
        self.running.get(&trial).copied()
    }

    /// Returns whether the participant has finished: the last record is `complete`.
    pub fn is_complete(&self) -> bool {
        self.is_complete
    }

    /// Checks the next record.
    ///
    /// # Errors
    /// Returns the problem of the record.
    pub fn add(&mut self, plan: &StudyPlan, record: &DataRecord) -> Result<(), String> {
        if self.is_complete {
            return Err("a record after `complete`".to_owned());
        }
        match record {
            DataRecord::Start { .. } => return Err("a second `start`".to_owned()),
            DataRecord::Instructed {} => {}
            DataRecord::Complete {} => {
                let n_ended = self.running.values().filter(|is_running| !**is_running).count();
                if n_ended < self.trials.len() {
                    let n = self.trials.len();
                    return Err(format!("`complete` after {n_ended} of {n} trials"));
                }
            }
            DataRecord::Trial { trial } => {
                if *trial >= self.trials.len() {
                    return Err(format!("slot {} has no trial {trial}", self.slot));
                }
                if self.running.contains_key(trial) {
                    return Err(format!("trial {trial} begins twice"));
                }
                if let Some((running, _)) = self.running.iter().find(|(_, is_running)| **is_running)
                {
                    return Err(format!("trial {trial} begins while trial {running} runs"));
                }
                if *trial != self.running.len() {
                    return Err(format!(
                        "trial {trial} begins before trial {}",
                        self.running.len()
                    ));
                }
                self.running.insert(*trial, true);
            }
            DataRecord::Trace { trial, .. } => {
                self.running(*trial)?;
            }
            DataRecord::TrialEnd { trial, .. } => *self.running(*trial)? = false,
            DataRecord::Answers { position, form, ratings } => {
                self.check_answers(plan, *position, form, ratings)?;
                self.answered.insert((*position, form.clone()));
            }
        }
        self.is_complete = matches!(record, DataRecord::Complete {});
        Ok(())
    }

    /// Returns the state of a trial that has begun and not ended.
    fn running(&mut self, trial: usize) -> Result<&mut bool, String> {
        let found = self.running.get_mut(&trial).filter(|is_running| **is_running);
        found.ok_or_else(|| format!("trial {trial} is not running"))
    }

    fn check_answers(
        &self,
        plan: &StudyPlan,
        position: u32,
        name: &str,
        ratings: &BTreeMap<String, Option<i32>>,
    ) -> Result<(), String> {
        let forms = &plan.study().forms;
        let due = if position == 0 { &forms.at_end } else { &forms.after_condition };
        let n_positions = self.trials.last().map_or(0, |trial| trial.position);
        let form = plan.forms().into_iter().find(|(known, _)| *known == name);
        let Some((_, form)) = form.filter(|_| due.iter().any(|due| due == name)) else {
            return Err(format!("no form `{name}` is due there"));
        };
        let is_repeated = self.answered.contains(&(position, name.to_owned()));
        if position > n_positions || is_repeated {
            return Err(format!("the form `{name}` is not due at position {position}"));
        }
        let items: BTreeSet<&String> = form.items.iter().map(|item| &item.id).collect();
        if ratings.keys().collect::<BTreeSet<_>>() != items {
            return Err(format!("the answers are not those of the form `{name}`"));
        }
        match ratings.values().flatten().find(|rating| !form.has_rating(**rating)) {
            Some(rating) => Err(format!("the form `{name}` has no rating {rating}")),
            None => Ok(()),
        }
    }
}
