//! Parsing of answers: the number of a listed plan, or an error.
//!
//! The only output of this module is an index into the list of plans, whatever the answer contains.

use serde::Deserialize;

/// Bytes that are parsed at each end of an answer.
const MAX_PARSED: usize = 16 << 10;

/// Parsed answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Index of the plan, from 0.
    pub index: usize,
    /// True if the answer deviated from the requested form.
    pub lenient: bool,
}

#[derive(Deserialize)]
struct Strict {
    plan: usize,
    #[serde(default)]
    #[allow(dead_code)]
    reasoning: Option<String>,
}

/// Parses an answer: strictly in the requested form (JSON, or a last line `Plan: N`), else
/// leniently: JSON within text, a number in words, or the text of exactly one plan.
///
/// # Errors
/// A description of the problem, if the answer names no listed plan, or several.
pub fn parse(answer: &str, plans: &[String], by_schema: bool) -> Result<Choice, String> {
    let n = plans.len();
    let answer = answer.trim();
    if answer.is_empty() {
        return Err("it is empty".to_owned());
    }
    let strict = if by_schema { whole_json(answer) } else { last_line(answer) };
    let (number, lenient) = match strict {
        Some(number) => (Some(number), false),
        None => (parse_lenient(&ends(answer), plans), true),
    };
    match number {
        Some(number) if (1..=n).contains(&number) => Ok(Choice { index: number - 1, lenient }),
        Some(number) => Err(format!("plan {number} isn't in the list, which goes from 1 to {n}")),
        None => Err("it doesn't name the number of one plan".to_owned()),
    }
}

fn whole_json(answer: &str) -> Option<usize> {
    serde_json::from_str::<Strict>(answer).ok().map(|s| s.plan)
}

/// Parses `Plan: N` as the last line.
fn last_line(answer: &str) -> Option<usize> {
    let line = answer.lines().rev().map(str::trim).find(|l| !l.is_empty())?;
    line.strip_prefix("Plan:")?.trim().parse().ok()
}

/// Returns the start and the end of a long answer.
fn ends(answer: &str) -> String {
    if answer.len() <= 2 * MAX_PARSED {
        return answer.to_owned();
    }
    let floor = |mut i: usize| {
        while !answer.is_char_boundary(i) {
            i -= 1;
        }
        i
    };
    let (head, tail) = (floor(MAX_PARSED), floor(answer.len() - MAX_PARSED));
    format!("{}\n{}", &answer[..head], &answer[tail..])
}

fn parse_lenient(answer: &str, plans: &[String]) -> Option<usize> {
    json_within(answer)
        .or_else(|| number_after(answer, "plan"))
        .or_else(|| bare_number(answer))
        .or_else(|| {
            ["option", "choice", "answer", "choose"].iter().find_map(|w| number_after(answer, w))
        })
        .or_else(|| plan_by_text(answer, plans))
}

/// Parses the last JSON object within the text that names a plan.
fn json_within(answer: &str) -> Option<usize> {
    /// Maximum number of opening braces that are tried.
    const MAX_BRACES: usize = 200;
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Number {
        Whole(usize),
        Text(String),
    }
    #[derive(Deserialize)]
    struct Loose {
        #[serde(alias = "Plan", alias = "choice", alias = "number", alias = "answer")]
        plan: Number,
    }
    let braces = answer.char_indices().rev().filter(|(_, c)| *c == '{').take(MAX_BRACES);
    braces.map(|(at, _)| &answer[at..]).find_map(|text| {
        let loose: Loose = serde_json::Deserializer::from_str(text).into_iter().next()?.ok()?;
        match loose.plan {
            Number::Whole(number) => Some(number),
            Number::Text(text) => leading_number(&text),
        }
    })
}

/// Parses the number after the last occurrence of a word, with only a few signs in between.
fn number_after(answer: &str, word: &str) -> Option<usize> {
    let lower = answer.to_ascii_lowercase();
    lower.rmatch_indices(word).find_map(|(at, _)| {
        let before = lower[..at].chars().next_back();
        if before.is_some_and(char::is_alphanumeric) {
            return None;
        }
        let remainder =
            lower[at + word.len()..].trim_start_matches(|c: char| " :=#*_`\"'([\t".contains(c));
        let remainder = remainder.strip_prefix("number").unwrap_or(remainder);
        leading_number(remainder.trim_start_matches(|c: char| " :=#*_`\"'([\t".contains(c)))
    })
}

