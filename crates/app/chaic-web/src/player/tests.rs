//! Promises: a frame looks the same however it is reached; an altered trace is shown up to the frame
//! that differs; damaged input gives an error.

use chaic_core::AgentError;
use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry as _};
use chaic_env::{Env, EpisodeConfig};
use chaic_episodes::find_episode;
use serde_json::{Value, json};

use super::*;
use chaic_env::narration::ActivityKind;

/// Plays the first frames of an episode; returns the trace and the episode as files.
pub(crate) fn played(id: &str, helper: &str, n_frames: Frame) -> (String, String) {
    let mut setup = find_episode(id).unwrap().into_setup();
    setup.horizon = n_frames;
    let episode = Episode::new(id, "short", None, setup).unwrap();
    let config = EpisodeConfig { image_size: Some(64), ..EpisodeConfig::new(&episode, helper) };
    let agent = BuiltInHelpers.make(helper, config.rules.planner);
    let mut env = Env::new(config, agent).unwrap();
    let mut lines = vec![env.header().to_line()];
    let stop = std::sync::atomic::AtomicBool::new(false);
    env.run(&stop, None, &mut |record| -> Result<(), AgentError> {
        lines.push(record.to_line());
        Ok(())
    })
    .unwrap();
    (lines.join("\n") + "\n", episode.to_json())
}

/// Opens a replay and re-simulates all of it.
pub(crate) fn verified(
    trace: impl AsRef<[u8]>,
    episode: impl AsRef<[u8]>,
) -> Result<ReplayPlayer, PlayerError> {
    let mut player = ReplayPlayer::open(trace.as_ref(), episode.as_ref())?;
    assert!(player.verify(Frame::MAX));
    Ok(player)
}

#[test]
fn a_frame_is_the_same_however_it_is_reached() {
    let (trace, episode) = played("shopping/test/00", "rhp", 450);
    let mut player = verified(&trace, &episode).unwrap();
    let info = player.info();
    assert_eq!((info.last_frame, info.length, info.problem), (450, 450, None));
    assert!(info.n_verified == info.n_decisions && info.n_decisions > 50);
    assert!(info.agents.len() == 3 && info.total > 0.0);
    let frame = |player: &mut ReplayPlayer| {
        let view = player.draw_view(AgentId::HELPER, 64).unwrap();
        (serde_json::to_string(&player.state()).unwrap(), view, player.draw_map(120))
    };
    player.seek(337).unwrap();
    let expected = frame(&mut player);
    for path in [&[450, 337][..], &[0, 336, 337], &[100, 300, 337], &[9_999, 250, 337]] {
        path.iter().for_each(|to| player.seek(*to).unwrap());
        assert_eq!(frame(&mut player), expected, "{path:?}");
    }
    // Drawing other frames in between changes nothing.
    for path in [[450, 334, 335, 337], [0, 120, 250, 337], [336, 338, 339, 337]] {
        let mut last = None;
        for to in path {
            player.seek(to).unwrap();
            last = Some(frame(&mut player));
        }
        assert!(last.as_ref() == Some(&expected), "{path:?}");
    }
    assert_eq!(expected.1.rgba.len(), 4 * 64 * 64);
    assert_eq!(info.decisions.len(), info.n_decisions);
    assert_eq!(info.trails.iter().map(Vec::len).collect::<Vec<_>>(), [46; 3]);
    let is_on_map = |[x, y]: &[f32; 2]| (0.0..1.0).contains(x) && (0.0..2.0).contains(y);
    assert!(info.trails.iter().flatten().all(is_on_map));
    let activities = &info.timeline.activities;
    assert!(activities.iter().any(|a| a.agent == AgentId::PARTNER && a.kind == ActivityKind::Walk));
    assert!(activities.iter().all(|a| a.start <= a.end));
    assert!(info.timeline.story.iter().any(|line| line.text == "time is up"));
    assert!(player.draw_view(AgentId(7), 64).is_err());
}

#[test]
fn the_value_of_a_goal_has_its_unit() {
    for (id, unit) in [("moving_house/test/00", "kg"), ("shopping/test/00", "")] {
        let (trace, episode) = played(id, "none", 10);
        let player = ReplayPlayer::open(trace.as_bytes(), episode.as_bytes()).unwrap();
        assert_eq!(player.info().unit, unit, "{id}");
    }
}

