//! Prompts say what they should, tell nothing that is hidden, and are short enough.

use chaic_core::TaskId;
use chaic_llm::Language;
use chaic_llm::tokens;
use chaic_llm_standin::Options;

use crate::common::{Bench, decided, exchanges, flag, standin};

/// Tokens that a question may have.
const LIMIT: usize = 4000;

/// The longest count of two vocabularies.
fn tokens_of(text: &str) -> usize {
    let vocabularies = [tiktoken_rs::cl100k_base_singleton(), tiktoken_rs::o200k_base_singleton()];
    vocabularies.into_iter().map(|v| v.count_ordinary(text)).max().unwrap()
}

#[test]
fn questions_are_short_enough_to_the_end_of_the_longest_episodes() {
    // A whole episode in a house, in the street, and of a removal.
    let bench = Bench::new(&[TaskId::HighTarget, TaskId::Shopping, TaskId::MovingHouse], 3000);
    let (_standin, settings) = standin(Options::default());
    let language = Language::live(settings, flag()).unwrap();
    assert!(bench.play("run", &bench.given(&["llm-told"]), &language).0);
    let mut n = 0;
    for record in bench.records("run") {
        for exchange in exchanges(&record) {
            let text: Vec<&str> = exchange.ask.messages.iter().map(|m| m.text.as_str()).collect();
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
fn prompts_are_made_shorter_until_they_fit() {
    let bench = Bench::new(&[TaskId::Shopping], 1200);
    let mut lengths = Vec::new();
    for limit in [4000, 900] {
        let (_standin, mut settings) = standin(Options::default());
        settings.asking.prompt_tokens = limit;
        let language = Language::live(settings, flag()).unwrap();
        let name = format!("run{limit}");
        assert!(bench.play(&name, &bench.given(&["llm"]), &language).0);
        let records = bench.records(&name);
        let shortened = decided(&records[0]).iter().map(|d| d.shortened).max().unwrap();
        let longest = exchanges(&records[0])
            .iter()
            .map(|e| tokens_of(&e.ask.messages[0].text))
            .max()
            .unwrap();
        assert!(longest < limit as usize, "{longest} tokens of {limit}");
        lengths.push((shortened, longest));
    }
    assert!(lengths[0].0 < lengths[1].0 && lengths[0].1 > lengths[1].1, "{lengths:?}");
}

#[test]
fn the_hidden_track_is_told_neither_task_nor_constraint_nor_goal() {
    let tasks: Vec<TaskId> = TaskId::paper().collect();
    let bench = Bench::new(&tasks, 100);
    let (_standin, settings) = standin(Options::default());
    let language = Language::live(settings, flag()).unwrap();
    assert!(bench.play("run", &bench.given(&["llm", "llm-told"]), &language).0);
    let mut openings = Vec::new();
    for record in bench.records("run") {
        let exchanges = exchanges(&record);
        let prompt = &exchanges[0].ask.messages[0].text;
        let titles: Vec<&str> = prompt.lines().filter_map(|l| l.strip_prefix("## ")).collect();
        let six = ["Task", "Yourself", "The others", "Progress", "What is where", "Plans"];
        assert_eq!(titles, six);
        for words in ["1. ", "explore", "turn around", "wait", "frames have passed"] {
            assert!(prompt.contains(words), "{words}: {prompt}");
        }
        let constraint = ["wheelchair", "frail", "bicycle", "a child of", "reaches", "Wanted"];
        let tells: Vec<&&str> = constraint.iter().filter(|w| prompt.contains(**w)).collect();
        match record.head.of.helper.as_str() {
            "llm" => {
                assert!(tells.is_empty(), "{tells:?}: {prompt}");
                let end = prompt.find("Rules:").expect("it has rules");
                openings.push((prompt[..end].replace(goal_place(prompt), "GOAL"), prompt.clone()));
            }
            _ => {
                let is_told = !tells.is_empty() || record.head.of.task == TaskId::NoConstraint;
                assert!(is_told, "{prompt}");
            }
        }
    }
    // One template for all tasks.
    assert_eq!(openings.len(), 8);
    assert!(openings.iter().all(|(opening, _)| *opening == openings[0].0));
}

fn goal_place(prompt: &str) -> &str {
    let (_, rest) = prompt.split_once("goal place, which is: ").expect("it is named");
    rest.split('.').next().expect("a sentence ends")
}