/// Parses an answer that is a number with only a few signs around it.
fn bare_number(answer: &str) -> Option<usize> {
    let core = answer.trim_matches(|c: char| !c.is_ascii_digit());
    let remainder: String = answer.replacen(core, "", 1);
    (core.len() <= 4 && !remainder.chars().any(char::is_alphanumeric)).then(|| core.parse().ok())?
}

fn leading_number(text: &str) -> Option<usize> {
    let text = text.trim_start();
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let is_fraction = text[end..]
        .strip_prefix('.')
        .is_some_and(|remainder| remainder.starts_with(|c: char| c.is_ascii_digit()));
    if is_fraction { None } else { text[..end].parse().ok() }
}

/// Finds the one plan whose text is in the answer; if texts contain each other, the longest counts.
fn plan_by_text(answer: &str, plans: &[String]) -> Option<usize> {
    let mut remainder = answer.to_lowercase();
    let mut order: Vec<usize> = (0..plans.len()).collect();
    order.sort_by_key(|i| std::cmp::Reverse(plans[*i].len()));
    let mut found = Vec::new();
    for i in order {
        let text = plans[i].to_lowercase();
        if !text.is_empty() && remainder.contains(&text) {
            remainder = remainder.replace(&text, "|");
            found.push(i + 1);
        }
    }
    match found[..] {
        [number] => Some(number),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plans() -> Vec<String> {
        ["explore", "go to apple #3 and pick it up", "go to apple #31 and pick it up", "wait"]
            .map(str::to_owned)
            .to_vec()
    }

    #[test]
    fn answers_are_parsed() {
        // Answer, whether by schema, number or 0 for an error, whether leniently.
        for (answer, by_schema, number, lenient) in [
            (r#"{"reasoning": "apples", "plan": 3}"#, true, 3, false),
            (r#"{"plan": 3}"#, true, 3, false),
            (r#"{"plan": 3}"#, false, 3, true),
            ("I think so.\nPlan: 2", false, 2, false),
            ("Plan: 2", true, 2, true),
            ("```json\n{\"reasoning\": \"x\", \"plan\": \"4\"}\n```", true, 4, true),
            ("Sure! {\"plan\": 1} I mean {\"plan\": 2}.", true, 2, true),
            ("First plan 1, no: **Plan: 4**", false, 4, true),
            ("4", false, 4, true),
            ("(4).", false, 4, true),
            ("I choose number 4", false, 4, true),
            ("My answer is: go to apple #31 and pick it up.", false, 3, true),
            ("Go to apple #3 and pick it up", false, 2, true),
            ("wait", true, 4, true),
            ("explore or wait", false, 0, false),
            (r#"{"plan": 9}"#, true, 0, false),
            (r#"{"plan": -1}"#, true, 0, false),
            (r#"{"plan": 0}"#, true, 0, false),
            (r#"{"plan": 1.5}"#, true, 0, false),
            ("Plan: 99999999999999999999999", false, 0, false),
            ("", false, 0, false),
            ("no idea", false, 0, false),
            ("the plane 3 leaves", false, 0, false),
        ] {
            let read = parse(answer, &plans(), by_schema);
            match (number, read) {
                (0, read) => assert!(read.is_err(), "{answer}: {read:?}"),
                (n, read) => {
                    assert_eq!(read, Ok(Choice { index: n - 1, lenient }), "{answer}");
                }
            }
        }
    }

    #[test]
    fn only_the_ends_of_a_huge_answer_are_parsed() {
        let huge = format!("{}\nPlan: 3", "{ é".repeat(3_000_000));
        assert_eq!(parse(&huge, &plans(), true), Ok(Choice { index: 2, lenient: true }));
        assert!(parse(&"{".repeat(10 << 20), &plans(), true).is_err());
    }
}
