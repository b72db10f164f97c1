//! `chaic llm`, and where `chaic eval` gets its language helpers from.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use anyhow::{Context as _, Result, bail};
use chaic_core::AgentId;
use chaic_env::EnvError;
use chaic_env::minds::{NONE, RULES};
use chaic_eval::EvalError;
use chaic_eval::replay::find_trace;
use chaic_eval::run::RunFolder;
use chaic_llm::language::{
    Language, helper_names, is_language_helper, is_language_partner, partner_names,
};
use chaic_llm::named::Named;
use chaic_llm::settings::Settings;
use chaic_llm::show::{self, Detail};
use chaic_llm::templates::Templates;
use chaic_llm::{check, session};

use crate::arguments::{EvalArguments, LanguageArguments, LlmCommand};
use crate::exit::Ended;
use crate::output::{complain, quoted, say};

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
            let settings = named(language).over(file(language)?.unwrap_or_default());
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
    let (trace, warnings) = folder.read_trace(&path)?;
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
    // What isn't said is what the run was begun with; a folder that can't be read says so later.
    let begun = arguments.resume.then(|| RunFolder::read(path).ok()).flatten();
    let begun = begun.map(|(_, options)| options);
    let named_helpers = arguments.helper_names();
    let helpers = named_helpers.as_ref().or(begun.as_ref().map(|o| &o.helpers));
    let partner = arguments.partner.as_ref().or(begun.as_ref().and_then(|o| o.partner.as_ref()));
    let is_named = helpers.into_iter().flatten().any(|n| is_language_helper(n))
        || partner.is_some_and(|n| is_language_partner(n));
    let recorded = if arguments.resume { session::settings_of(path)? } else { None };
    if !is_named && recorded.is_none() {
        let is_given = given.llm.is_some() || given.llm_config.is_some();
        let is_given = is_given || named(given) != Named::default();
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
    let settings = match (file(given)?, recorded) {
        (None, Some(recorded)) => named(given).over_recorded(path, recorded)?,
        (file, _) => named(given).over(file.unwrap_or_default()),
    };
    Ok(Some(Language::live(settings, stop)?))
}

/// Who names nobody known hears of all names, also of those that ask a language model.
fn check_names(arguments: &EvalArguments) -> Result<(), EnvError> {
    let known: Vec<String> = [NONE.to_owned()].into_iter().chain(helper_names()).collect();
    let own = arguments.commands().into_iter().map(|c| c.name);
    let own = own.chain(arguments.policies().map(|(name, _)| name.to_owned()));
    let known_here: Vec<String> = own.chain(known.clone()).collect();
    let mut helpers = arguments.helper_names().into_iter().flatten();
    if let Some(name) = helpers.find(|name| !known_here.contains(name)) {
        return Err(EnvError::UnknownHelper { name, known });
    }
    let known: Vec<String> = [RULES.to_owned()].into_iter().chain(partner_names()).collect();
    match arguments.partner.clone().filter(|name| !known.contains(name)) {
        Some(name) => Err(EnvError::UnknownPartner { name, known }),
        None => Ok(()),
    }
}

/// What is to be said again to go on with a run, of what a run's folder doesn't decide.
pub fn to_resume(given: &LanguageArguments) -> String {
    let LanguageArguments { endpoint, model: _, llm_key_env, llm_allow_http, llm_config, llm } =
        given;
    let option = |name: &str, value: Option<String>| {
        value.map_or(String::new(), |value| format!(" {name} {}", quoted(&value)))
    };
    let path = |path: &PathBuf| path.display().to_string();
    [
        option("--endpoint", endpoint.clone()),
        option("--llm-key-env", llm_key_env.clone()),
        if *llm_allow_http { " --llm-allow-http".to_owned() } else { String::new() },
        option("--llm-config", llm_config.as_ref().map(path)),
        option("--llm", llm.as_ref().map(|run| format!("replay:{}", run.display()))),
    ]
    .concat()
}

fn named(given: &LanguageArguments) -> Named {
    Named {
        url: given.endpoint.clone(),
        model: given.model.clone(),
        key_env: given.llm_key_env.clone(),
        allow_http: given.llm_allow_http,
    }
}

fn file(given: &LanguageArguments) -> Result<Option<Settings>> {
    Ok(given.llm_config.as_deref().map(Settings::read).transpose()?)
}
