//! A recorded episode is exported to Parquet tables with one row per sampled frame, and the rewards
//! sum up to the transport rate. An interrupted export is a complete data set of fewer episodes.
//! Invalid options are reported before any file is written. A failed export leaves no data set. The
//! card says whether real people decided.

use std::fs::{self, File};
use std::path::Path;

use chaic_core::geom::math;
use chaic_core::{AgentError, AgentId};
use chaic_env::helper_registry::{BuiltInHelpers, find};
use chaic_env::rules::RuleSet;
use chaic_env::trace::{BranchPoint, Record, Trace};
use chaic_env::{AdvanceOutcome, Env, EpisodeConfig};
use chaic_episodes::{Episode, find_episode};
use chaic_export::ExportError;
use chaic_export::lerobot::{LeRobotOptions, LeRobotWriter};
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::{Field, Row};

const OPTIONS: LeRobotOptions =
    LeRobotOptions { agent: AgentId::HELPER, every: 30, image_size: 32 };

/// Records an episode of moving house, the shortest task, with RHP.
fn recorded() -> (Episode, Trace) {
    let episode = find_episode("moving_house/gen/40000001").unwrap();
    let config = EpisodeConfig { image_size: Some(64), ..EpisodeConfig::new(&episode, "rhp") };
    let helper = find(&BuiltInHelpers, "rhp", RuleSet::PAPER.planner).unwrap();
    let mut env = Env::new(config, helper).unwrap();
    let header = env.header().clone();
    let mut records = Vec::new();
    let mut sink = |record: &Record| {
        records.push(record.clone());
        Ok::<(), AgentError>(())
    };
    let outcome = env.run(&false.into(), None, &mut sink).unwrap();
    assert_eq!(outcome, AdvanceOutcome::Ended);
    (episode, Trace { header, records })
}

fn rows(path: &Path) -> Vec<Row> {
    let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
    reader.get_row_iter(None).unwrap().map(|row| row.unwrap()).collect()
}

fn field<'a>(row: &'a Row, name: &str) -> &'a Field {
    row.get_column_iter().find(|(n, _)| *n == name).map(|(_, field)| field).unwrap()
}

fn long(row: &Row, name: &str) -> i64 {
    match field(row, name) {
        Field::Long(x) => *x,
        other => panic!("{name} is {other}"),
    }
}

#[test]
fn an_episode_is_exported_as_a_table_and_a_video() {
    let (episode, trace) = recorded();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("set");
    let mut writer = LeRobotWriter::create(&out, OPTIONS).unwrap();
    for _ in 0..2 {
        assert!(writer.add(&trace, &episode, &mut || true).unwrap());
    }
    // The third episode is interrupted.
    let mut n_calls = 0;
    let mut should_continue = || {
        n_calls += 1;
        n_calls < 5
    };
    assert!(!writer.add(&trace, &episode, &mut should_continue).unwrap());
    let n = writer.finish().unwrap();
    let end = trace.end().unwrap();
    let samples = rows(&out.join("data/chunk-000/file-001.parquet"));
    assert_eq!(samples.len(), (end.frame as usize).div_ceil(30));
    assert_eq!(n, 2 * samples.len());
    let mut total_reward = 0.0;
    for (k, row) in samples.iter().enumerate() {
        assert_eq!(long(row, "frame_index"), k as i64);
        assert_eq!(long(row, "episode_index"), 1);
        assert_eq!(long(row, "index"), (samples.len() + k) as i64);
        let Field::Float(reward) = field(row, "next.reward") else { panic!("{row}") };
        total_reward += f64::from(*reward);
        let Field::ListInternal(state) = field(row, "observation.state") else { panic!("{row}") };
        assert_eq!(state.elements().len(), 9);
        if k == 0 {
            let yaw_rad = episode.setup().people[AgentId::HELPER.index()].pose.yaw_rad;
            let heading = [math::sin(yaw_rad), math::cos(yaw_rad)].map(Field::Float);
            assert_eq!(state.elements()[2..4], heading);
        }
        let is_last = k + 1 == samples.len();
        assert_eq!(field(row, "next.done"), &Field::Bool(is_last));
    }
    assert!((total_reward - end.done / end.total).abs() < 1e-6, "{total_reward}");
    assert!(samples.iter().any(|row| field(row, "plan") == &Field::Str("explore".to_owned())));
    let episodes = rows(&out.join("meta/episodes/chunk-000/file-000.parquet"));
    assert_eq!(episodes.len(), 2);
    assert_eq!(long(&episodes[1], "dataset_from_index"), samples.len() as i64);
    assert_eq!(long(&episodes[1], "length"), samples.len() as i64);
    assert_eq!(rows(&out.join("meta/tasks.parquet")).len(), 1);
    let video_path = out.join("videos/observation.images.ego/chunk-000/file-001.mp4");
    assert!(fs::metadata(video_path).unwrap().len() > 1000);
    let card = fs::read_to_string(out.join("README.md")).unwrap();
    let header = "configs:\n- config_name: default\n  data_files: data/*/*.parquet\n---\n";
    for files in ["`meta/tasks.parquet`", "`meta/episodes/*/*.parquet`", header] {
        assert!(card.contains(files), "{files}: {card}");
    }
    let info: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("meta/info.json")).unwrap()).unwrap();
    assert_eq!((&info["total_frames"], &info["fps"]), (&n.into(), &1.into()));
    let stats: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("meta/stats.json")).unwrap()).unwrap();
    assert_eq!(stats["observation.state"]["mean"].as_array().unwrap().len(), 9);
    // Every fourth pixel of every fourth row, without the images of the interrupted episode.
    let n_pixels = (8 * 8 * n) as f64;
    assert_eq!(stats["observation.images.ego"]["count"][0].as_f64(), Some(n_pixels));
}

