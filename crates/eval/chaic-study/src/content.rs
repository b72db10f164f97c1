//! The content of a study's page as JSON. `web/src/study.ts` reads it.

use chaic_env::CHAIC_VERSION;
use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};

use crate::data;
use crate::plan::{SEED, StudyPlan, Trial, hex};
use crate::study::{PlaySettings, Seat, Simulator};

/// Returns the content of the page of a study. If the simulator runs on the server, neither episodes nor goals
/// follow from it. The page then has no episodes, no names of conditions and no digest of them.
pub fn page_content(plan: &StudyPlan) -> Value {
    let mut content = full_content(plan);
    if plan.study().play.simulator == Simulator::Server {
        // The order of conditions follows from the digest of the study, so conditions that look equal are merged.
        let mut kinds: Vec<Value> = Vec::new();
        let mut kind_of = Vec::new();
        for condition in plan.conditions() {
            let kind = json!({ "seat": condition.seat, "input": condition.input });
            let found = kinds.iter().position(|known| *known == kind);
            kind_of.push(found.unwrap_or(kinds.len()));
            if found.is_none() {
                kinds.push(kind);
            }
        }
        let rows = (1..=plan.study().participants).map(|slot| {
            let trials = plan.trials(slot).into_iter();
            let row = |trial: Trial| json!([trial.position, kind_of[trial.condition]]);
            trials.map(row).collect::<Value>()
        });
        content["slots"] = rows.collect();
        content["conditions"] = json!(kinds);
        let PlaySettings { world, speed, simulator, .. } = &plan.study().play;
        content["play"] = json!({ "world": world, "speed": speed, "simulator": simulator });
        content["episodes"] = json!([]);
        // The digest of the study would confirm a guess of its episodes.
        content["digest"] = Value::Null;
        content["digest"] = json!(hex(&Sha256::digest(content.to_string())));
    }
    content
}

/// Returns the content of a page that runs the simulator.
fn full_content(plan: &StudyPlan) -> Value {
    let study = plan.study();
    let forms: serde_json::Map<String, Value> =
        plan.forms().into_iter().map(|(name, form)| (name.to_owned(), json!(form))).collect();
    let slots: Vec<Value> = (1..=study.participants).map(|slot| slot_trials(plan, slot)).collect();
    let episodes: Vec<String> =
        plan.episodes().iter().map(chaic_episodes::Episode::to_json_line).collect();
    json!({
        "format": data::FORMAT,
        "version": data::VERSION,
        "chaic": CHAIC_VERSION,
        "digest": plan.digest(),
        "title": study.title,
        "consent": study.consent,
        "instructions": study.instructions,
        "debrief": study.debrief,
        "completion_code": study.completion_code,
        "play": study.play,
        "forms": forms,
        "after_condition": study.forms.after_condition,
        "at_end": study.forms.at_end,
        "conditions": plan.conditions(),
        "seed": SEED,
        "slots": slots,
        "episodes": episodes,
    })
}

/// Returns the trials of a slot, each as position, condition, episode and helper.
fn slot_trials(plan: &StudyPlan, slot: u32) -> Value {
    let row = |trial: Trial| {
        let is_helper = plan.conditions()[trial.condition].seat == Seat::Helper;
        let helper = if is_helper { chaic_env::helper_registry::NONE } else { plan.helper(trial) };
        json!([trial.position, trial.condition, trial.episode, helper])
    };
    plan.trials(slot).into_iter().map(row).collect()
}
