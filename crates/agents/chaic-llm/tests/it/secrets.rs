//! Promise: a key is in the request header only, even if an endpoint repeats it.

use chaic_core::{AgentId, TaskId};
use chaic_llm::endpoint::Client;
use chaic_llm::key::ApiKey;
use chaic_llm::language::LanguageHelpers;
use chaic_llm::session::AnswerSource;
use chaic_llm::settings::{EndpointKind, FailureAction};
use chaic_llm::show::{self, Detail};
use chaic_llm_standin::{Options, ResponseMode};

use crate::common::{Fixture, files, flag, standin};

const KEY: &str = "sk-sesame-0123456789";

#[test]
fn no_output_or_file_contains_the_key() {
    let fixture = Fixture::new(&[TaskId::NoConstraint], 200);
    for (name, right, kind) in [
        ("right", KEY, EndpointKind::Openai),
        ("azure", KEY, EndpointKind::Azure),
        // The stand-in reports the wrong key.
        ("wrong", "another", EndpointKind::Openai),
    ] {
        let answer = |question: &chaic_llm_standin::script::Question| {
            format!("The key is {KEY}, is it?\n{}", question.answer())
        };
        let response_mode = ResponseMode::Function(Box::new(answer));
        let key = Some(right.to_owned());
        let (standin, mut settings) = standin(Options { response_mode, key, ..Options::default() });
        settings.endpoint.kind = kind;
        settings.retry.on_failure = FailureAction::Pause;
        let client = Client::with_key(&settings, ApiKey::new(KEY));
        let language =
            LanguageHelpers::with(settings, AnswerSource::Live(Box::new(client)), flag()).unwrap();
        let (is_complete, results) = fixture.play(name, &fixture.request(&["llm"]), &language);
        assert_eq!(is_complete, name != "wrong");
        assert!(standin.stats().requests > 0);
        let mut output = format!("{:?} {:?} {results:?}", language.problem(), language.settings());
        if let Some(result) = results.first() {
            let run = fixture.path(name);
            let shown = show::text(&run, &result.key, AgentId::HELPER, None, Detail::Full).unwrap();
            assert!(shown.contains("The key is [key], is it?"), "{shown}");
            output += &shown;
        }
        assert!(!output.contains("sesame"), "{output}");
        let files = files(&fixture.path(name));
        assert!(files.len() > 3);
        for (path, bytes) in files {
            let text = String::from_utf8_lossy(&bytes);
            assert!(!text.contains("sesame"), "{} holds the key", path.display());
        }
    }
}

#[test]
fn redirects_are_not_followed() {
    let fixture = Fixture::new(&[TaskId::NoConstraint], 100);
    let (other, _) = standin(Options::default());
    let redirects_to = Some(format!("{}/chat/completions", other.url()));
    let (named, mut settings) = standin(Options { redirects_to, ..Options::default() });
    settings.retry.on_failure = FailureAction::Pause;
    let client = Client::with_key(&settings, ApiKey::new(KEY));
    let language =
        LanguageHelpers::with(settings, AnswerSource::Live(Box::new(client)), flag()).unwrap();
    let (is_complete, _) = fixture.play("run", &fixture.request(&["llm"]), &language);
    assert!(!is_complete);
    assert_eq!((named.stats().requests, other.stats().requests), (1, 0));
    let problem = language.problem().unwrap();
    assert!(problem.contains("307") && problem.contains("redirects to"), "{problem}");
}
