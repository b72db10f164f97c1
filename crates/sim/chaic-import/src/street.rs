//! Outdoor episodes: objects of the commands in the original's street.
//!
//! Tents, shelves, hydrant, truck and bicycle come from the commands and are exact. The street was
//! measured in the two published images, whose cameras are known. Edges of road and pavement are
//! accurate to 0.1 m, and to 0.5 m on the left side (the mirror image); objects along the street to
//! 0.5 m. Houses are only approximate. No task depends on this scenery.

use chaic_core::catalogue::Role;
use chaic_core::geom::Rect;
use chaic_core::task::SceneKind;
use chaic_core::{ClassId, Vec3};
use chaic_world::{Floor, FloorMaterial, ObjectSpec, Room, RoomKind, Setup};

use crate::dataset::Source;
use crate::package::Package;
use crate::settle::{RestConstraint, Surroundings};
use crate::{ImportError, axes, common};

/// Areas that agents map, `[x_min, z_min, x_max, z_max]` (exact: the original's settings).
const SHOPPING: [f32; 4] = [-3.0, -6.0, 25.0, 7.5];
const MOVING_HOUSE: [f32; 4] = [-5.0, -6.0, 19.0, 7.5];
/// Yaws at the start in Unity's degrees: rider, helper, child. They are 0 in the other task.
const SHOPPING_YAWS_DEG: [f32; 3] = [270.0, 0.0, 225.0];

/// Distance that the ground extends beyond the bounds, meters: its edge is not visible.
const GROUND_M: f32 = 40.0;
const GRASS: [u8; 3] = [75, 95, 45];
/// Strips along x: range of z, material, color.
const STRIPS: [([f32; 2], FloorMaterial, [u8; 3]); 6] = [
    ([5.09, 5.29], FloorMaterial::Pavement, [140, 140, 135]),
    ([-3.86, -3.66], FloorMaterial::Pavement, [140, 140, 135]),
    ([7.0, 8.5], FloorMaterial::Pavement, [150, 145, 135]),
    ([-7.1, -5.55], FloorMaterial::Pavement, [150, 145, 135]),
    ([-3.66, 5.09], FloorMaterial::Asphalt, [105, 105, 108]),
    ([0.65, 0.79], FloorMaterial::Pavement, [190, 190, 188]),
];
/// Driveways, `[x_min, z_min, x_max, z_max]`.
const DRIVEWAYS: [[f32; 4]; 2] = [[0.5, 5.1, 6.5, 12.0], [17.5, -9.0, 24.0, -3.7]];
/// Objects along the street: class, x and z, yaw in Unity's degrees, height in meters.
const SCENERY: [(&str, [f32; 2], f32, f32); 5] = [
    ("tree", [12.1, 6.1], 0.0, 9.0),
    ("tree", [6.5, -5.2], 60.0, 9.0),
    ("street_lamp", [13.1, -5.3], 0.0, 7.0),
    ("house_front", [4.0, -16.0], 0.0, 7.0),
    ("house_front", [1.0, 15.0], 180.0, 6.0),
];
/// Rows of fences along x, by z.
const FENCES_Z: [f32; 2] = [9.45, -8.7];

/// Returns the initial state of an outdoor episode.
pub(crate) fn setup(source: &Source, package: &Package) -> Result<Setup, ImportError> {
    let is_shopping = source.task.info().scene == SceneKind::Street;
    let bounds = axes::rect(if is_shopping { SHOPPING } else { MOVING_HOUSE });
    let mut setup = Setup {
        task: source.task,
        seed: source.entry.seed,
        horizon: source.task.info().horizon,
        bounds,
        ceiling_m: None,
        rooms: vec![Room { kind: RoomKind::Outdoors, rect: bounds }],
        walls: Vec::new(),
        openings: Vec::new(),
        floors: ground(bounds),
        things: scenery(bounds),
        people: Vec::new(),
        goal: common::goal(source)?,
        goal_places: Vec::new(),
    };
    place_objects(&mut setup, source, package)?;
    let yaws_deg = if is_shopping { SHOPPING_YAWS_DEG } else { [0.0; 3] };
    setup.people = common::people(source, &setup, yaws_deg)?;
    Ok(setup)
}

/// Places furniture first, then the objects on it.
fn place_objects(setup: &mut Setup, source: &Source, package: &Package) -> Result<(), ImportError> {
    let goal_class = source.task.info().goal_places[0];
    let is_shopping = source.task.info().scene == SceneKind::Street;
    let mut goods = Vec::new();
    for i in 0..source.objects.len() {
        let mut object = common::object(source, i, package)?;
        let info = object.class.info();
        if is_shopping && info.is_carriable() {
            goods.push((i, object));
            continue;
        }
        // Furniture is dropped from 0.32 m onto the road, the bicycle from 0.1 m.
        object.position.y = 0.0;
        object.fixed = is_shopping && info.role != Role::Vehicle || !info.is_movable();
        if info.name == goal_class {
            setup.goal_places.push(Setup::entity(setup.things.len()));
        }
        setup.things.push(object);
    }
    let mut surroundings = Surroundings::new(setup);
    for (i, object) in goods {
        let on_board = surroundings
            .height_under(&object)
            .map(|height_m| RestConstraint { height_m, rooms: &[] });
        let laid =
            on_board.and_then(|constraint| surroundings.place_on_furniture(&object, &constraint));
        let object = laid.ok_or_else(|| {
            let problem = "is placed where no board has space for it";
            ImportError::field(&source.commands_path, format!("object {i}, position"), problem)
        })?;
        surroundings.add(&object);
        setup.things.push(object);
    }
    Ok(())
}

fn ground(bounds: Rect) -> Vec<Floor> {
    let all = bounds.expanded(GROUND_M);
    let floor =
        |rect: Rect, material: FloorMaterial, color: [u8; 3]| Floor { rect, material, color };
    let mut floors = vec![floor(all, FloorMaterial::Grass, GRASS)];
    let driveway = |r: &[f32; 4]| floor(axes::rect(*r), FloorMaterial::Pavement, [160, 155, 148]);
    floors.extend(DRIVEWAYS.iter().map(driveway));
    floors.extend(STRIPS.iter().map(|([low, high], material, color)| {
        floor(axes::rect([all.min.x, *low, all.max.x, *high]), *material, *color)
    }));
    floors
}

fn scenery(bounds: Rect) -> Vec<ObjectSpec> {
    let put = |class: &str, [x, z]: [f32; 2], yaw_deg: f32| {
        let position = axes::point(Vec3::new(x, 0.0, z));
        ObjectSpec::new(ClassId::named(class), position, axes::yaw_rad(yaw_deg))
    };
    let mut things: Vec<ObjectSpec> = SCENERY
        .iter()
        .map(|(class, at, yaw_deg, height_m)| {
            let object = put(class, *at, *yaw_deg);
            ObjectSpec { scale: [height_m / object.size_m().y; 3], ..object }
        })
        .collect();
    for z in FENCES_Z {
        let step_m = ClassId::named("fence").info().size_m[0];
        let n = (bounds.size().x / step_m) as u32;
        let x = |k: u32| bounds.min.x + step_m * (k as f32 + 0.5);
        things.extend((0..n).map(|k| put("fence", [x(k), z], if z > 0.0 { 180.0 } else { 0.0 })));
    }
    things
}
