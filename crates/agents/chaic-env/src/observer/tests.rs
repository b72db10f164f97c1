use std::collections::BTreeSet;

use chaic_core::Hand;
use chaic_core::observation::Grants;
use chaic_episodes::find_episode;
use chaic_world::Rules;

use super::*;

const SIZE: u32 = 48;
const SENSORS: SensorConfig =
    SensorConfig { image_size: SIZE, rgb: true, ..SensorConfig::DEPTH_AND_IDS };
const ME: AgentId = AgentId::HELPER;

fn world_and_renderer() -> (World, ObservationRenderer) {
    let episode = find_episode("no_constraint/gen/12").expect("a generated episode");
    let setup = Arc::new(episode.setup().clone());
    let world = World::new(setup, Rules::default()).expect("a valid episode");
    let renderer = ObservationRenderer::new(Arc::new(Scene::new(world.setup())));
    (world, renderer)
}

/// Returns the helper's observation with these grants and sensors.
fn observe(
    world: &World,
    renderer: &ObservationRenderer,
    grants: Grants,
    sensors: SensorConfig,
) -> RenderedObservation {
    let slot = AgentSlot::external(grants, sensors);
    renderer.observe(world, &[(ME, &slot)], &mut Vec::new()).remove(0)
}

fn with_ids() -> Grants {
    Grants { ids: true, ..Grants::NONE }
}

/// Returns what an observation resolves a target to.
fn resolved(seen: &RenderedObservation, target: Target) -> EntityId {
    let action = Action::PickUp { object: target, hand: Hand::Left };
    seen.resolve(action).subject().expect("the action has a target")
}

#[test]
fn pixels_resolve_to_what_they_show_and_all_others_to_nothing() {
    let (world, renderer) = world_and_renderer();
    let granted = observe(&world, &renderer, with_ids(), SENSORS);
    let ids = granted.observation.images.ids.clone().expect("ids are granted");
    let unlike = ids.iter().collect::<BTreeSet<_>>();
    assert!(unlike.len() > 4, "{unlike:?}");
    let pixels = observe(&world, &renderer, Grants::NONE, SENSORS);
    assert!(pixels.observation.images.ids.is_none());
    for seen in [&granted, &pixels] {
        for (k, id) in (0..).zip(&ids) {
            let target = Target::Pixel { column: k % SIZE, row: k / SIZE };
            assert_eq!(resolved(seen, target), EntityId(*id));
        }
        for (column, row) in [(SIZE, 0), (0, SIZE), (SIZE, SIZE), (SIZE, SIZE - 1), (u32::MAX, 1)] {
            assert_eq!(resolved(seen, Target::Pixel { column, row }), EntityId::NOTHING);
        }
    }
    let entity = EntityId(*ids.iter().max().expect("there are pixels"));
    assert_eq!(resolved(&granted, Target::Entity(entity)), entity);
    assert_eq!(resolved(&pixels, Target::Entity(entity)), EntityId::NOTHING);
}

#[test]
fn images_are_those_requested_and_ids_those_granted() {
    let (world, renderer) = world_and_renderer();
    for k in 0..16 {
        let [rgb, depth, ids, granted] = [1, 2, 4, 8].map(|bit| k & bit != 0);
        let sensors = SensorConfig { rgb, depth, ids, ..SENSORS };
        let seen = observe(&world, &renderer, Grants { ids: granted, ..Grants::NONE }, sensors)
            .observation;
        let images = seen.images;
        let found = [images.rgb.is_some(), images.depth_m.is_some(), images.ids.is_some()];
        assert_eq!(found, [rgb, depth, ids && granted], "{sensors:?}, granted: {granted}");
    }
}

#[test]
fn hidden_ids_are_reused_with_the_other_images() {
    let (world, renderer) = world_and_renderer();
    let granted = observe(&world, &renderer, with_ids(), SENSORS).into_images();
    assert_eq!(observe(&world, &renderer, Grants::NONE, SENSORS).into_images(), granted);
    assert!(granted.ids.is_some() && granted.rgb.is_some());
}

