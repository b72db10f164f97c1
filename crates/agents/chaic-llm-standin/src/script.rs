//! Script that answers a prompt: it selects a plan by fixed rules, without a model.

use serde_json::{Value, json};

/// Content of a chat request.
#[derive(Clone, Debug, Default)]
pub struct Question {
    /// All user messages in order.
    pub text: String,
    /// Last user message.
    pub last: String,
    /// Number of plans in the JSON schema of the answer; `None` for a plain-text answer.
    pub n_schema_plans: Option<usize>,
    /// Number of images in the messages.
    pub images: usize,
}

impl Question {
    /// Parses the body of a request.
    ///
    /// # Errors
    /// If it is not a chat request.
    pub fn parse(body: &[u8]) -> Result<Question, String> {
        let value: Value = serde_json::from_slice(body).map_err(|e| e.to_string())?;
        let messages = value["messages"].as_array().ok_or("the request has no messages")?;
        let mut question = Question::default();
        for message in messages.iter().filter(|m| m["role"] == "user") {
            let mut text = message["content"].as_str().unwrap_or_default().to_owned();
            for part in message["content"].as_array().into_iter().flatten() {
                text += part["text"].as_str().unwrap_or_default();
                if let Some(url) = part["image_url"]["url"].as_str() {
                    if !url.starts_with("data:image/") {
                        return Err("an image isn't encoded in the message".to_owned());
                    }
                    question.images += 1;
                }
            }
            question.text += &text;
            question.text.push('\n');
            question.last = text;
        }
        let schema = &value["response_format"]["json_schema"]["schema"]["properties"]["plan"];
        question.n_schema_plans = schema["enum"].as_array().map(Vec::len);
        Ok(question)
    }

    /// Returns the plans of the last list in the prompt, in order.
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

    /// Returns the answer of the script.
    pub fn answer(&self) -> String {
        let (number, reason) = self.choose();
        self.format_answer(number, &format!("This is a stand-in, not a language model. {reason}"))
    }

    /// Formats a plan's number as the request demands.
    pub fn format_answer(&self, number: usize, reason: &str) -> String {
        match self.n_schema_plans {
            Some(_) => json!({ "reasoning": reason, "plan": number }).to_string(),
            None => format!("{reason}\nPlan: {number}"),
        }
    }

    /// Returns the selected plan's number, from 1, and the reason.
    pub fn choose(&self) -> (usize, &'static str) {
        let plans = self.plans();
        let find = |words: &str| plans.iter().position(|p| p.contains(words)).map(|i| i + 1);
        let is_away = self.text.contains("away from your partner");
        let is_full = self.text.contains("You have no free hand");
        let (frame, n_frames) = self.frames().unwrap_or((0, 1));
        let deliver = find("bring what is carried");
        let rules = [
            (find("follow the child").filter(|_| is_away), "The child has run away."),
            (find("put what one hand holds"), "That frees a hand."),
            (deliver.filter(|_| is_full), "Both hands are full."),
            (deliver.filter(|_| 4 * (n_frames - frame.min(n_frames)) < n_frames), "Time is short."),
            (find("remove the obstacle"), "It may be in the partner's way."),
            (find("together with the partner"), "Two lift more than one."),
            (find("go to container").filter(|_| 2 * frame < n_frames), "It carries three things."),
            (self.find_wanted(&plans), "The partner took the same kind of thing."),
            (
                find("and pick it up").filter(|_| 5 * frame > n_frames),
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
        rules
            .into_iter()
            .find_map(|(number, reason)| number.map(|n| (n, reason)))
            .unwrap_or((plans.len().max(1), "Nothing else is left."))
    }

    /// Returns the first plan for an object of a class that the partner took or that the prompt
    /// asks for.
    fn find_wanted(&self, plans: &[&str]) -> Option<usize> {
        let line = |start: &str| self.text.lines().find_map(|l| l.trim().strip_prefix(start));
        let taken = line("Picked up, as you saw: ").or_else(|| line("Wanted: "))?;
        let names: Vec<String> = taken
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
        self.text.contains("Picked up, as you saw:") || self.text.contains("Wanted:")
    }

    /// Returns the current frame and the number of frames from the prompt.
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
    fn the_last_list_of_plans_is_used() {
        let text = "1. a\n2. b\nand then\n1. explore\n2. turn around\n 3.5 m\n3. wait";
        assert_eq!(question(text).plans(), ["explore", "turn around", "wait"]);
    }

    #[test]
    fn the_script_prefers_wanted_objects() {
        let plans =
            "1. explore\n2. go to bread #30 and pick it up\n3. go to apple #31 and pick it up";
        for (before, number) in [
            ("Picked up, as you saw: apple #7, apple #8.\n", 3),
            ("Picked up, as you saw: pen #7.\n900 of 3000 frames have passed", 2),
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
    fn answers_have_the_requested_format() {
        let body = json!({
            "messages": [{ "role": "user", "content": "1. explore\n2. wait" }],
            "response_format": { "type": "json_schema", "json_schema": { "schema": {
                "properties": { "plan": { "enum": [1, 2] } } } } },
        });
        let request = Question::parse(body.to_string().as_bytes()).expect("it is a chat");
        assert_eq!(request.n_schema_plans, Some(2));
        let answer: Value = serde_json::from_str(&request.answer()).expect("it is JSON");
        assert_eq!(answer["plan"], json!(1));
        assert!(answer["reasoning"].as_str().is_some_and(|r| r.contains("not a language model")));
        assert!(question("1. explore").answer().ends_with("\nPlan: 1"));
    }
}
