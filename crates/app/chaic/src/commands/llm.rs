//! `chaic llm`, and the language helpers of `chaic eval`.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use anyhow::{Context as _, Result, bail};
use chaic_agents::partners::{HabitsError, partner_habits};
use chaic_core::AgentId;
use chaic_env::helper_registry::{NONE, RULES};
use chaic_env::{EnvError, RunKey};
use chaic_eval::EvalError;
use chaic_eval::replay::find_trace;
use chaic_eval::run::RunFolder;
use chaic_llm::endpoint_preset::EndpointPreset;
use chaic_llm::language::{LanguageHelpers, is_language_helper, is_language_partner};
use chaic_llm::settings::Settings;
use chaic_llm::show::{self, Detail};
use chaic_llm::templates::Templates;
use chaic_llm::{check, record, session};
use serde_json::{Value, json};

use super::given_partners::is_partner_file;
use super::{all_helper_names, all_partner_names, require_text, traces_of_plan};
use crate::arguments::{EndpointArguments, EvalArguments, LanguageArguments, LlmCommand};
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, json_path, print, print_result, print_warning, quoted};

/// Returns a stop flag that is never set.
pub fn never() -> &'static AtomicBool {
    static NEVER: AtomicBool = AtomicBool::new(false);
    &NEVER
}

/// Writes templates, prints records or tests an endpoint.
pub fn run(command: &LlmCommand, format: OutputFormat) -> Result<ExitStatus> {
    match command {
        LlmCommand::Templates { out } => {
            if out.exists() && std::fs::read_dir(out).is_ok_and(|mut d| d.next().is_some()) {
                bail!("{} exists and isn't empty; choose another --out", out.display());
            }
            Templates::load(None)?.write(out)?;
            let text = format!(
                "{0}: the templates of the prompts; edit them, and name the folder in a \
                 configuration file:\n[request]\ntemplates = \"{0}\"\n",
                out.display()
            );
            print_result(format, &json!({ "out": json_path(out) }), &text)?;
        }
        LlmCommand::Show { run, episode, helper, seed, agent, brief } => {
            require_text(format, "chaic llm show")?;
            let detail = if *brief { Detail::Brief } else { Detail::Full };
            print(&record_text(run, episode, helper.as_deref(), *seed, *agent, detail)?)?;
        }
        LlmCommand::Check { endpoint } => {
            require_text(format, "chaic llm check")?;
            let settings = preset(endpoint).apply_to(settings_file(endpoint)?.unwrap_or_default());
            settings.check()?;
            let answers = check::check(&settings);
            print(&answers.with_context(|| settings.endpoint.url.clone())?)?;
        }
    }
    Ok(ExitStatus::Success)
}

/// Returns a function that reads the prompts and answers of a run's episodes, for pages.
pub fn shown_language(run: &Path) -> impl Fn(&RunKey) -> Value {
    move |key| serde_json::to_value(show::agents(run, key)).expect("agents have string keys")
}

/// Formats the prompts, answers and choices of one episode run.
fn record_text(
    run: &Path,
    episode: &str,
    helper: Option<&str>,
    seed: Option<u32>,
    agent: AgentId,
    detail: Detail,
) -> Result<String> {
    let (folder, options) = RunFolder::read(run)?;
    let has_record = |name: &&String| is_language_helper(name) || agent == AgentId::PARTNER;
    let default = options.helpers.iter().find(has_record).map(String::as_str);
    let helper = helper.or(default).context("no helper of this run used a language model")?;
    let (traces, _) = traces_of_plan(&folder, &options)?;
    let missing = match find_trace(&folder, &traces, episode, Some(helper), seed) {
        Ok(path) => {
            let (trace, warnings) = folder.read_trace(&path)?;
            for warning in warnings {
                print_warning(&warning.to_string());
            }
            return Ok(show::text(run, &trace.header.key(), agent, Some(&trace), detail)?);
        }
        Err(error @ EvalError::NoTrace { .. }) => error,
        Err(error) => return Err(error.into()),
    };
    // An unfinished episode, or a run with --no-traces.
    let key = record::find(run, episode, helper, seed, agent)?.ok_or(missing)?;
    print_warning("the episode run has no trace, so the events between decisions are unknown");
    Ok(show::text(run, &key, agent, None, detail)?)
}