/// Returns the first frame of an episode.
fn first_frame() -> (Episode, Trace) {
    let episode = find_episode("moving_house/gen/40000001").unwrap();
    let config = EpisodeConfig { image_size: Some(64), ..EpisodeConfig::new(&episode, "rhp") };
    let helper = find(&BuiltInHelpers, "rhp", RuleSet::PAPER.planner).unwrap();
    let header = Env::new(config, helper).unwrap().header().clone();
    (episode, Trace { header, records: Vec::new() })
}

#[test]
fn the_card_says_whether_real_people_decided() {
    let (episode, simulated) = first_frame();
    let [mut real, mut repeated, mut continued] = [(); 3].map(|()| simulated.clone());
    real.header.people[AgentId::HELPER.index()].input = Some("plans".to_owned());
    repeated.header.people[AgentId::PARTNER.index()].recording =
        Some("0123456789abcdef".to_owned());
    continued.header.branch_of = Some(BranchPoint::new(b"another trace", 1));
    // Returns the statement about personal data, and the number of biases. Only simulated people have a license.
    let described = |traces: &[&Trace]| {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("set");
        let mut writer = LeRobotWriter::create(&out, OPTIONS).unwrap();
        for trace in traces {
            assert!(writer.add(trace, &episode, &mut || true).unwrap());
        }
        writer.finish().unwrap();
        let metadata = fs::read(out.join("croissant.json")).unwrap();
        let metadata: serde_json::Value = serde_json::from_slice(&metadata).unwrap();
        let personal = metadata["rai:personalSensitiveInformation"].as_str().unwrap().to_owned();
        let biases = metadata["rai:dataBiases"].as_array().unwrap().clone();
        let card = fs::read_to_string(out.join("README.md")).unwrap();
        for text in biases.iter().map(|bias| bias.as_str().unwrap()).chain([personal.as_str()]) {
            assert!(card.contains(text), "{text}: {card}");
        }
        let license = metadata["license"].as_str().unwrap();
        let is_simulated = traces.iter().all(|trace| **trace == simulated);
        assert_eq!(card.starts_with("---\nlicense: mit\n"), is_simulated, "{card}");
        assert_eq!(card.starts_with("---\nlicense: other\n"), !is_simulated, "{card}");
        assert_eq!(license == "https://spdx.org/licenses/MIT.html", is_simulated, "{license}");
        assert_eq!(card.contains(license), !is_simulated, "{card}");
        (personal, biases.len())
    };
    let (none, n_biases) = described(&[&simulated]);
    assert!(none.starts_with("None. "), "{none}");
    let (personal, n_with_people) = described(&[&simulated, &real, &continued, &repeated]);
    assert!(personal.contains("In 1 of 4 episodes a real person"), "{personal}");
    assert!(personal.contains("In 2 of 4 episodes an agent repeats or continues"), "{personal}");
    assert!(!personal.contains("None"), "{personal}");
    assert!(n_with_people > n_biases);
    for (trace, is_real) in [(&real, true), (&repeated, false), (&continued, false)] {
        let (personal, _) = described(&[trace]);
        assert_eq!(personal.contains("In 1 of 1 episodes a real person"), is_real, "{personal}");
        assert!(!personal.contains("None"), "{personal}");
    }
}

