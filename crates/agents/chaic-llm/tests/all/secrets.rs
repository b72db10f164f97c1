//! A key gets into a request's header and nowhere else, however much an endpoint repeats it.

use chaic_core::{AgentId, TaskId};
use chaic_llm::endpoint::Client;
use chaic_llm::key::Key;
use chaic_llm::language::Language;
use chaic_llm::session::Source;
use chaic_llm::settings::{Kind, Then};
use chaic_llm::show::{self, Detail};
use chaic_llm_standin::{Manner, Options};

use crate::common::{Bench, files, flag, standin};

const KEY: &str = "sk-sesame-0123456789";

#[test]
fn the_key_is_nowhere_to_be_read() {
    let bench = Bench::new(&[TaskId::NoConstraint], 200);
    for (name, right, kind) in [
        ("right", KEY, Kind::Openai),
        ("azure", KEY, Kind::Azure),
        // The stand-in says which key it was given instead.
        ("wrong", "another", Kind::Openai),
    ] {
        let say = |question: &chaic_llm_standin::script::Question| {
            format!("The key is {KEY}, is it?\n{}", question.answer())
        };
        let manner = Manner::Say(Box::new(say));
        let key = Some(right.to_owned());
        let (standin, mut settings) = standin(Options { manner, key, ..Options::default() });
        settings.endpoint.kind = kind;
        settings.faults.then = Then::Pause;
        let client = Client::with_key(&settings, Key::new(KEY));
        let language = Language::with(settings, Source::Live(Box::new(client)), flag()).unwrap();
        let (is_whole, results) = bench.play(name, &bench.given(&["llm"]), &language);
        assert_eq!(is_whole, name != "wrong");
        assert!(standin.seen().requests > 0);
        let mut said = format!("{:?} {:?} {results:?}", language.problem(), language.settings());
        if let Some(result) = results.first() {
            let run = bench.path(name);
            let shown = show::text(&run, &result.key, AgentId::HELPER, None, Detail::Full).unwrap();
            assert!(shown.contains("The key is [key], is it?"), "{shown}");
            said += &shown;
        }
        assert!(!said.contains("sesame"), "{said}");
        let files = files(&bench.path(name));
        assert!(files.len() > 3);
        for (path, bytes) in files {
            let text = String::from_utf8_lossy(&bytes);
            assert!(!text.contains("sesame"), "{} holds the key", path.display());
        }
    }
}

#[test]
fn nobody_gets_key_or_question_by_a_redirect() {
    let bench = Bench::new(&[TaskId::NoConstraint], 100);
    let (other, _) = standin(Options::default());
    let redirects_to = Some(format!("{}/chat/completions", other.url()));
    let (named, mut settings) = standin(Options { redirects_to, ..Options::default() });
    settings.faults.then = Then::Pause;
    let client = Client::with_key(&settings, Key::new(KEY));
    let language = Language::with(settings, Source::Live(Box::new(client)), flag()).unwrap();
    let (is_whole, _) = bench.play("run", &bench.given(&["llm"]), &language);
    assert!(!is_whole);
    assert_eq!((named.seen().requests, other.seen().requests), (1, 0));
    let problem = language.problem().unwrap();
    assert!(problem.contains("307") && problem.contains("redirects to"), "{problem}");
}