#[test]
fn the_callers_buffers_get_the_same_images() {
    let (world, renderer) = world_and_renderer();
    let slot = AgentSlot::external(with_ids(), SENSORS);
    let expected = observe(&world, &renderer, with_ids(), SENSORS);
    let n = (SIZE * SIZE) as usize;
    let (mut rgb, mut depth_m, mut ids) = (vec![0; 3 * n], vec![0.0; n], vec![0; n]);
    let images =
        ImagesMut { rgb: Some(&mut rgb), depth_m: Some(&mut depth_m), ids: Some(&mut ids) };
    let seen = renderer.observe_into(&world, ME, &slot, images, Vec::new());
    let Images { rgb: color, depth_m: depth, ids: instances } = expected.observation.images.clone();
    assert_eq!((Some(&rgb), Some(&depth_m)), (color.as_ref(), depth.as_ref()));
    assert_eq!((Some(&ids), &seen.hidden_ids), (instances.as_ref(), &instances));
    assert_eq!(seen.observation.granted, expected.observation.granted);
    assert_eq!(Some(renderer.render_color(&world, ME, SIZE)), color);
}

#[test]
fn ids_drawn_on_demand_equal_those_of_an_observation() {
    let (world, renderer) = world_and_renderer();
    let granted = observe(&world, &renderer, with_ids(), SENSORS);
    let ids = renderer.render_ids(&world, ME, SIZE);
    assert_eq!(Some(ids), granted.observation.images.ids);
}

#[test]
fn visible_entities_are_the_objects_and_people_of_the_image_in_order() {
    let object = |k: u16| EntityId(EntityId::FIRST_OBJECT.0 + k);
    let person = EntityId::FIRST_PERSON;
    let structure = EntityId::WALL.0;
    assert_eq!(visible_entities(&[]), []);
    // Each entity is one pixel: the first or last of a group of 32, within one, and in the remainder.
    for at in [0, 13, 31, 32, 45, 63, 64, 69] {
        for wanted in [person, object(0), object(63), object(64), EntityId(u16::MAX)] {
            let mut ids = vec![structure; 70];
            ids[at] = wanted.0;
            assert_eq!(visible_entities(&ids), [wanted], "{wanted} at {at}");
        }
    }
    let mixed: Vec<u16> = [object(70).0, structure, object(2).0, person.0, object(2).0].repeat(20);
    assert_eq!(visible_entities(&mixed), [person, object(2), object(70)]);
}

#[test]
fn histories_follow_their_schedule_and_drop_the_oldest_image() {
    let (mut world, renderer) = world_and_renderer();
    let spec = |every_frames, max_len| FrameHistorySpec { image_size: 16, every_frames, max_len };
    let frames_of = |history: &VecDeque<HistoryFrame>| -> Vec<u32> {
        history.iter().map(|taken| taken.frame).collect()
    };
    let specs = [spec(2, 3), spec(1, 1), spec(0, 3), spec(2, 0)];
    let mut histories = [const { VecDeque::new() }; 4];
    for _ in 0..9 {
        for (spec, history) in specs.iter().zip(&mut histories) {
            renderer.record_history(&world, ME, *spec, history);
        }
        world.tick();
    }
    assert_eq!(histories.each_ref().map(frames_of), [vec![4, 6, 8], vec![8], vec![], vec![]]);
    let latest = &histories[0][2];
    assert_eq!(latest.images, histories[1][0].images, "buffers that are reused change nothing");
    assert_eq!(latest.images.rgb.as_ref().map(Vec::len), Some(3 * 16 * 16));
    assert!(latest.images.depth_m.is_some() && latest.images.ids.is_none());
}

#[test]
fn the_last_action_is_told_as_it_was_submitted() {
    let (mut world, _) = world_and_renderer();
    let hand = Hand::Left;
    let object = EntityId::FIRST_OBJECT;
    let done = Action::PickUp { object, hand };
    world.submit(ME, done).expect("the helper can decide");
    while world.last_action(ME).is_none() {
        world.tick();
    }
    let pixel = Action::PickUp { object: Target::Pixel { column: 3, row: 4 }, hand };
    let entity = Action::PickUp { object: Target::Entity(object), hand };
    let other = Action::PickUp { object: EntityId(object.0 + 1), hand };
    let told = |grants, submitted| {
        let slot = AgentSlot { submitted, ..AgentSlot::external(grants, SENSORS) };
        last_action(&world, ME, &slot).map(|(action, _)| action)
    };
    assert_eq!(told(Grants::NONE, Some((pixel, done))), Some(pixel));
    // The agent learns of an action that the environment chose only in terms that it may know.
    for submitted in [None, Some((pixel, other))] {
        assert_eq!(told(Grants::NONE, submitted), None);
        assert_eq!(told(with_ids(), submitted), Some(entity));
    }
}