#[test]
fn creators_are_named_only_if_stated() {
    let (episode, trace) = first_frame();
    let described = |creators: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("set");
        let creators = creators.iter().map(|text| text.parse().unwrap()).collect();
        let mut writer = LeRobotWriter::create(&out, OPTIONS).unwrap().with_creators(creators);
        assert!(writer.add(&trace, &episode, &mut || true).unwrap());
        writer.finish().unwrap();
        let metadata = fs::read(out.join("croissant.json")).unwrap();
        let metadata: serde_json::Value = serde_json::from_slice(&metadata).unwrap();
        (metadata.get("creator").cloned(), fs::read_to_string(out.join("README.md")).unwrap())
    };
    let (none, card) = described(&[]);
    assert!(none.is_none() && !card.contains("Creators"), "{card}");
    let person = serde_json::json!({"@type": "sc:Person", "name": "Ada Lovelace"});
    let (one, _) = described(&["person:Ada Lovelace"]);
    assert_eq!(one.as_ref(), Some(&person));
    let (two, card) = described(&["person:Ada Lovelace", "organization:Lab"]);
    let lab = serde_json::json!({"@type": "sc:Organization", "name": "Lab"});
    assert_eq!(two, Some(serde_json::json!([person, lab])));
    assert!(card.contains("## Creators\n\n- Ada Lovelace\n- Lab\n"), "{card}");
}

#[test]
fn a_failed_export_leaves_nothing_and_can_be_repeated() {
    let (episode, trace) = first_frame();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("set");
    for is_new in [true, false] {
        if !is_new {
            fs::create_dir(&out).unwrap();
        }
        let mut writer = LeRobotWriter::create(&out, OPTIONS).unwrap();
        assert!(writer.add(&trace, &episode, &mut || true).unwrap());
        assert!(out.join("data").is_dir());
        // A file in the place of the folder for metadata.
        fs::write(out.join("meta"), "").unwrap();
        assert!(matches!(writer.finish(), Err(ExportError::File(_))));
        assert_eq!(out.exists(), !is_new, "an existing folder stays");
    }
    assert!(fs::read_dir(&out).unwrap().next().is_none());
    let mut writer = LeRobotWriter::create(&out, OPTIONS).unwrap();
    assert!(writer.add(&trace, &episode, &mut || true).unwrap());
    assert_eq!(writer.finish().unwrap(), 1);
    assert!(out.join("meta/info.json").exists());
}

#[test]
fn invalid_options_are_reported_before_files_are_written() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("something"), "").unwrap();
    let error = LeRobotWriter::create(folder.path(), OPTIONS);
    assert!(matches!(error, Err(ExportError::NotEmpty(_))));
    let out = folder.path().join("set");
    let error = LeRobotWriter::create(&out, LeRobotOptions { every: 7, ..OPTIONS });
    assert!(matches!(error, Err(ExportError::Rate { every: 7, .. })));
    assert!(error.is_err_and(|error| error.is_usage()));
    let error = LeRobotWriter::create(&out, LeRobotOptions { image_size: 33, ..OPTIONS });
    assert!(matches!(error, Err(ExportError::Size(33))));
    assert!(!out.exists());
}
