use super::*;

/// Color, depth and ids, with a history of `max_len` images.
fn sensors(image_size: u32, history_image_size: u32, max_len: u32) -> SensorConfig {
    let history =
        Some(FrameHistorySpec { image_size: history_image_size, every_frames: 3, max_len });
    SensorConfig { image_size, rgb: true, depth: true, ids: true, frame_history: history }
}

/// `docs/subprocess-helpers.md` lists these keys for programs in other languages.
#[test]
fn a_granted_object_has_the_documented_keys() {
    let object = ObjectState {
        entity: EntityId(7),
        class: ClassId::named("apple"),
        position_in_world: Vec3::ZERO,
        bottom_m: 0.0,
        top_m: 0.0,
        footprint: Vec::new(),
        holder: Some(AgentId::HELPER),
        container: Some(EntityId(8)),
        is_gone: true,
    };
    let value = serde_json::to_value(object).unwrap();
    let mut keys: Vec<&String> = value.as_object().unwrap().keys().collect();
    keys.sort();
    let expected = [
        "bottom_m",
        "class",
        "container",
        "entity",
        "footprint",
        "holder",
        "is_gone",
        "position_in_world",
        "top_m",
    ];
    assert_eq!(keys, expected);
}

#[test]
fn the_largest_observation_is_bounded() {
    let full = sensors(2048, 128, 256);
    assert_eq!(full.max_observation_bytes(), SensorConfig::MAX_OBSERVATION_BYTES);
    assert_eq!(full.check(), Ok(()));
    let problem = sensors(2048, 129, 256).check().unwrap_err();
    assert!(problem.contains("up to 65 MiB") && problem.contains("at most 64 MiB"), "{problem}");
    let problem = sensors(512, 2048, 256).check().unwrap_err();
    assert!(problem.contains("256 images of 2048 pixels: 7168 MiB"), "{problem}");
    assert_eq!(sensors(16, 2048, 2).check(), Ok(()));
    for wrong in [sensors(15, 16, 1), sensors(2049, 16, 1), sensors(16, u32::MAX, 1)] {
        assert!(wrong.check().unwrap_err().contains("16 to 2048"), "{wrong:?}");
    }
    assert!(sensors(16, 16, 257).check().unwrap_err().contains("at most 256"));
    assert_eq!(sensors(u32::MAX, u32::MAX, u32::MAX).max_observation_bytes(), u64::MAX);
}

#[test]
fn without_the_grant_of_the_state_nothing_is_written() {
    let others = Grants { state: false, ..Grants::ALL };
    let absent = serde_json::to_string(&(others, GrantedInfo::default())).unwrap();
    assert!(!absent.contains("state"), "{absent}");
    let granted = GrantedInfo { state: Some(WorldState::default()), ..GrantedInfo::default() };
    let written = serde_json::to_string(&(Grants::ALL, &granted)).unwrap();
    assert_eq!(
        serde_json::from_str::<(Grants, GrantedInfo)>(&written).unwrap(),
        (Grants::ALL, granted)
    );
    let (grants, granted): (Grants, GrantedInfo) = serde_json::from_str(&absent).unwrap();
    assert_eq!((grants, granted.state), (others, None));
}

#[test]
fn each_grant_has_a_name_and_a_field_of_its_own() {
    for (name, _) in Grants::NONE.named() {
        let grants = Grants::from_names([name]).unwrap();
        let value = serde_json::to_value(grants).unwrap();
        for (other, is_set) in grants.named() {
            assert_eq!(is_set, other == name);
            let written = value.get(other).and_then(serde_json::Value::as_bool);
            assert_eq!(written.unwrap_or(false), is_set, "{value}");
        }
        assert_eq!(serde_json::from_value::<Grants>(value).unwrap(), grants);
        assert_eq!(grants.names_beyond(Grants::NONE), [name]);
        assert_eq!(grants.names_beyond(Grants::ALL), [""; 0]);
        assert!(!Grants::ALL.names_beyond(grants).contains(&name));
    }
    assert!(Grants::ALL.named().iter().all(|(_, is_set)| *is_set));
}

#[test]
fn the_sets_of_grants_are_those_of_the_documentation() {
    let oracle = ["ids", "goal_place", "goal", "progress", "behavior"];
    for (grants, expected) in [
        (Grants::IDS, &oracle[..1]),
        (Grants::PLANNER, &oracle[..2]),
        (Grants::PARTNER, &oracle[..3]),
        (Grants::ORACLE, &oracle[..]),
        (Grants::CHILD, &["ids", "positions"][..]),
    ] {
        assert_eq!(grants.names_beyond(Grants::NONE), expected);
    }
}

