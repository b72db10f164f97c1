//! Sentences of explanations.

use std::fmt::Write as _;

use super::{
    DeliveryCounts, EndSummary, Explanation, FinalBelief, HypothesisChange, ModeChange,
    TimelineChange,
};
use crate::recorded_belief::Distribution;
use crate::report::capitalized;

/// Formats an explanation, one line per change.
pub(super) fn text(explanation: &Explanation) -> String {
    let Explanation { key, records_belief, timeline, end } = explanation;
    let mut text = format!("{} with {}, seed {}\n", key.episode, key.helper, key.seed);
    if !records_belief {
        text += "The helper records no belief; these are its plans and the events.\n";
    }
    for entry in timeline {
        let _ = writeln!(text, "frame {:>5}  {}", entry.frame, entry.text);
    }
    text + &end_text(end, key.task.info().target_value.unit())
}

/// Describes a change.
pub(super) fn describe(change: &TimelineChange) -> String {
    match change {
        TimelineChange::FirstBelief { goals, people } => first_belief(goals, people),
        TimelineChange::Evidence { added, retracted, goal } => {
            let part = |verb: &str, observations: &[String]| {
                (!observations.is_empty()).then(|| format!("{verb}: {}.", observations.join(", ")))
            };
            let goal = goal.as_ref().map(|shift| format!("{}.", shift_text(shift)));
            let parts = [part("Saw", added), part("Retracted", retracted), goal];
            parts.into_iter().flatten().collect::<Vec<_>>().join(" ")
        }
        TimelineChange::Goal(shift) => {
            format!("It believes that the goal is {}.", shift_text(shift))
        }
        TimelineChange::Person(HypothesisChange { hypothesis, probability, previous }) => {
            let (who, now, before) =
                (person(hypothesis), percent(*probability), percent(*previous));
            format!("It believes that the partner is {who}: {now} (was {before}).")
        }
        TimelineChange::Plan { mode: Some(mode), operations } => {
            format!("{}: {}.", mode_text(mode), operations.join(", "))
        }
        TimelineChange::Plan { mode: None, operations } if operations.is_empty() => {
            "It has no plan.".to_owned()
        }
        TimelineChange::Plan { mode: None, operations } => {
            format!("It plans: {}.", operations.join(", "))
        }
        TimelineChange::Delivered { by, object, counted } => {
            let verb = if *counted { "counts" } else { "does not count" };
            format!("{} delivers {object}, which {verb}.", capitalized(by))
        }
        TimelineChange::Failed { agent, action, reason } => {
            format!("{} fails to {action}: {reason}.", capitalized(agent))
        }
        TimelineChange::Event { event } => format!("{}.", capitalized(event)),
    }
}

fn first_belief(goals: &Distribution, people: &Distribution) -> String {
    let is_uniform = goals.len() > 1 && goals.iter().all(|(_, p)| goals[0].1.abs_diff(*p) <= 1);
    let list = |distribution: &Distribution| {
        let each =
            distribution.iter().map(|(name, p)| format!("{} {}", readable(name), percent(*p)));
        each.collect::<Vec<_>>().join(", ")
    };
    let start = if is_uniform { "It knows nothing" } else { "It begins with" };
    format!("{start}: {}. The partner may be: {}.", list(goals), list(people))
}

fn shift_text(HypothesisChange { hypothesis, probability, previous }: &HypothesisChange) -> String {
    format!("{} {} (was {})", readable(hypothesis), percent(*probability), percent(*previous))
}

/// Describes a change of the mode; names the modes of `infer` in words.
fn mode_text(ModeChange { from, to, goal_is_clear }: &ModeChange) -> String {
    let in_words = |mode: &str| match mode {
        "watch" => "watching".to_owned(),
        "plan" => "planning".to_owned(),
        "rules" => "following its rules".to_owned(),
        mode => format!("`{mode}`"),
    };
    let change = format!("changes from {} to {}", in_words(from), in_words(to));
    match (from.as_str(), to.as_str()) {
        ("watch", "plan") if *goal_is_clear => format!("The goal is clear; it {change}"),
        ("plan", "watch") if !goal_is_clear => format!("The goal is not clear; it {change}"),
        _ => format!("It {change}"),
    }
}

fn end_text(end: &EndSummary, unit: &str) -> String {
    let EndSummary { frame, progress, goal, person, identified, .. } = end;
    let mut text = match progress {
        Some([done, total]) => {
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            format!("The episode ends at frame {frame} with {done:.0} of {total:.0}{unit} done.\n")
        }
        None => format!("The trace is cut off after frame {frame}.\n"),
    };
    if let Some(goal) = goal {
        let when = match (goal.truth, identified) {
            (None, _) => String::new(),
            (_, Some(frame)) => format!(" It is identified from frame {frame} on."),
            (_, None) => " It is not identified at the end.".to_owned(),
        };
        let _ = writeln!(text, "Goal:       {}{when}", final_text(goal));
    }
    if let Some(person) = person {
        let _ = writeln!(text, "Person:     {}", final_text(person));
    }
    let count = |name: &str, DeliveryCounts { all, counted }: DeliveryCounts| {
        format!("{name} {all}, counted {counted}")
    };
    let (partner, helper) = (count("partner", end.partner), count("helper", end.helper));
    let _ = writeln!(text, "Deliveries: {partner}; {helper}.");
    text
}

fn final_text(belief: &FinalBelief) -> String {
    let FinalBelief { believed, probability, truth, true_probability } = belief;
    let believed_text = format!("believed {} ({})", readable(believed), percent(*probability));
    match truth {
        None => format!("{believed_text}."),
        Some(truth) if truth == believed => format!("{believed_text}, which is true."),
        Some(truth) => {
            let truth = readable(truth);
            format!("{believed_text}, but {truth} ({}) is true.", percent(*true_probability))
        }
    }
}

/// Returns the kind of person with its article.
fn person(name: &str) -> String {
    match name {
        "adult" => "an adult".to_owned(),
        "child" => "a child".to_owned(),
        "wheelchair" => "a wheelchair user".to_owned(),
        "rider" => "a rider".to_owned(),
        "frail" => "a frail person".to_owned(),
        name => format!("`{name}`"),
    }
}

fn readable(name: &str) -> String {
    name.replace('_', " ")
}

/// Formats a probability per mille.
fn percent(per_mille: u16) -> String {
    format!("{} %", (u32::from(per_mille) + 5) / 10)
}
