//! The texts of prompts: templates in files that users may edit.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use chaic_files::{read_bounded, write_whole};
use minijinja::syntax::SyntaxConfig;
use minijinja::value::{Serde, Value};
use minijinja::{Environment, UndefinedBehavior};
use serde::Serialize;

use crate::error::{LlmError, Result};
use crate::exchange::ContentHash;
use crate::prompt_context::PromptContext;

/// Longest template that is read, bytes.
const MAX_TEMPLATE_BYTES: u64 = 1 << 20;
/// Steps that filling in one template may take: a thousand times what the built-in ones need.
const FUEL: u64 = 2_000_000;

macro_rules! built_in {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../templates/", $name)))),*]
    };
}

/// The built-in templates: file name and text.
pub const BUILT_IN: &[(&str, &str)] = built_in![
    "task.txt",
    "task_told.txt",
    "task_partner.txt",
    "self.txt",
    "others.txt",
    "progress.txt",
    "map.txt",
    "plans.txt",
    "ask_schema.txt",
    "ask_text.txt",
    "ask_think.txt",
    "ask_choose.txt",
    "ask_again.txt",
    "images.txt",
];

/// Whose prompt it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Track {
    /// A helper that is told neither goal nor constraint.
    Hidden,
    /// A helper that is told what the original's are.
    Told,
    /// The partner.
    Partner,
}

/// What is asked for at the end of a prompt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// Reasoning and choice as JSON.
    Schema,
    /// Reasoning and choice as text.
    Text,
    /// Reasoning alone.
    Think,
}

/// All templates of a run.
#[derive(Debug)]
pub struct Templates {
    texts: BTreeMap<String, String>,
    environment: Environment<'static>,
}

impl Templates {
    /// The built-in templates, those in `folder` in their place.
    ///
    /// # Errors
    /// If one can't be read, has a name that isn't known, or can't be filled in.
    pub fn load(folder: Option<&Path>) -> Result<Templates> {
        let mut texts: BTreeMap<String, String> =
            BUILT_IN.iter().map(|(n, t)| ((*n).to_owned(), (*t).to_owned())).collect();
        if let Some(folder) = folder {
            let refused = || LlmError::io("list", folder);
            for entry in fs::read_dir(folder).map_err(refused())? {
                let path = entry.map_err(refused())?.path();
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                if path.extension().is_some_and(|e| e == "txt") {
                    texts.insert(name.clone(), read(&path, &name)?);
                }
            }
        }
        let templates = Templates { environment: environment(&texts)?, texts };
        templates.try_all()?;
        Ok(templates)
    }

    /// Writes all templates into a folder.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn write(&self, folder: &Path) -> Result<()> {
        fs::create_dir_all(folder).map_err(LlmError::io("make the folder", folder))?;
        for (name, text) in &self.texts {
            let path = folder.join(name);
            write_whole(&path, text.as_bytes())?;
        }
        Ok(())
    }

    /// The hash of all of them.
    pub fn hash(&self) -> ContentHash {
        let all = serde_json::to_vec(&self.texts).expect("texts have string keys");
        ContentHash::of(&all)
    }

    /// The prompt: six parts, and what is asked for.
    ///
    /// # Errors
    /// If a template can't be filled in.
    pub fn prompt(&self, facts: &PromptContext, question: Question) -> Result<String> {
        let task = match facts.track {
            Track::Hidden => "task.txt",
            Track::Told => "task_told.txt",
            Track::Partner => "task_partner.txt",
        };
        let ask = match question {
            Question::Schema => "ask_schema.txt",
            Question::Text => "ask_text.txt",
            Question::Think => "ask_think.txt",
        };
        let parts = [
            ("Task", task),
            ("Yourself", "self.txt"),
            ("The others", "others.txt"),
            ("Progress", "progress.txt"),
            ("What is where", "map.txt"),
            ("Plans", "plans.txt"),
        ];
        let mut text = String::new();
        for (title, name) in parts {
            text += &format!("## {title}\n{}\n\n", self.fill(name, facts)?);
        }
        if facts.images > 0 {
            text += &format!("{}\n\n", self.fill("images.txt", facts)?);
        }
        text += &self.fill(ask, facts)?;
        Ok(text)
    }

    /// The second step of two.
    ///
    /// # Errors
    /// If the template can't be filled in.
    pub fn choose(&self, facts: &PromptContext) -> Result<String> {
        self.fill("ask_choose.txt", facts)
    }

    /// What is said after an answer of no use.
    ///
    /// # Errors
    /// If the template can't be filled in.
    pub fn again(&self, facts: &PromptContext, problem: &str, schema: bool) -> Result<String> {
        #[derive(Serialize)]
        struct Again<'a> {
            #[serde(flatten)]
            facts: &'a PromptContext,
            problem: &'a str,
            schema: bool,
        }
        self.fill("ask_again.txt", &Again { facts, problem, schema })
    }

    fn fill<T: Serialize>(&self, name: &str, facts: &T) -> Result<String> {
        let wrong = |e: minijinja::Error| wrong(name, &e);
        let template = self.environment.get_template(name).map_err(wrong)?;
        let text = template.render(Value::from(Serde(facts))).map_err(wrong)?;
        Ok(text.trim().to_owned())
    }

    /// Fills in everything once, so that a mistake is found before the first episode.
    fn try_all(&self) -> Result<()> {
        for facts in PromptContext::samples() {
            for question in [Question::Schema, Question::Text, Question::Think] {
                self.prompt(&facts, question)?;
            }
            self.choose(&facts)?;
            self.again(&facts, "because", true)?;
        }
        Ok(())
    }
}

