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

/// Number in an answer, with the position of the word or text that refers to it.
struct Mention {
    at: usize,
    number: usize,
}

/// Parses an answer: strictly in the requested form (JSON, or a last line `Plan: N`), else
/// leniently: JSON within text, a number in words, or the text of exactly one plan.
///
/// # Errors
/// A description of the problem, if the answer names no listed plan, or several.
pub fn parse(answer: &str, plans: &[String], by_schema: bool) -> Result<Choice, String> {
    let answer = answer.trim();
    if answer.is_empty() {
        return Err("it is empty".to_owned());
    }
    let lenient = || parse_lenient(&ends(answer), plans);
    let found = find(strict_number(answer, by_schema), lenient);
    choice(found.ok_or("it doesn't name the number of one plan")?, plans.len())
}

/// Parses an answer that was cut off: strictly in the requested form, else one complete JSON object.
///
/// # Errors
/// A description of the problem, if the answer names no listed plan.
pub fn parse_truncated(answer: &str, plans: &[String], by_schema: bool) -> Result<Choice, String> {
    let answer = answer.trim();
    // The end of `Plan: 12` may be missing.
    let is_complete = |number: &usize| by_schema || number.saturating_mul(10) > plans.len();
    let strict = strict_number(answer, by_schema).filter(is_complete);
    let found = find(strict, || only_object(&ends(answer)));
    choice(found.ok_or("it is cut off before it names a plan, so write less")?, plans.len())
}

/// Returns the first number, and whether it was parsed leniently.
fn find(strict: Option<usize>, lenient: impl FnOnce() -> Option<usize>) -> Option<(usize, bool)> {
    strict.map(|number| (number, false)).or_else(|| lenient().map(|number| (number, true)))
}

/// Checks a number against the length of the list.
fn choice((number, lenient): (usize, bool), n: usize) -> Result<Choice, String> {
    if (1..=n).contains(&number) {
        Ok(Choice { index: number - 1, lenient })
    } else {
        Err(format!("plan {number} isn't in the list, which goes from 1 to {n}"))
    }
}

fn strict_number(answer: &str, by_schema: bool) -> Option<usize> {
    if by_schema { whole_json(answer) } else { last_line(answer) }
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
    let lower = answer.to_lowercase();
    json_within(answer)
        .or_else(|| explicit_number(&lower))
        .or_else(|| bare_number(answer))
        .or_else(|| mentioned_plan(&lower, plans))
}

/// Parses the last JSON object within the text that names a plan. Objects within such an object, for
/// example a list of alternatives, do not count.
fn json_within(answer: &str) -> Option<usize> {
    /// Maximum number of opening braces that are tried.
    const MAX_BRACES: usize = 200;
    let mut braces: Vec<usize> =
        answer.rmatch_indices('{').take(MAX_BRACES).map(|(at, _)| at).collect();
    braces.reverse();
    let (mut found, mut end) = (None, 0);
    for at in braces {
        if at >= end
            && let Some((number, length)) = object_number(&answer[at..])
        {
            (found, end) = (Some(number), at + length);
        }
    }
    found
}

/// Parses the JSON object within the text; `None` if there are several, or one within another.
fn only_object(answer: &str) -> Option<usize> {
    let at = answer.find('{').filter(|at| answer.rfind('{') == Some(*at))?;
    object_number(&answer[at..]).map(|(number, _)| number)
}

/// Parses a complete JSON object at the start of the text; returns its number and its length, bytes.
fn object_number(text: &str) -> Option<(usize, usize)> {
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
    let mut values = serde_json::Deserializer::from_str(text).into_iter();
    let loose: Loose = values.next()?.ok()?;
    let number = match loose.plan {
        Number::Whole(number) => number,
        Number::Text(text) => leading_number(&text)?,
    };
    Some((number, values.byte_offset()))
}

/// Parses the last `plan: 3`, `plan = 3`, `"plan": 3` or `answer: 3`.
fn explicit_number(lower: &str) -> Option<usize> {
    let after_colon = |text: &str| {
        let text = text.trim_start_matches(|c: char| " *_`\"'\t".contains(c));
        number_after_signs(text.strip_prefix([':', '='])?)
    };
    let words = ["plan", "answer", "choice", "option"].into_iter();
    let mentions = words.filter_map(|word| last_mention(lower, word, after_colon));
    mentions.max_by_key(|mention| mention.at).map(|mention| mention.number)
}

/// Returns the plan that a text names by its number or its words. A number counts more, unless the words of
/// another plan follow in a later sentence.
fn mentioned_plan(lower: &str, plans: &[String]) -> Option<usize> {
    let mut words = ["plan", "option", "choice", "answer", "choose"].into_iter();
    let by_number = words.find_map(|word| last_mention(lower, word, number_after_signs));
    let (by_number, by_text) = match (by_number, plan_by_text(lower, plans)) {
        (Some(by_number), Some(by_text)) => (by_number, by_text),
        (by_number, by_text) => return by_number.or(by_text).map(|mention| mention.number),
    };
    let is_later_sentence = lower
        .get(by_number.at..by_text.at)
        .is_some_and(|between| between.contains(['.', '!', '?', '\n']));
    let end = by_text.at + plans[by_text.number - 1].to_lowercase().len();
    // The word `wait` does not occur in `waiting`.
    let is_whole_word = !lower[end..].starts_with(char::is_alphanumeric);
    Some(if is_later_sentence && is_whole_word { by_text.number } else { by_number.number })
}