/// Returns the language helpers of a run; `None` if it needs none.
///
/// # Errors
/// If a name is unknown, the options contradict each other, or settings cannot be read.
pub fn language(
    arguments: &EvalArguments,
    path: &Path,
    stop: &'static AtomicBool,
) -> Result<Option<LanguageHelpers>> {
    check_names(arguments)?;
    let given = &arguments.language;
    // A resumed run supplies the options that are not given. If its folder is unreadable, a later
    // step reports the error.
    let recorded_run = arguments.resume.then(|| RunFolder::read(path).ok()).flatten();
    let recorded_run = recorded_run.map(|(_, options)| options);
    let named_helpers = arguments.helper_names();
    let helpers = named_helpers.as_ref().or(recorded_run.as_ref().map(|o| &o.helpers));
    let partner =
        arguments.partner.as_ref().or(recorded_run.as_ref().and_then(|o| o.partner.as_ref()));
    let is_named = helpers.into_iter().flatten().any(|n| is_language_helper(n))
        || partner.is_some_and(|n| is_language_partner(n));
    let recorded = if arguments.resume { session::settings_of(path)? } else { None };
    if !is_named && recorded.is_none() {
        let is_given = given.llm.is_some() || given.endpoint.llm_config.is_some();
        let is_given = is_given || preset(&given.endpoint) != EndpointPreset::default();
        if is_given && arguments.resume {
            let text = "was started without a language model; omit the options of language helpers \
                        to resume it, or choose another --out";
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
        return Ok(Some(LanguageHelpers::replay(run, stop)?));
    }
    let preset = preset(&given.endpoint);
    let settings = match (settings_file(&given.endpoint)?, recorded) {
        (None, Some(recorded)) => preset.apply_to_recorded(path, recorded)?,
        (file, _) => preset.apply_to(file.unwrap_or_default()),
    };
    Ok(Some(LanguageHelpers::live(settings, stop)?))
}

/// Checks the names of helpers and partner. The error lists all names, with those of language models.
fn check_names(arguments: &EvalArguments) -> Result<(), EnvError> {
    let known: Vec<String> = [NONE.to_owned()].into_iter().chain(all_helper_names()).collect();
    let processes = arguments.commands().into_iter().map(|c| c.name);
    let policies = arguments.policies().map(|(name, _)| name.to_owned());
    let valid: Vec<String> = processes.chain(policies).chain(known.clone()).collect();
    let mut helpers = arguments.helper_names().into_iter().flatten();
    if let Some(name) = helpers.find(|name| !valid.contains(name)) {
        return Err(EnvError::UnknownHelper { name, known });
    }
    arguments.partner.as_deref().map_or(Ok(()), check_partner)
}

/// Checks the name of a partner. The error lists all names, with those of language models.
///
/// # Errors
/// [`EnvError::UnknownPartner`], or [`EnvError::InvalidPartner`] if parameters are wrong.
pub(super) fn check_partner(name: &str) -> Result<(), EnvError> {
    let known: Vec<String> = [RULES.to_owned()].into_iter().chain(all_partner_names()).collect();
    if is_partner_file(name) || known.iter().any(|partner| partner == name) {
        return Ok(());
    }
    match partner_habits(name) {
        Ok(_) => Ok(()),
        Err(HabitsError::Unknown) => Err(EnvError::UnknownPartner { name: name.to_owned(), known }),
        Err(HabitsError::Invalid(problem)) => Err(EnvError::InvalidPartner { problem }),
    }
}

/// Returns the options of language helpers that a resumed run needs again.
pub fn resume_options(given: &LanguageArguments) -> String {
    let LanguageArguments { endpoint, llm } = given;
    let EndpointArguments { endpoint, model, llm_key_env, llm_allow_http, llm_config } = endpoint;
    // A configuration file replaces all recorded settings, including the model.
    let model = model.clone().filter(|_| llm_config.is_some());
    let option = |name: &str, value: Option<String>| {
        value.map_or(String::new(), |value| format!(" {name} {}", quoted(&value)))
    };
    let path = |path: &PathBuf| path.display().to_string();
    [
        option("--endpoint", endpoint.clone()),
        option("--llm-key-env", llm_key_env.clone()),
        if *llm_allow_http { " --llm-allow-http".to_owned() } else { String::new() },
        option("--llm-config", llm_config.as_ref().map(path)),
        option("--model", model),
        option("--llm", llm.as_ref().map(|run| format!("replay:{}", run.display()))),
    ]
    .concat()
}

fn preset(given: &EndpointArguments) -> EndpointPreset {
    EndpointPreset {
        url: given.endpoint.clone(),
        model: given.model.clone(),
        key_env: given.llm_key_env.clone(),
        allow_http: given.llm_allow_http,
    }
}

fn settings_file(given: &EndpointArguments) -> Result<Option<Settings>> {
    Ok(given.llm_config.as_deref().map(Settings::read).transpose()?)
}
