//! Promises: an image shows the belief of the helper in free space, for any texts; a video begins
//! with the first frame and ends with the last one.

use chaic_core::agent::{PartnerBelief, Thought};
use chaic_core::{Action, ClassId};
use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry as _};
use chaic_env::trace::{Decision, End, Record};
use chaic_env::{Digest, EpisodeConfig, RunKey, trace_header};
use chaic_episodes::find_episode;
use image::Rgb;

use super::*;
use crate::run::FolderMode;

/// Color of the bar of a true hypothesis, and of the helper on the map.
const GREEN: [u8; 3] = [20, 150, 70];
const TEAL: [u8; 3] = [16, 136, 140];

fn belief(words: &str) -> PartnerBelief {
    let named = |names: &[&str]| names.iter().map(|name| ((*name).to_owned(), 250)).collect();
    PartnerBelief {
        goals: named(&["fruit", "bread", "work", "school"]),
        people: named(&["adult", "child", "wheelchair"]),
        extra: vec![ClassId::named("key")],
        position_cm: Some([0, 0]),
        evidence: vec![words.to_owned()],
        plan: vec![words.to_owned(); 6],
        partner_plan: vec![words.to_owned(); 6],
    }
}

/// Trace of one frame with the first decision of a helper with this belief.
fn short_trace(id: &str, belief: Option<PartnerBelief>) -> (Trace, Episode) {
    let episode = find_episode(id).unwrap();
    let config = EpisodeConfig::new(&episode, "infer");
    let helper = BuiltInHelpers.make("infer", config.rules.planner);
    let header = trace_header(config, helper).unwrap();
    let mut trace = Trace { header, records: Vec::new() };
    let digest = Digest(Replay::new(&trace, &episode).unwrap().world().digest());
    let belief = belief.map(Box::new);
    let thought = Some(Thought { plan: "explore".to_owned(), belief, ..Thought::default() });
    let (agent, action) = (AgentId::HELPER, Action::TurnLeft);
    trace.records.push(Record::Decision(Decision { frame: 0, agent, action, digest, thought }));
    trace.records.push(Record::End(End {
        frame: 1,
        done: 0.0,
        total: 1.0,
        complete: false,
        away_frames: 0,
        stuck_frames: 0,
        digest,
    }));
    (trace, episode)
}

/// Renders the frame after the first decision of a helper with this belief.
fn render(id: &str, belief: Option<PartnerBelief>) -> RgbImage {
    let (trace, episode) = short_trace(id, belief);
    let mut replay = Replay::new(&trace, &episode).unwrap();
    assert!(replay.step().unwrap());
    replay.render(None)
}

fn count(image: &RgbImage, color: [u8; 3]) -> usize {
    image.pixels().filter(|pixel| **pixel == Rgb(color)).count()
}

#[test]
fn a_belief_adds_bars_and_a_ring_on_the_map() {
    let without = render("high_goal/test/00", None);
    let with = render("high_goal/test/00", Some(belief("pick up apple #31")));
    assert_eq!(without.dimensions(), with.dimensions());
    // Two bars of true hypotheses with 25 % of about 90 pixels, 9 pixels high.
    assert!(count(&with, GREEN) > count(&without, GREEN) + 300);
    assert!(count(&with, TEAL) > count(&without, TEAL), "the ring");
    let has_margin = |image: &RgbImage| {
        let mut margin = image.enumerate_pixels().filter(|(_, y, _)| *y >= HEIGHT_PX - 6);
        margin.all(|(_, _, pixel)| *pixel == Rgb([250, 250, 248]))
    };
    // Streets have a child and a wide map. Long texts end before the margin.
    for id in ["high_goal/test/00", "shopping/test/00", "moving_house/test/00"] {
        let image = render(id, Some(belief("a long description of an operation")));
        assert!(has_margin(&image), "{id}");
    }
}

#[test]
fn a_video_begins_with_the_first_frame_and_ends_with_the_last() {
    let (trace, episode) = short_trace("high_goal/test/00", None);
    let mut replay = Replay::new(&trace, &episode).unwrap();
    let first = replay.render(None);
    let mut images: Vec<RgbImage> = Vec::new();
    let mut sink = |image: &RgbImage| -> Result<()> {
        images.push(image.clone());
        Ok(())
    };
    let mut progress = |_: Frame| ControlFlow::Continue(());
    let flow = draw_images(&mut replay, 30, None, &mut progress, &mut sink).unwrap();
    assert!(flow.is_continue());
    let last = replay.render(None);
    assert!(first != last, "the header shows the frame");
    assert!(images == [first, last], "{} images", images.len());
}

#[test]
fn the_lowest_seed_is_selected_by_its_number() {
    let dir = tempfile::tempdir().unwrap();
    let (folder, _) = RunFolder::lock(&dir.path().join("run"), FolderMode::New).unwrap();
    let trace = |helper: &str, seed| {
        let (task, helper) = (TaskId::LowTarget, helper.to_owned());
        folder.trace(&RunKey { task, helper, episode: "low_target/test/00".to_owned(), seed })
    };
    for (helper, seed) in [("rhp", 1), ("infer", 10), ("infer", 2), ("infer", 31)] {
        let path = trace(helper, seed);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, "").unwrap();
    }
    let traces = folder.traces().unwrap();
    let find = |helper| find_trace(&folder, &traces, "low_target/test/00", helper, None).unwrap();
    assert_eq!(find(None), trace("infer", 2));
    assert_eq!(find(Some("rhp")), trace("rhp", 1));
}

#[test]
fn own_helpers_are_preferred_then_the_strongest_of_the_table() {
    let order = ["nearest", "infer", "rhp", "none", "infer_known_goal"];
    let ranks = order.map(preference);
    assert!(ranks.is_sorted_by(|a, b| a < b), "{ranks:?}");
}
