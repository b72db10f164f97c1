//! Promise: with everything known, the forward model of the team planner predicts at the start of
//! an episode how much the real partner delivers.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

use chaic_agents::decision::{Context, Plan, Policy};
use chaic_agents::team::builder::{PartnerModel, ProblemBuilder};
use chaic_agents::team::simulation::{SimulatedEvent, timeline};
use chaic_agents::{PlannerRules, PlanningAgent};
use chaic_core::briefing::CompanionRole;
use chaic_core::geom::to_xz;
use chaic_core::observation::Grants;
use chaic_core::{AgentError, Briefing, TaskId};
use chaic_env::helper_registry::Helper;
use chaic_env::trace::Record;
use chaic_env::{Env, EpisodeAgents, EpisodeConfig};
use chaic_episodes::find_episode;

/// Tasks whose partner works alone without a helper.
const TASKS: [&str; 6] =
    ["no_constraint", "high_target", "high_container", "high_goal", "low_target", "shopping"];
/// Episodes of `gen-standard`, outside those on which the model was tuned.
const SEEDS: std::ops::Range<u64> = 7600..7604;

/// Predicts the partner's deliveries at the first decision and then waits.
struct ForecastPolicy {
    predicted: Arc<Mutex<Option<f64>>>,
}

impl Policy for ForecastPolicy {
    fn reset(&mut self, _: &Briefing) {}

    fn choose(&mut self, context: &Context<'_>, _: &[Plan]) -> Result<Plan, AgentError> {
        let mut predicted = self.predicted.lock().expect("one thread at a time");
        if predicted.is_none() {
            *predicted = predict(context);
        }
        Ok(Plan::Wait)
    }
}

/// Returns the number of deliveries that count until the end; `None` if the model lacks something.
fn predict(context: &Context<'_>) -> Option<f64> {
    let (briefing, memory) = (context.briefing, context.memory);
    let partner = memory.companion(briefing, CompanionRole::Partner)?;
    let position = to_xz(partner.position_in_world);
    let goal = briefing.goal.as_ref()?;
    let wanted: BTreeMap<_, _> = goal.targets.iter().map(|(c, n)| (*c, *n as f32)).collect();
    let model = PartnerModel {
        capability: briefing.disclosure?.partner.capability(),
        position: Some(position),
        holds: Vec::new(),
        goals: vec![(1.0, wanted)],
    };
    let mut builder = ProblemBuilder::default();
    builder.observe_partner(memory, position);
    let problem = builder.build(briefing, memory, &model)?;
    let counts = timeline(&problem, &[], 0).into_iter().map(|event| match event {
        SimulatedEvent::Delivery(delivery) => f64::from(delivery.count),
        SimulatedEvent::Arrival { .. } => 0.0,
    });
    Some(counts.sum())
}

/// Plays an episode; returns the predicted and the real transport rate.
fn play(id: &str) -> [f64; 2] {
    let episode = find_episode(id).expect("every seed has an episode");
    let predicted = Arc::new(Mutex::new(None));
    let policy = ForecastPolicy { predicted: predicted.clone() };
    let agent = Box::new(PlanningAgent::new(policy, PlannerRules::paper()));
    let helper = Some(Helper { agent, grants: Grants::ALL });
    let config = EpisodeConfig { image_size: Some(128), ..EpisodeConfig::new(&episode, "mine") };
    let mut env = Env::new(config, EpisodeAgents::new(helper, None)).expect("playable");
    let mut sink = |_: &Record| Ok::<(), AgentError>(());
    env.run(&AtomicBool::new(false), None, &mut sink).expect("the sink takes all");
    let score = env.score();
    let predicted = predicted.lock().expect("the episode is over").expect("a forecast");
    [predicted, score.done].map(|n| n / score.total)
}

#[test]
fn the_forward_model_predicts_the_deliveries_of_the_real_partner() {
    let ids = TASKS.iter().flat_map(|task| {
        let task: TaskId = task.parse().expect("a task");
        SEEDS.map(move |seed| format!("{task}/gen-standard/{seed}"))
    });
    let pairs: Vec<(String, [f64; 2])> = ids.map(|id| (id.clone(), play(&id))).collect();
    for (id, [predicted, real]) in &pairs {
        println!("{id} {predicted:.2} {real:.2}");
    }
    let n = pairs.len() as f64;
    let mean = |f: fn(&[f64; 2]) -> f64| pairs.iter().map(|(_, pair)| f(pair)).sum::<f64>() / n;
    let (bias, error) = (mean(|[p, r]| p - r), mean(|[p, r]| (p - r).abs()));
    println!("predicted {:.3}, real {:.3}, error {error:.3}", mean(|p| p[0]), mean(|p| p[1]));
    assert!(bias.abs() < 0.1 && error < 0.2, "bias {bias}, mean absolute error {error}");
}
