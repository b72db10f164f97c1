//! Templates of prompts, in files that users may edit.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use chaic_files::{create_folders, read_bounded, write_atomically};
use minijinja::syntax::SyntaxConfig;
use minijinja::value::{Serde, Value};
use minijinja::{Environment, UndefinedBehavior};
use serde::Serialize;

use crate::error::{LlmError, Result};
use crate::exchange::ContentHash;
use crate::prompt_context::PromptContext;
use crate::prompt_track::PromptTrack;

/// Maximum size of a template, bytes.
const MAX_TEMPLATE_BYTES: u64 = 1 << 20;
/// Maximum steps of one template: a thousand times those of the built-in ones.
const FUEL: u64 = 2_000_000;

macro_rules! built_in {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../templates/", $name)))),*]
    };
}

/// Built-in templates: file name and text.
pub const BUILT_IN: &[(&str, &str)] = built_in![
    "task.txt",
    "task_known.txt",
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

/// Request at the end of a prompt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PromptQuestion {
    /// Reasoning and choice as JSON.
    Schema,
    /// Reasoning and choice as text.
    Text,
    /// Reasoning only.
    Think,
}

/// All templates of a run.
#[derive(Debug)]
pub struct Templates {
    texts: BTreeMap<String, String>,
    environment: Environment<'static>,
}

impl Templates {
    /// Loads the built-in templates, replaced by those in `folder`.
    ///
    /// # Errors
    /// If a template cannot be read, has an unknown name, or is invalid.
    pub fn load(folder: Option<&Path>) -> Result<Templates> {
        let mut texts: BTreeMap<String, String> =
            BUILT_IN.iter().map(|(n, t)| ((*n).to_owned(), (*t).to_owned())).collect();
        if let Some(folder) = folder {
            let convert = || LlmError::io("list", folder);
            for entry in fs::read_dir(folder).map_err(convert())? {
                let path = entry.map_err(convert())?.path();
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                if path.extension().is_some_and(|e| e == "txt") {
                    texts.insert(name.clone(), read(&path, &name)?);
                }
            }
        }
        let templates = Templates { environment: environment(&texts)?, texts };
        templates.render_samples()?;
        Ok(templates)
    }

    /// Writes all templates into a folder.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        create_folders(folder)?;
        for (name, text) in &self.texts {
            let path = folder.join(name);
            write_atomically(&path, text.as_bytes())?;
        }
        Ok(())
    }

    /// Returns the digest of all templates.
    pub fn hash(&self) -> ContentHash {
        let all = serde_json::to_vec(&self.texts).expect("texts have string keys");
        ContentHash::new(&all)
    }

    /// Renders a prompt: six parts and the request.
    ///
    /// # Errors
    /// If a template is invalid.
    pub fn prompt(&self, facts: &PromptContext, question: PromptQuestion) -> Result<String> {
        let task = match facts.track {
            PromptTrack::Hidden => "task.txt",
            PromptTrack::KnownTask => "task_known.txt",
            PromptTrack::Partner => "task_partner.txt",
        };
        let ask = match question {
            PromptQuestion::Schema => "ask_schema.txt",
            PromptQuestion::Text => "ask_text.txt",
            PromptQuestion::Think => "ask_think.txt",
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
            text += &format!("## {title}\n{}\n\n", self.render(name, facts)?);
        }
        if facts.n_images > 0 {
            text += &format!("{}\n\n", self.render("images.txt", facts)?);
        }
        text += &self.render(ask, facts)?;
        Ok(text)
    }

    /// Renders the second of two requests.
    ///
    /// # Errors
    /// If the template is invalid.
    pub fn choose(&self, facts: &PromptContext) -> Result<String> {
        self.render("ask_choose.txt", facts)
    }

    /// Renders the reply to an invalid answer.
    ///
    /// # Errors
    /// If the template is invalid.
    pub fn repeat(&self, facts: &PromptContext, problem: &str, schema: bool) -> Result<String> {
        #[derive(Serialize)]
        struct Repeat<'a> {
            #[serde(flatten)]
            facts: &'a PromptContext,
            problem: &'a str,
            schema: bool,
        }
        self.render("ask_again.txt", &Repeat { facts, problem, schema })
    }

    fn render<T: Serialize>(&self, name: &str, facts: &T) -> Result<String> {
        let wrong = |e: minijinja::Error| wrong(name, &e);
        let template = self.environment.get_template(name).map_err(wrong)?;
        let text = template.render(Value::from(Serde(facts))).map_err(wrong)?;
        Ok(text.trim().to_owned())
    }

    /// Renders all templates once, so that errors appear before the first episode.
    fn render_samples(&self) -> Result<()> {
        for facts in PromptContext::samples() {
            for question in [PromptQuestion::Schema, PromptQuestion::Text, PromptQuestion::Think] {
                self.prompt(&facts, question)?;
            }
            self.choose(&facts)?;
            for schema in [true, false] {
                self.repeat(&facts, "because", schema)?;
            }
        }
        Ok(())
    }
}