/// Finds the last occurrence of a word that is followed by a number, as `number` parses it.
fn last_mention(
    lower: &str,
    word: &str,
    number: impl Fn(&str) -> Option<usize>,
) -> Option<Mention> {
    lower.rmatch_indices(word).find_map(|(at, _)| {
        let before = lower[..at].chars().next_back();
        if before.is_some_and(char::is_alphanumeric) {
            return None;
        }
        number(&lower[at + word.len()..]).map(|number| Mention { at, number })
    })
}

/// Parses a number with only a few signs before it, or one of the words for it.
fn number_after_signs(text: &str) -> Option<usize> {
    let is_sign = |c: char| " :=#*_`\"'([\t".contains(c);
    let text = text.trim_start_matches(is_sign);
    let word = ["plan", "option", "number"].into_iter().find_map(|word| text.strip_prefix(word));
    leading_number(word.unwrap_or(text).trim_start_matches(is_sign))
}

/// Parses an answer that is a number with only a few signs around it.
fn bare_number(answer: &str) -> Option<usize> {
    let core = answer.trim_matches(|c: char| !c.is_ascii_digit());
    let remainder: String = answer.replacen(core, "", 1);
    let is_negative = answer.contains(&format!("-{core}"));
    let is_bare = core.len() <= 4 && !is_negative && !remainder.chars().any(char::is_alphanumeric);
    is_bare.then(|| core.parse().ok())?
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
fn plan_by_text(lower: &str, plans: &[String]) -> Option<Mention> {
    let mut remainder = lower.to_owned();
    let mut order: Vec<usize> = (0..plans.len()).collect();
    order.sort_by_key(|i| std::cmp::Reverse(plans[*i].len()));
    let mut found = Vec::new();
    for i in order {
        let text = plans[i].to_lowercase();
        if let Some(at) = remainder.rfind(&text).filter(|_| !text.is_empty()) {
            // The replacement has the same length, so positions stay valid.
            remainder = remainder.replace(&text, &"|".repeat(text.len()));
            found.push(Mention { at, number: i + 1 });
        }
    }
    let mention = found.pop()?;
    found.is_empty().then_some(mention)
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
            ("So: {\"plan\": 4, \"others\": [{\"plan\": 1}, {\"plan\": 2}]}", false, 4, true),
            ("So: {\"decision\": {\"plan\": 3}}", false, 3, true),
            ("First plan 1, no: **Plan: 4**", false, 4, true),
            ("4", false, 4, true),
            ("(4).", false, 4, true),
            ("- 4", false, 4, true),
            ("-1", false, 0, false),
            ("I choose number 4", false, 4, true),
            ("plan = 2, not plan 3", false, 2, true),
            ("\"plan\": 2 is better than plan 3", true, 2, true),
            ("Answer: 3. Plan 1 costs time.", false, 3, true),
            ("Final answer: **Plan 3**", false, 3, true),
            ("Plan 2, or rather plan 3", false, 3, true),
            ("Plan 1 looks bad. My plan is to wait.", false, 4, true),
            ("I could explore. But plan 3 is better.", false, 3, true),
            ("I choose plan 3: there's no time to wait", false, 3, true),
            ("Plan 3. Waiting costs time.", false, 3, true),
            ("Option 3 - don't explore", false, 3, true),
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

    #[test]
    fn an_answer_that_was_cut_off_names_a_plan_only_in_a_complete_form() {
        let many = vec!["explore".to_owned(); 12];
        // Answer, whether by schema, number or 0 for an error, whether leniently.
        for (answer, by_schema, number, lenient) in [
            (r#"{"reasoning": "Plan 3 would be bad beca"#, true, 0, false),
            (r#"{"reasoning": "x", "options": [{"plan": 1}, {"pl"#, true, 0, false),
            (r#"{"options": [{"plan": 1}"#, true, 0, false),
            (r#"{"reasoning": "x", "plan": 1"#, true, 0, false),
            (r#"{"reasoning": "x", "plan": 3}"#, true, 3, false),
            ("{\"plan\": 3}\nThat is since", true, 3, true),
            ("```json\n{\"plan\": 3}", false, 3, true),
            ("Plan 3 would be", false, 0, false),
            ("I think so.\nPlan: 2", false, 2, false),
            ("I think so.\nPlan: 1", false, 0, false),
            ("Plan: 3 is", false, 0, false),
            ("explore", false, 0, false),
            ("", true, 0, false),
        ] {
            let read = parse_truncated(answer, &many, by_schema);
            match (number, read) {
                (0, read) => assert!(read.is_err(), "{answer}: {read:?}"),
                (n, read) => {
                    assert_eq!(read, Ok(Choice { index: n - 1, lenient }), "{answer}");
                }
            }
        }
    }
}
