//! Promise: prompts are complete, reveal nothing hidden, and are short enough.

use std::sync::{Arc, Mutex};

use chaic_agents::decision::{Context, Plan, Policy};
use chaic_agents::perception_factory::GroundTruthPerceptionFactory;
use chaic_agents::{PlannerRules, PlanningAgent, partner_grants};
use chaic_core::observation::Grants;
use chaic_core::{AgentError, Briefing, TaskId};
use chaic_env::helper_registry::{Helper, built_in};
use chaic_env::{Env, EpisodeAgents, EpisodeConfig};
use chaic_episodes::find_episode;
use chaic_llm::LanguageHelpers;
use chaic_llm::prompt_context::{LIST_LIMITS, PersonFacts, PromptContext};
use chaic_llm::prompt_track::PromptTrack;
use chaic_llm::tokens;
use chaic_llm_standin::Options;

use crate::common::{Fixture, SIZE, decided, exchanges, flag, standin};

/// Maximum tokens of a prompt.
const LIMIT: usize = 4000;

/// Maximum count of two vocabularies.
fn tokens_of(text: &str) -> usize {
    let vocabularies = [tiktoken_rs::cl100k_base_singleton(), tiktoken_rs::o200k_base_singleton()];
    vocabularies.into_iter().map(|v| v.count_ordinary(text)).max().unwrap()
}

#[test]
fn prompts_fit_the_limit_until_the_end_of_long_episodes() {
    // Complete episodes in a house, in the street and of a move.
    let fixture = Fixture::new(&[TaskId::HighTarget, TaskId::Shopping, TaskId::MovingHouse], 3000);
    let (_standin, settings) = standin(Options::default());
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    assert!(fixture.play("run", &fixture.request(&["llm_known_task"]), &language).0);
    let mut n = 0;
    for record in fixture.records("run") {
        for exchange in exchanges(&record) {
            let text: Vec<&str> =
                exchange.request.messages.iter().map(|m| m.text.as_str()).collect();
            let text = text.join("\n");
            let (real, estimate) = (tokens_of(&text), tokens::estimate(&text));
            assert!(real <= LIMIT, "{real} tokens:\n{text}");
            assert!(estimate >= real, "{estimate} is less than {real}:\n{text}");
            assert!(estimate < real + real / 2, "{estimate} is much more than {real}");
            n += 1;
        }
        assert!(decided(&record).iter().all(|d| d.prompt_tokens.is_none_or(|t| t <= LIMIT)));
    }
    assert!(n > 30, "{n}");
}

#[test]
fn prompts_are_shortened_until_they_fit() {
    let fixture = Fixture::new(&[TaskId::Shopping], 1200);
    let mut lengths = Vec::new();
    for limit in [4000, 900] {
        let (_standin, mut settings) = standin(Options::default());
        settings.request.max_prompt_tokens = limit;
        let language = LanguageHelpers::live(settings, flag()).unwrap();
        let name = format!("run{limit}");
        assert!(fixture.play(&name, &fixture.request(&["llm"]), &language).0);
        let records = fixture.records(&name);
        let shortened = decided(&records[0]).iter().map(|d| d.shortened).max().unwrap();
        let longest = exchanges(&records[0])
            .iter()
            .map(|e| tokens_of(&e.request.messages[0].text))
            .max()
            .unwrap();
        assert!(longest < limit as usize, "{longest} tokens of {limit}");
        lengths.push((shortened, longest));
    }
    assert!(lengths[0].0 < lengths[1].0 && lengths[0].1 > lengths[1].1, "{lengths:?}");
}

#[test]
fn prompts_of_the_hidden_track_name_neither_task_nor_constraint_nor_goal() {
    let tasks: Vec<TaskId> = TaskId::paper().collect();
    let fixture = Fixture::new(&tasks, 100);
    let (_standin, settings) = standin(Options::default());
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    assert!(fixture.play("run", &fixture.request(&["llm", "llm_known_task"]), &language).0);
    let mut openings = Vec::new();
    for record in fixture.records("run") {
        let exchanges = exchanges(&record);
        let prompt = &exchanges[0].request.messages[0].text;
        let titles: Vec<&str> = prompt.lines().filter_map(|l| l.strip_prefix("## ")).collect();
        let six = ["Task", "Yourself", "The others", "Progress", "What is where", "Plans"];
        assert_eq!(titles, six);
        for expected in ["1. ", "explore", "turn around", "wait", "frames have passed"] {
            assert!(prompt.contains(expected), "{expected}: {prompt}");
        }
        let constraint = ["wheelchair", "frail", "bicycle", "a child of", "reaches", "Wanted"];
        let disclosed: Vec<&&str> = constraint.iter().filter(|w| prompt.contains(**w)).collect();
        match record.header.key.helper.as_str() {
            "llm" => {
                assert!(disclosed.is_empty(), "{disclosed:?}: {prompt}");
                let end = prompt.find("Rules:").expect("it has rules");
                openings.push((prompt[..end].replace(goal_place(prompt), "GOAL"), prompt.clone()));
            }
            _ => {
                let is_disclosed =
                    !disclosed.is_empty() || record.header.key.task == TaskId::NoConstraint;
                assert!(is_disclosed, "{prompt}");
            }
        }
    }
    // One template serves all tasks.
    assert_eq!(openings.len(), 8);
    assert!(openings.iter().all(|(opening, _)| *opening == openings[0].0));
}

fn goal_place(prompt: &str) -> &str {
    let (_, text) = prompt.split_once("goal place, which is: ").expect("it is named");
    text.split('.').next().expect("a sentence ends")
}

/// Partner that waits, and collects what its prompts would contain.
struct ContextCollector {
    contexts: Arc<Mutex<Vec<PromptContext>>>,
}

impl Policy for ContextCollector {
    fn reset(&mut self, _: &Briefing) {}

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        let (facts, _) =
            PromptContext::new(PromptTrack::Partner, context, valid, None, 0, LIST_LIMITS[0]);
        self.contexts.lock().unwrap().push(facts);
        Ok(Plan::Wait)
    }
}

#[test]
fn a_childs_distance_from_the_helper_is_not_called_that_from_its_guardian() {
    let rules = PlannerRules::paper();
    let contexts = Arc::new(Mutex::new(Vec::new()));
    let policy = ContextCollector { contexts: Arc::clone(&contexts) };
    // With all positions, the partner always knows where child and helper are.
    let grants = Grants { positions: true, ..partner_grants(rules) };
    let partner = Helper { agent: Box::new(PlanningAgent::new(policy, rules)), grants };
    let helper = built_in("rhp", rules, &GroundTruthPerceptionFactory);
    let episode = find_episode("shopping/test/00").unwrap();
    let config = EpisodeConfig { image_size: Some(SIZE), ..EpisodeConfig::new(&episode, "rhp") };
    let mut env = Env::new(config, EpisodeAgents::new(helper, Some(partner))).unwrap();
    env.advance(Some(1000)).unwrap();
    let contexts = contexts.lock().unwrap();
    let people: Vec<&PersonFacts> = contexts.iter().flat_map(|facts| &facts.others).collect();
    let is_far = |p: &&PersonFacts| p.distance_m.parse::<f32>().is_ok_and(|m| m > 4.0);
    assert!(people.iter().any(|p| p.name == "your helper" && is_far(p)), "it walks away");
    assert!(people.iter().any(|p| p.name == "the child" && !is_far(p)), "it stays");
    assert!(people.iter().all(|p| p.m_from_partner.is_none()));
}