fn environment(texts: &BTreeMap<String, String>) -> Result<Environment<'static>> {
    let mut environment = Environment::new();
    // Set before adding templates: the syntax applies to later ones only.
    let syntax = SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build();
    environment.set_syntax(syntax.expect("the syntax is valid"));
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
    fn built_in_templates_render_with_all_six_parts() {
        let templates = Templates::load(None).unwrap();
        for facts in PromptContext::samples() {
            let prompt = templates.prompt(&facts, PromptQuestion::Schema).unwrap();
            let titles: Vec<&str> = prompt.lines().filter(|l| l.starts_with("## ")).collect();
            assert_eq!(titles.len(), 6, "{prompt}");
            assert!(!prompt.contains("\n\n\n"), "{prompt}");
            assert!(!prompt.contains("{%") && !prompt.contains("{{"), "{prompt}");
        }
    }

    #[test]
    fn a_prompt_states_the_numbers_of_omitted_entries() {
        let templates = Templates::load(None).unwrap();
        let render =
            |facts: &PromptContext| templates.prompt(facts, PromptQuestion::Schema).unwrap();
        let mut facts = PromptContext::samples().swap_remove(0);
        let prompt = render(&facts);
        for expected in [
            "Your actions (the last 1 of 4):",
            "Picked up, as you saw: apple #32 (7 earlier omitted).",
            "Held when last seen: apple #32 (6 more omitted).",
            "Other actions that you saw (the last 1 of 3):",
            "(the nearest 1 of 5):",
            "5 more are omitted",
        ] {
            assert!(prompt.contains(expected), "{expected}: {prompt}");
        }
        facts.map.objects.clear();
        assert!(
            render(&facts).contains("\nUseful objects that you have seen: 4, all omitted here.")
        );
        facts.others[0].n_omitted_picked_up = 0;
        assert!(render(&facts).contains("Picked up, as you saw: apple #32.\n"));
    }

    #[test]
    fn a_partner_is_told_the_limits_of_its_hands() {
        let templates = Templates::load(None).unwrap();
        let render = |facts: &PromptContext| templates.prompt(facts, PromptQuestion::Text).unwrap();
        let mut samples = PromptContext::samples().into_iter();
        let mut facts = samples.find(|f| f.track == PromptTrack::Partner).unwrap();
        let prompt = render(&facts);
        assert!(prompt.contains("\n- You have two hands. Each holds one object.\n- A container ("));
        facts.me.n_hands = 1;
        (facts.me.carries_containers, facts.me.lifts_furniture) = (false, false);
        let prompt = render(&facts);
        assert!(
            prompt.contains("\n- You have one usable hand. It holds one object.\n"),
            "{prompt}"
        );
        assert!(!prompt.contains("two hands") && !prompt.contains("- A container ("), "{prompt}");
        facts.is_moving_house = true;
        let prompt = render(&facts);
        assert!(prompt.contains("\n- You can't lift furniture.\n"), "{prompt}");
        assert!(!prompt.contains("lift it together"), "{prompt}");
    }

    #[test]
    fn a_user_template_replaces_a_built_in_one() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("ask_text.txt"), "Say a number, {{ track }}.").unwrap();
        let templates = Templates::load(Some(dir.path())).unwrap();
        let facts = &PromptContext::samples()[0];
        assert!(
            templates
                .prompt(facts, PromptQuestion::Text)
                .unwrap()
                .ends_with("Say a number, hidden.")
        );
        assert_ne!(templates.hash(), Templates::load(None).unwrap().hash());
        templates.write(&dir.path().join("copy")).unwrap();
        let copy = Templates::load(Some(&dir.path().join("copy"))).unwrap();
        assert_eq!(copy.hash(), templates.hash());
    }

    #[test]
    fn template_errors_are_found_on_loading() {
        for (name, text, expected) in [
            ("map.txt", "one\n{{ nonsense }}", "map.txt: line 2"),
            ("map.txt", "{% for x in map.objects %}", "map.txt"),
            ("plan.txt", "x", "plans.txt"),
            ("ask_again.txt", "{% if not schema %}{{ nonsense }}{% endif %}", "ask_again.txt"),
            // Variables of other tracks.
            ("task.txt", "{{ disclosed.task }}", "task.txt"),
            ("task_known.txt", "{{ wanted[0].name }}", "task_known.txt"),
            (
                "map.txt",
                "{% for a in range(9999) %}{% for b in range(9999) %}x{% endfor %}{% endfor %}",
                "fuel",
            ),
        ] {
            let dir = tempfile::tempdir().unwrap();
            fs::write(dir.path().join(name), text).unwrap();
            let error = Templates::load(Some(dir.path())).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
