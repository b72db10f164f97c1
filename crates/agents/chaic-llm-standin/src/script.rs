//! The script: reads a question's text, and picks a plan by a few rules. No model of any kind.

use serde_json::{Value, json};

/// What was asked.
#[derive(Clone, Debug, Default)]
pub struct Question {
    /// All that the user said, in order.
    pub text: String,
    /// What the user said last.
    pub last: String,
    /// Of how many plans one is to be named by JSON schema; `None` for a text.
    pub schema_of: Option<usize>,
    /// Pictures that came with it.
    pub pictures: usize,
}

impl Question {
    /// Reads a request's body.
    ///
    /// # Errors
    /// If it is no chat.
    pub fn parse(body: &[u8]) -> Result<Question, String> {
        let value: Value = serde_json::from_slice(body).map_err(|e| e.to_string())?;
        let messages = value["messages"].as_array().ok_or("there are no messages")?;
        let mut question = Question::default();
        for message in messages.iter().filter(|m| m["role"] == "user") {
            let mut text = message["content"].as_str().unwrap_or_default().to_owned();
            for part in message["content"].as_array().into_iter().flatten() {
                text += part["text"].as_str().unwrap_or_default();
                if let Some(url) = part["image_url"]["url"].as_str() {
                    if !url.starts_with("data:image/") {
                        return Err("a picture isn't encoded in the message".to_owned());
                    }
                    question.pictures += 1;
                }
            }
            question.text += &text;
            question.text.push('\n');
            question.last = text;
        }
        let schema = &value["response_format"]["json_schema"]["schema"]["properties"]["plan"];
        question.schema_of = schema["enum"].as_array().map(Vec::len);
        Ok(question)
    }

    /// The plans that are listed last, in order.
    pub fn plans(&self) -> Vec<&str> {
        let mut plans: Vec<&str> = Vec::new();
        for line in self.text.lines() {
            let Some((number, plan)) = line.split_once(". ") else { continue };
            match number.parse::<usize>() {
                Ok(1) => plans = vec![plan],
                Ok(n) if n == plans.len() + 1 => plans.push(plan),
                _ => {}
            }
        }
        plans
    }

    /// The answer of the script.
    pub fn answer(&self) -> String {
        let (number, why) = self.choose();
        self.form(number, &format!("This is a stand-in, not a language model. {why}"))
    }

    /// A plan's number in the form that was asked for.
    pub fn form(&self, number: usize, why: &str) -> String {
        match self.schema_of {
            Some(_) => json!({ "reasoning": why, "plan": number }).to_string(),
            None => format!("{why}\nPlan: {number}"),
        }
    }

    /// A plan's number, from 1, and why.
    pub fn choose(&self) -> (usize, &'static str) {
        let plans = self.plans();
        let find = |words: &str| plans.iter().position(|p| p.contains(words)).map(|i| i + 1);
        let is_away = self.text.contains("away from your partner");
        let is_full = self.text.contains("You have no free hand");
        let (passed, all) = self.frames().unwrap_or((0, 1));
        let deliver = find("bring what is carried");
        let first = [
            (find("follow the child").filter(|_| is_away), "The child has run away."),
            (find("put what one hand holds"), "That frees a hand."),
            (deliver.filter(|_| is_full), "Both hands are full."),
            (deliver.filter(|_| 4 * (all - passed.min(all)) < all), "Time is short."),
            (find("remove the obstacle"), "It may be in the partner's way."),
            (find("together with the partner"), "Two lift more than one."),
            (find("go to container").filter(|_| 2 * passed < all), "It carries three things."),
            (self.wanted(&plans), "The partner took the same kind of thing."),
            (
                find("and pick it up").filter(|_| 5 * passed > all),
                "Something is better than nothing.",
            ),
            (find("follow the partner").filter(|_| !self.knows_partner()), "What does it want?"),
            (find("and pick it up"), "Nothing better is known."),
            (
                deliver.filter(|_| self.text.contains("explored everything")),
                "Nothing else is left.",
            ),
            (find("explore"), "There is more to see."),
            (find("turn around"), "There is more to see."),
        ];
        first
            .into_iter()
            .find_map(|(number, why)| number.map(|n| (n, why)))
            .unwrap_or((plans.len().max(1), "Nothing else is left."))
    }

    /// The first plan about a thing that is called like one that the partner took, or that is
    /// asked for.
    fn wanted(&self, plans: &[&str]) -> Option<usize> {
        let line = |start: &str| self.text.lines().find_map(|l| l.trim().strip_prefix(start));
        let took = line("Has been seen to take: ").or_else(|| line("Wanted: "))?;
        let names: Vec<String> = took
            .trim_end_matches('.')
            .split(", ")
            .map(|n| n.split(" #").next().unwrap_or(n))
            .map(|n| n.trim_start_matches(|c: char| c.is_ascii_digit() || c == ' ').to_owned())
            .collect();
        let is_wanted =
            |plan: &&str| names.iter().any(|n| plan.starts_with(&format!("go to {n} #")));
        plans.iter().position(is_wanted).map(|i| i + 1)
    }

    fn knows_partner(&self) -> bool {
        self.text.contains("Has been seen to take:") || self.text.contains("Wanted:")
    }

    /// Frames that have passed, and all.
    fn frames(&self) -> Option<(u64, u64)> {
        let line = self.text.lines().find(|l| l.contains("frames have passed"))?;
        let mut numbers = line.split_whitespace().filter_map(|w| w.parse().ok());
        Some((numbers.next()?, numbers.next()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn question(text: &str) -> Question {
        Question { text: text.to_owned(), ..Question::default() }
    }

    #[test]
    fn the_last_list_counts() {
        let text = "1. a\n2. b\nand then\n1. explore\n2. turn around\n 3.5 m\n3. wait";
        assert_eq!(question(text).plans(), ["explore", "turn around", "wait"]);
    }

    #[test]
    fn it_picks_sensibly() {
        let plans =
            "1. explore\n2. go to bread #30 and pick it up\n3. go to apple #31 and pick it up";
        for (before, number) in [
            ("Has been seen to take: apple #7, apple #8.\n", 3),
            ("Has been seen to take: pen #7.\n900 of 3000 frames have passed", 2),
            ("Wanted: 3 apple, 2 pen.\n", 3),
        ] {
            let question = question(&format!("{before}\n{plans}"));
            assert_eq!(question.choose().0, number, "{before}");
        }
        let full =
            format!("You have no free hand.\n{plans}\n4. bring what is carried to the goal place");
        assert_eq!(question(&full).choose().0, 4);
    }

    #[test]
    fn answers_have_the_form_that_was_asked_for() {
        let body = json!({
            "messages": [{ "role": "user", "content": "1. explore\n2. wait" }],
            "response_format": { "type": "json_schema", "json_schema": { "schema": {
                "properties": { "plan": { "enum": [1, 2] } } } } },
        });
        let asked = Question::parse(body.to_string().as_bytes()).expect("it is a chat");
        assert_eq!(asked.schema_of, Some(2));
        let answer: Value = serde_json::from_str(&asked.answer()).expect("it is JSON");
        assert_eq!(answer["plan"], json!(1));
        assert!(answer["reasoning"].as_str().is_some_and(|r| r.contains("not a language model")));
        assert!(question("1. explore").answer().ends_with("\nPlan: 1"));
    }
}
