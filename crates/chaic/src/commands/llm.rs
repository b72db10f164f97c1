//! `chaic llm`, and where `chaic eval` gets its language helpers from.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use anyhow::{Context as _, Result, bail};
use chaic_eval::EvalError;
use chaic_eval::helpers::{NONE, RULES};
use chaic_eval::replay::find_trace;
use chaic_eval::run::RunFolder;
use chaic_eval::trace;
use chaic_llm::language::{
    Language, helper_names, is_language_helper, is_language_partner, partner_names,
};
use chaic_llm::settings::Settings;
use chaic_llm::show::{self, Detail};
use chaic_llm::templates::Templates;
use chaic_llm::{check, session};
use chaic_protocol::AgentId;

use crate::arguments::{EvalArguments, LanguageArguments, LlmCommand};
use crate::exit::Ended;
use crate::output::{complain, say};

/// A flag that nobody raises.
pub fn never() -> &'static AtomicBool {
    static NEVER: AtomicBool = AtomicBool::new(false);
    &NEVER
}

/// Looks after prompts and records.
pub fn run(command: &LlmCommand) -> Result<Ended> {
    match command {
        LlmCommand::Templates { out } => {
            if out.exists() && std::fs::read_dir(out).is_ok_and(|mut d| d.next().is_some()) {
                bail!("{} exists and isn't empty; choose another --out", out.display());
            }
            Templates::load(None)?.write(out)?;
            let out = out.display();
            say(&format!(
                "{out}: the templates of the prompts; edit them, and name the folder in a \
                 configuration file:\n[asking]\ntemplates = \"{out}\"\n"
            ))?;
        }
        LlmCommand::Show { run, episode, helper, seed, agent, brief } => {
            let detail = if *brief { Detail::Brief } else { Detail::Full };
            say(&shown(run, episode, helper.as_deref(), *seed, *agent, detail)?)?;
        }
        LlmCommand::Check { language } => {
            let settings = settings(language, Settings::default())?;
            settings.check()?;
            say(&check::check(&settings)?)?;
        }
    }
    Ok(Ended::Well)
}

fn shown(
    run: &Path,
    episode: &str,
    helper: Option<&str>,
    seed: Option<u32>,
    agent: AgentId,
    detail: Detail,
) -> Result<String> {
    let (folder, options) = RunFolder::read(run)?;
    let asked = |name: &&String| is_language_helper(name) || agent == AgentId::PARTNER;
    let usual = options.helpers.iter().find(asked).map(String::as_str);
    let helper = helper.or(usual).context("no helper of this run asked a language model")?;
    let path = find_trace(&folder, episode, Some(helper), seed)?;
    let (trace, warnings) = trace::read(&path)?;
    for warning in warnings {
        complain(&format!("warning: {warning}"));
    }
    Ok(show::text(run, &trace.header.key(), agent, Some(&trace), detail)?)
}

/// The language helpers of a run; `None` if it needs none.
pub fn language(
    arguments: &EvalArguments,
    path: &Path,
    stop: &'static AtomicBool,
) -> Result<Option<Language>> {
    check_names(arguments)?;
    let given = &arguments.language;
    let names = arguments.helper.iter().flatten();
    let is_named = names.into_iter().any(|n| is_language_helper(n))
        || arguments.partner.as_deref().is_some_and(is_language_partner);
    let recorded = if arguments.resume { session::settings_of(path)? } else { None };
    if !is_named && recorded.is_none() {
        let is_given = given.llm.is_some()
            || given.endpoint.is_some()
            || given.model.is_some()
            || given.llm_config.is_some();
        if is_given && arguments.resume {
            let text = "was begun with no helper or partner that asks a language model; leave the \
                        options of language helpers away to go on, or choose another --out";
            return Err(EvalError::Options(format!("{} {text}", path.display())).into());
        }
        if is_given {
            let text =
                "no helper or partner asks a language model; name one, for example --helper llm";
            return Err(EvalError::Options(text.to_owned()).into());
        }
        return Ok(None);
    }
    if let Some(run) = &given.llm {
        return Ok(Some(Language::replay(run, stop)?));
    }
    let settings = settings(given, recorded.unwrap_or_default())?;
    Ok(Some(Language::live(settings, stop)?))
}

/// Who names nobody known hears of all names, also of those that ask a language model.
fn check_names(arguments: &EvalArguments) -> Result<(), EvalError> {
    let known: Vec<String> = [NONE.to_owned()].into_iter().chain(helper_names()).collect();
    let mut helpers = arguments.helper.iter().flatten();
    if let Some(name) = helpers.find(|name| !known.contains(name)) {
        return Err(EvalError::UnknownHelper { name: name.clone(), known });
    }
    let known: Vec<String> = [RULES.to_owned()].into_iter().chain(partner_names()).collect();
    match arguments.partner.clone().filter(|name| !known.contains(name)) {
        Some(name) => Err(EvalError::UnknownPartner { name, known }),
        None => Ok(()),
    }
}

/// What a file says, and what is said beside it.
fn settings(given: &LanguageArguments, usual: Settings) -> Result<Settings> {
    let mut settings = match &given.llm_config {
        Some(path) => Settings::read(path)?,
        None => usual,
    };
    if let Some(url) = &given.endpoint {
        settings.endpoint.url.clone_from(url);
    }
    if let Some(model) = &given.model {
        settings.asking.model.clone_from(model);
    }
    Ok(settings)
}
