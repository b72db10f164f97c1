//! Promises: the memory at a frame is that of an agent that plays the episode; it ends where the agent
//! does not act as recorded; agents that cannot run in a page have none.

use chaic_core::AgentId;
use chaic_env::narration::ActivityKind;

use crate::player::tests::{played, verified};
use crate::player::{ReplayPlayer, RerunState};

/// Opens a replay and runs its agents to the end.
fn rerun(trace: &str, episode: &str) -> (ReplayPlayer, RerunState) {
    let mut player = verified(trace, episode).unwrap();
    loop {
        let state = player.rerun_agents().unwrap();
        if state.is_complete {
            return (player, state);
        }
    }
}

#[test]
fn both_agents_run_again_and_remember_more_and_more() {
    let (trace, episode) = played("shopping/test/00", "infer", 450);
    let (mut player, state) = rerun(&trace, &episode);
    assert_eq!(state.frame, player.info().last_frame);
    let n_equal: usize = state.agents.iter().map(|agent| agent.n_equal).sum();
    let decisions = player.info().decisions;
    let n_of_both = decisions.iter().filter(|line| line.agent <= AgentId::HELPER).count();
    assert_eq!(n_equal, n_of_both, "{state:?}");
    assert!(state.agents.iter().all(|agent| agent.is_available && agent.differs_at.is_none()));
    for agent in [AgentId::PARTNER, AgentId::HELPER] {
        let mut seen_m2 = 0.0;
        for frame in [60, 200, 400] {
            player.seek(frame).unwrap();
            let memory = player.memory(agent).unwrap();
            assert!(memory.seen_m2 >= seen_m2 && memory.frame <= frame, "{agent} {memory:?}");
            seen_m2 = memory.seen_m2;
            let cells = player.explored(agent);
            assert!(cells.len().is_multiple_of(memory.n_columns));
            let n_seen = cells.iter().filter(|cell| **cell != 0).count();
            assert!((n_seen as f32 * 0.125 * 0.125 - seen_m2).abs() < 0.01);
            // Some objects stand beside the part that the map shows.
            assert!(memory.objects.iter().all(|object| object.at.iter().all(|x| x.abs() < 5.0)));
            let is_on_map = |[x, y]: [f32; 2]| (-0.1..1.1).contains(&x) && (-0.1..2.0).contains(&y);
            assert!(memory.path.iter().all(|at| is_on_map(*at)), "{memory:?}");
        }
        assert!(seen_m2 > 1.0);
    }
    let helper = player.memory(AgentId::HELPER).unwrap();
    assert_eq!(helper.is_belief_equal, Some(true));
    assert!(helper.objects.iter().all(|object| object.wanted.is_some()));
    assert!(player.memory(AgentId::CHILD).is_none());
}

#[test]
fn a_path_is_shown_while_an_agent_walks() {
    let (trace, episode) = played("no_constraint/test/00", "rhp", 450);
    let (mut player, _) = rerun(&trace, &episode);
    let walks = player.info().timeline.activities;
    let of_helper = walks.iter().filter(|activity| activity.agent == AgentId::HELPER);
    let mut n_paths = 0;
    for walk in of_helper.filter(|activity| activity.kind == ActivityKind::Walk) {
        player.seek(u32::midpoint(walk.start, walk.end)).unwrap();
        let memory = player.memory(AgentId::HELPER).unwrap();
        n_paths += usize::from(memory.path.len() > 1 && memory.path_m > 0.0);
    }
    assert!(n_paths > 0);
}

#[test]
fn nothing_is_shown_before_the_agents_have_run() {
    let (trace, episode) = played("no_constraint/test/00", "rhp", 300);
    let mut player = verified(&trace, &episode).unwrap();
    player.seek(200).unwrap();
    assert!(player.memory(AgentId::PARTNER).is_none());
    assert!(player.explored(AgentId::PARTNER).is_empty());
    player.rerun_agents().unwrap();
    assert!(player.memory(AgentId::PARTNER).is_none(), "frame 200 is not reached yet");
    player.seek(0).unwrap();
    assert!(player.memory(AgentId::PARTNER).is_some());
}

#[test]
fn another_helper_has_no_memory_from_the_first_different_action_on() {
    let (trace, episode) = played("no_constraint/test/00", "random", 300);
    let other = trace.replacen("\"helper\":\"random\"", "\"helper\":\"rhp\"", 1);
    let (mut player, state) = rerun(&other, &episode);
    let helper = &state.agents[1];
    let differs_at = helper.differs_at.expect("rhp does not act at random");
    player.seek(differs_at).unwrap();
    assert!(player.memory(AgentId::HELPER).is_none());
    player.seek(player.info().last_frame).unwrap();
    assert!(player.memory(AgentId::HELPER).is_none());
    assert!(player.memory(AgentId::PARTNER).is_some(), "the partner acts as recorded");
    let unknown = trace.replacen("\"helper\":\"random\"", "\"helper\":\"mine\"", 1);
    let (player, state) = rerun(&unknown, &episode);
    assert!(!state.agents[1].is_available && state.agents[0].is_available);
    assert!(player.memory(AgentId::HELPER).is_none());
}

#[test]
fn an_agent_that_the_episode_lacks_does_not_run() {
    let (trace, episode) = played("no_constraint/test/00", "rhp", 60);
    let (header, records) = trace.split_once('\n').unwrap();
    let mut header: serde_json::Value = serde_json::from_str(header).unwrap();
    let helper = header["people"][1].clone();
    header["people"] = serde_json::Value::Array(vec![helper]);
    let (_, state) = rerun(&format!("{header}\n{records}"), &episode);
    assert!(state.agents.is_empty(), "{state:?}");
}

#[test]
fn objects_beyond_the_limits_of_the_partner_are_named() {
    let (trace, episode) = played("low_target/test/00", "none", 60);
    let player = verified(&trace, &episode).unwrap();
    let [low_m, high_m] = player.info().agents[0].reach_m;
    let objects = player.task_objects();
    assert!(objects.iter().any(|object| !object.limits.is_empty()), "this task has low objects");
    assert!(objects.iter().any(|object| object.limits.is_empty()));
    for object in objects {
        let is_beyond_reach = object.top_m < low_m || object.top_m > high_m;
        let is_heavy = object.mass_kg > player.info().agents[0].strength_kg;
        assert_eq!(is_beyond_reach || is_heavy, !object.limits.is_empty(), "{object:?}");
    }
}
