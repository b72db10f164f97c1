//! The content of a study's page as JSON. `web/src/study.ts` reads it.

use chaic_env::CHAIC_VERSION;
use serde_json::{Value, json};

use crate::data;
use crate::plan::{Plan, SEED, Trial};
use crate::study::Seat;

/// Returns the content of the page of a study.
pub fn page_content(plan: &Plan) -> Value {
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
fn slot_trials(plan: &Plan, slot: u32) -> Value {
    let row = |trial: Trial| {
        let is_helper = plan.conditions()[trial.condition].seat == Seat::Helper;
        let helper = if is_helper { chaic_env::helper_registry::NONE } else { plan.helper(trial) };
        json!([trial.position, trial.condition, trial.episode, helper])
    };
    plan.trials(slot).into_iter().map(row).collect()
}