#[test]
fn any_channel_is_an_image_and_counts_with_its_bytes() {
    let only = |rgb, depth, ids| SensorConfig { rgb, depth, ids, ..SensorConfig::NONE };
    let n_pixels = u64::from(SensorConfig::IMAGE_SIZE).pow(2);
    for (sensors, bytes_per_pixel) in [
        (only(true, false, false), 3),
        (only(false, true, false), 4),
        (only(false, false, true), 2),
        (only(true, true, true), 9),
        (SensorConfig::NONE, 0),
    ] {
        assert_eq!(sensors.max_observation_bytes(), bytes_per_pixel * n_pixels, "{sensors:?}");
        assert_eq!(sensors.wants_image(), bytes_per_pixel > 0, "{sensors:?}");
    }
}

#[test]
fn a_history_needs_an_interval() {
    let every = |every_frames| {
        let history = FrameHistorySpec { image_size: 16, every_frames, max_len: 1 };
        SensorConfig { frame_history: Some(history), ..SensorConfig::NONE }
    };
    assert!(every(0).check().unwrap_err().contains("every 0 frames"));
    assert_eq!(every(1).check(), Ok(()));
    assert_eq!(SensorConfig::NONE.check(), Ok(()));
}

fn held(in_both_hands: bool) -> Option<HeldObject> {
    let class = ClassId::named("apple");
    let identity = Some(HeldIdentity { entity: EntityId(7), class, contents: Vec::new() });
    Some(HeldObject { n_contents: 0, in_both_hands, identity })
}

fn with_hands(hands: [Option<HeldObject>; 2]) -> Proprioception {
    let pose = Pose { position: Vec3::ZERO, yaw_rad: 0.0 };
    Proprioception { pose, hands, last: None, other_end: None }
}

#[test]
fn furniture_in_both_hands_is_one_object() {
    for (hands, expected) in [
        ([held(true), held(true)], 1),
        ([held(false), held(false)], 2),
        ([held(false), None], 1),
        ([None, held(false)], 1),
        ([None, None], 0),
    ] {
        assert_eq!(with_hands(hands.clone()).held().count(), expected, "{hands:?}");
    }
}

#[test]
fn classes_are_those_of_the_image() {
    let classes = ["apple", "bed"].map(ClassId::named);
    let granted = GrantedInfo {
        classes: vec![(EntityId(7), classes[0]), (EntityId(9), classes[1])],
        ..GrantedInfo::default()
    };
    let found = [6, 7, 8, 9, 10].map(|id| granted.class_of(EntityId(id)));
    assert_eq!(found, [None, Some(classes[0]), None, Some(classes[1]), None]);
}

#[test]
fn without_ids_the_other_grants_remain() {
    let apple = (EntityId(7), ClassId::named("apple"));
    let pose = Pose { position: Vec3::ZERO, yaw_rad: 0.0 };
    let action = ObservedAction {
        agent: AgentId::PARTNER,
        frame: 3,
        action: Action::PutIn,
        outcome: Some(Outcome::Success),
    };
    let seen = Observation {
        frame: 5,
        proprioception: with_hands([held(false), None]),
        camera: Camera {
            eye_in_world: Vec3::Y,
            world_from_camera: glam::Quat::IDENTITY,
            vertical_fov_rad: Camera::EYE_FOV_RAD,
            width: 1,
            height: 1,
        },
        images: Images { rgb: Some(vec![1; 3]), depth_m: Some(vec![2.0]), ids: Some(vec![7]) },
        frame_history: Vec::new(),
        granted: GrantedInfo {
            classes: vec![apple],
            delivered: vec![apple],
            removed: vec![EntityId(8)],
            goal: Some(Goal { targets: vec![(apple.1, 1)] }),
            behavior: vec![action],
            partner_hands: Some([None, None]),
            poses: vec![(AgentId::PARTNER, pose)],
            state: Some(WorldState::default()),
        },
    };
    for progress in [false, true] {
        let mut expected = seen.clone();
        expected.images.ids = None;
        expected.granted.classes.clear();
        expected.granted.removed.clear();
        expected.granted.delivered.truncate(usize::from(progress));
        expected.proprioception.hands =
            [held(false).map(|held| HeldObject { identity: None, ..held }), None];
        let grants = Grants { progress, ..Grants::ALL };
        assert_eq!(seen.without_ids(grants), expected, "progress: {progress}");
    }
}