fn environment(texts: &BTreeMap<String, String>) -> Result<Environment<'static>> {
    let mut environment = Environment::new();
    // Before the first template: these hold for what is added later only.
    let syntax = SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build();
    environment.set_syntax(syntax.expect("nothing contradicts itself"));
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_auto_escape_callback(|_| minijinja::AutoEscape::None);
    environment.set_fuel(Some(FUEL));
    for (name, text) in texts {
        let added = environment.add_template_owned(name.clone(), text.clone());
        added.map_err(|e| wrong(name, &e))?;
    }
    Ok(environment)
}

fn wrong(name: &str, error: &minijinja::Error) -> LlmError {
    let line = error.line().map_or(String::new(), |n| format!("line {n}: "));
    LlmError::Template { name: name.to_owned(), problem: format!("{line}{error}") }
}

fn read(path: &Path, name: &str) -> Result<String> {
    let wrong = |problem: String| LlmError::Template { name: name.to_owned(), problem };
    if !BUILT_IN.iter().any(|(n, _)| *n == name) {
        let known: Vec<&str> = BUILT_IN.iter().map(|(n, _)| *n).collect();
        return Err(wrong(format!("no template has this name; they are {}", known.join(", "))));
    }
    let bytes = read_bounded(path, MAX_TEMPLATE_BYTES + 1)?;
    if bytes.len() as u64 > MAX_TEMPLATE_BYTES {
        return Err(wrong(format!("is longer than {MAX_TEMPLATE_BYTES} bytes")));
    }
    String::from_utf8(bytes).map_err(|e| wrong(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_ones_can_be_filled_in_and_have_all_six_parts() {
        let templates = Templates::load(None).unwrap();
        for facts in PromptContext::samples() {
            let prompt = templates.prompt(&facts, Question::Schema).unwrap();
            let titles: Vec<&str> = prompt.lines().filter(|l| l.starts_with("## ")).collect();
            assert_eq!(titles.len(), 6, "{prompt}");
            assert!(!prompt.contains("\n\n\n"), "{prompt}");
            assert!(!prompt.contains("{%") && !prompt.contains("{{"), "{prompt}");
        }
    }

    #[test]
    fn a_users_template_takes_the_place_of_a_built_in_one() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("ask_text.txt"), "Say a number, {{ track }}.").unwrap();
        let templates = Templates::load(Some(dir.path())).unwrap();
        let facts = &PromptContext::samples()[0];
        assert!(
            templates.prompt(facts, Question::Text).unwrap().ends_with("Say a number, hidden.")
        );
        assert_ne!(templates.hash(), Templates::load(None).unwrap().hash());
        templates.write(&dir.path().join("copy")).unwrap();
        let copy = Templates::load(Some(&dir.path().join("copy"))).unwrap();
        assert_eq!(copy.hash(), templates.hash());
    }

    #[test]
    fn mistakes_are_found_before_anything_is_asked() {
        for (name, text, words) in [
            ("map.txt", "one\n{{ nonsense }}", "map.txt: line 2"),
            ("map.txt", "{% for x in map.things %}", "map.txt"),
            ("plan.txt", "x", "plans.txt"),
            (
                "map.txt",
                "{% for a in range(9999) %}{% for b in range(9999) %}x{% endfor %}{% endfor %}",
                "fuel",
            ),
        ] {
            let dir = tempfile::tempdir().unwrap();
            fs::write(dir.path().join(name), text).unwrap();
            let said = Templates::load(Some(dir.path())).unwrap_err().to_string();
            assert!(said.contains(words), "{said}");
        }
    }
}