#[test]
fn an_altered_trace_is_shown_up_to_the_frame_that_differs() {
    let (trace, episode) = played("no_constraint/test/00", "random", 300);
    let line = trace.lines().skip(1).filter(|line| line.contains("\"turn_left\"")).nth(3).unwrap();
    let altered = trace.replacen(line, &line.replace("turn_left", "turn_right"), 1);
    let info = verified(&altered, &episode).unwrap().info();
    let problem = info.problem.as_deref().unwrap_or_default();
    assert!(problem.contains("digest") || problem.contains("too late"), "{problem}");
    assert!(info.last_frame < 300 && info.length == 300 && info.n_verified < info.n_decisions);
    // Neither the decision that differs nor a later one counts.
    let (trace, _) = parse(altered.as_bytes(), Path::new("trace")).unwrap();
    let n_before = trace.decisions().filter(|d| d.frame < info.last_frame).count();
    let n_until = trace.decisions().filter(|d| d.frame <= info.last_frame).count();
    assert!((n_before..n_until).contains(&info.n_verified), "{n_before} {n_until} {info:?}");
}

#[test]
fn damaged_and_foreign_files_are_refused() {
    let (trace, episode) = played("no_constraint/test/00", "none", 300);
    let (_, other) = played("no_constraint/test/01", "none", 60);
    let open = |trace: &str, episode: &str| verified(trace, episode).map(|player| player.info());
    for (trace, episode) in [
        ("", &*episode),
        ("{}", &episode),
        ("nonsense", &episode),
        (&trace[..40], &episode),
        (&trace, ""),
        (&trace, "{\"format\": 3}"),
        (&trace, &other),
    ] {
        assert!(open(trace, episode).is_err(), "{trace:.40} {episode:.40}");
    }
    let cut = open(&trace[..trace.len() * 9 / 10], &episode).unwrap();
    assert!(cut.problem.is_some() && cut.n_verified > 0, "{cut:?}");
}

#[test]
fn a_replay_can_be_shown_while_it_is_verified() {
    let (trace, episode) = played("low_target/test/00", "rhp", 300);
    let mut expected = verified(&trace, &episode).unwrap();
    let mut player = ReplayPlayer::open(trace.as_bytes(), episode.as_bytes()).unwrap();
    let start = player.info();
    assert_eq!((start.last_frame, start.is_complete, start.n_verified), (0, false, 0));
    assert_eq!((start.length, start.n_decisions), (300, expected.info().n_decisions));
    let view = |player: &mut ReplayPlayer, frame| {
        player.seek(frame).unwrap();
        let state = player.state();
        (state.frame, player.draw_view(AgentId::PARTNER, 64).unwrap())
    };
    // A frame that is not verified yet is not shown.
    assert_eq!(view(&mut player, 250), view(&mut expected, 0));
    assert!(!player.verify(130));
    assert_eq!(view(&mut player, 250), view(&mut expected, 130));
    assert!(player.info().n_verified > 0 && !player.info().is_complete);
    while !player.verify(7) {}
    let json = |player: &ReplayPlayer| serde_json::to_string(&player.info()).unwrap();
    assert_eq!(json(&player), json(&expected));
    assert_eq!(view(&mut player, 250), view(&mut expected, 250));
}

#[test]
fn recorded_detections_are_marked_in_the_view() {
    let (trace, episode) = played("low_target/test/00", "rhp", 60);
    let player = verified(&trace, &episode).unwrap();
    let camera =
        View::from_agent(player.current.world(), AgentId::HELPER, 64, Channels::RGB).camera;
    let at_m = |depth_m: f32| {
        let point = camera.eye_in_world - depth_m * camera.rotation().z_axis;
        point.to_array().map(|m| (100.0 * m).round() as i32)
    };
    let perceived = json!([["t7", "apple", at_m(2.0)], ["t8", "bread", at_m(-2.0)]]);
    let lines = trace.lines().map(|line| {
        let mut record: Value = serde_json::from_str(line).unwrap();
        if record[1] == 1 && record[4].is_object() {
            record[4]["perceived"] = perceived.clone();
        }
        record.to_string() + "\n"
    });
    let mut player = verified(lines.collect::<String>(), &episode).unwrap();
    player.seek(1).unwrap();
    let detected = player.state().detected;
    assert!(detected[0].is_empty());
    let [apple] = &detected[1][..] else { panic!("{detected:?}") };
    assert_eq!(apple.label, "apple t7");
    // The helper turns a little in this frame.
    assert!(apple.at.iter().all(|x| (0.3..0.7).contains(x)), "{apple:?}");
}
