//! Promise: any setup, state and camera gives an image of the right size, and the same one each
//! time. `examples/fuzz.rs` tries many more.

use chaic_core::EntityId;
use chaic_render::{Channels, Scene};
use chaic_test_kit::hostile::{N_IDS, case, check, check_plan, pools};

#[test]
fn no_input_breaks_an_image() {
    let pools = pools();
    for seed in 0..120 {
        check(&case(seed, None), &pools);
    }
}

#[test]
fn no_world_breaks_a_floor_plan() {
    let n = (0..60).filter(|seed| check_plan(*seed)).count();
    assert!(n > 5, "only {n} setups became worlds");
}

#[test]
fn objects_without_an_id_are_not_drawn() {
    let mut case = case(0, Some(1));
    let near = case.views[0].camera.eye_in_world;
    (case.setup.walls, case.postures) = (Vec::new(), Vec::new());
    case.setup.things = vec![case.setup.things[0]; N_IDS + 40];
    case.state.objects = vec![case.state.objects[0].clone(); N_IDS + 40];
    case.state.objects[0].position = near;
    check(&case, &pools());
    for view in &mut case.views {
        view.channels = Channels::DEPTH_AND_IDS;
    }
    let geometry = Scene::new(&case.setup).geometry(&case.state, &case.postures, 0);
    let mut ids: Vec<EntityId> = geometry.instances.iter().map(|i| i.entity).collect();
    ids.retain(|id| id.is_object());
    let n = ids.len();
    ids.dedup();
    assert!(n == ids.len() && n == N_IDS, "{n} objects have {} ids", ids.len());
}
