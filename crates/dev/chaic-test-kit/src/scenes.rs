//! Handmade worlds for tests, benches and examples.

use chaic_core::briefing::Goal;
use chaic_core::capability::{Gait, Impairments, Persona};
use chaic_core::geom::{Camera, Pose, Rect, yaw_rotation};
use chaic_core::{ClassId, Quat, TaskId, Vec2, Vec3};
use chaic_world::{
    AgentSpec, Arm, Floor, FloorMaterial, ObjectSpec, Opening, Posture, Room, RoomKind, Rules,
    Setup, Wall, World,
};
use std::f32::consts::{FRAC_PI_2, PI};

/// Returns a setup with a floor of 20 by 20 m, one distant person, and a table as goal.
pub fn empty() -> Setup {
    let table = ObjectSpec { fixed: true, ..object("table", 9.0, 9.0, 0.0) };
    Setup {
        task: TaskId::NoConstraint,
        seed: 1,
        horizon: 100,
        bounds: Rect::new([-10.0, -10.0], [10.0, 10.0]),
        ceiling_m: None,
        rooms: Vec::new(),
        walls: Vec::new(),
        openings: Vec::new(),
        floors: vec![floor([-10.0, -10.0], [10.0, 10.0], FloorMaterial::Wood, [190, 160, 120])],
        things: vec![table],
        people: vec![person(Persona::Adult, -9.0, 9.0, 0.0)],
        goal: Goal { targets: vec![(ClassId::named("apple"), 1)] },
        goal_places: vec![Setup::entity(0)],
    }
}

/// Creates the world of a valid setup, with the paper's rules.
pub fn world(setup: Setup) -> World {
    World::new(setup, Rules::paper()).expect("the handmade setup is valid")
}

/// Returns an object of a class on the ground, meters and radians.
pub fn object(class: &str, x: f32, z: f32, yaw_rad: f32) -> ObjectSpec {
    ObjectSpec::new(ClassId::named(class), Vec3::new(x, 0.0, z), yaw_rad)
}

/// Returns a person on the ground, meters and radians.
pub fn person(persona: Persona, x: f32, z: f32, yaw_rad: f32) -> AgentSpec {
    let pose = Pose { position: Vec3::new(x, 0.0, z), yaw_rad };
    AgentSpec::new(persona, pose, 0)
}

/// Returns a floor between two corners (x, z), meters.
pub fn floor(min: [f32; 2], max: [f32; 2], material: FloorMaterial, color: [u8; 3]) -> Floor {
    Floor { rect: Rect::new(min, max), material, color }
}

/// Returns a wall between two points (x, z), meters.
pub fn wall(a: [f32; 2], b: [f32; 2]) -> Wall {
    let (a, b) = (Vec2::from(a), Vec2::from(b));
    Wall { a, b, thickness_m: 0.12, bottom_m: 0.0, top_m: 2.8, color: [232, 226, 214] }
}

/// Returns a camera at (x, y, z) that faces `yaw_rad`, pitched up by `pitch_rad`.
pub fn camera(eye: [f32; 3], yaw_rad: f32, pitch_rad: f32, width: u32, height: u32) -> Camera {
    use chaic_core::geom::math::{cos, sin};
    let pitch = Quat::from_xyzw(sin(0.5 * pitch_rad), 0.0, 0.0, cos(0.5 * pitch_rad));
    Camera {
        eye_in_world: Vec3::from(eye),
        world_from_camera: yaw_rotation(yaw_rad) * pitch,
        vertical_fov_rad: Camera::EYE_FOV_RAD,
        width,
        height,
    }
}

/// Returns a posture at rest.
pub fn posture(persona: Persona, x: f32, z: f32, yaw_rad: f32) -> Posture {
    let c = persona.capability();
    let resting_hand = |side: f32| match c.gait {
        Gait::Roll => Vec3::new(0.33 * side, 0.62, 0.0),
        _ => Vec3::new(0.24 * side, 0.43 * c.height_m, 0.0),
    };
    Posture {
        persona,
        impairments: Impairments::NONE,
        fatigue: 0.0,
        gait: c.gait,
        height_m: c.height_m,
        appearance: 0,
        pose: Pose { position: Vec3::new(x, 0.0, z), yaw_rad },
        moving: false,
        walked_m: 0.0,
        arms: [-1.0, 1.0].map(|side| Arm { hand_in_body: resting_hand(side), grips: false }),
        bend: 0.0,
        stretch: 0.0,
        failing: false,
    }
}

const SIDE: f32 = 4.5;

/// Returns a house of eight rooms, four by two, with about 150 objects.
pub fn house() -> Setup {
    use RoomKind::{Bathroom, Bedroom, Corridor, Kitchen, LivingRoom, Office};
    let mut setup = empty();
    setup.bounds = Rect::new([0.0, 0.0], [4.0 * SIDE, 2.0 * SIDE]);
    setup.ceiling_m = Some(2.8);
    (setup.floors, setup.things) = (Vec::new(), Vec::new());
    let kinds = [Kitchen, LivingRoom, Bedroom, Office, Bathroom, Corridor, Bedroom, LivingRoom];
    for (k, kind) in kinds.into_iter().enumerate() {
        let (x, z) = (SIDE * (k % 4) as f32, SIDE * (k / 4) as f32);
        let (min, max) = ([x, z], [x + SIDE, z + SIDE]);
        setup.rooms.push(Room { kind, rect: Rect::new(min, max) });
        let (material, color) = match kind {
            Kitchen | Bathroom => (FloorMaterial::Tiles, [214, 212, 204]),
            Bedroom => (FloorMaterial::Carpet, [176, 164, 150]),
            _ => (FloorMaterial::Wood, [178, 134, 92]),
        };
        setup.floors.push(floor(min, max, material, color));
        furnish(&mut setup, kind, x, z);
    }
    walls_of_house(&mut setup);
    setup.goal_places = vec![Setup::entity(0)];
    setup.things[0].fixed = true;
    setup.people = vec![
        person(Persona::Wheelchair, 1.6 * SIDE, 0.62 * SIDE, 2.6),
        person(Persona::Helper, 1.3 * SIDE, 0.85 * SIDE, -0.3),
    ];
    setup.goal.targets = vec![(ClassId::named("apple"), 2), (ClassId::named("banana"), 1)];
    setup
}

fn walls_of_house(setup: &mut Setup) {
    let (w, d) = (4.0 * SIDE, 2.0 * SIDE);
    for (a, b) in
        [([0.0, 0.0], [w, 0.0]), ([w, 0.0], [w, d]), ([w, d], [0.0, d]), ([0.0, d], [0.0, 0.0])]
    {
        setup.walls.push(wall(a, b));
    }
    let mut with_door = |a: [f32; 2], b: [f32; 2], rooms: [u32; 2]| {
        let at = |t: f32| [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];
        setup.walls.push(wall(a, at(0.36)));
        setup.walls.push(wall(at(0.64), b));
        setup.walls.push(Wall { bottom_m: 2.1, ..wall(at(0.36), at(0.64)) });
        setup.openings.push(Opening { a: Vec2::from(at(0.36)), b: Vec2::from(at(0.64)), rooms });
    };
    for k in 0..4u32 {
        let x = SIDE * k as f32;
        with_door([x, SIDE], [x + SIDE, SIDE], [k, k + 4]);
        if k > 0 {
            with_door([x, 0.0], [x, SIDE], [k - 1, k]);
            with_door([x, SIDE], [x, 2.0 * SIDE], [k + 3, k + 4]);
        }
    }
}

fn furnish(setup: &mut Setup, kind: RoomKind, x: f32, z: f32) {
    use RoomKind::{Bathroom, Bedroom, Kitchen, LivingRoom, Office};
    let mut put = |class: &str, dx: f32, y: f32, dz: f32, yaw_rad: f32| {
        let mut t = object(class, x + dx, z + dz, yaw_rad);
        t.position.y = y;
        t.variant = (dx * 10.0) as u8;
        setup.things.push(t);
    };
    let small = [
        "apple",
        "banana",
        "orange",
        "bread",
        "burger",
        "loaf_bread",
        "iphone",
        "purse",
        "mouse",
        "pen",
        "calculator",
        "pencil_bucket",
    ];
    match kind {
        Kitchen => {
            put("kitchen_counter", 1.3, 0.0, 0.45, PI);
            put("stove", 2.9, 0.0, 0.45, PI);
            put("refrigerator", 3.9, 0.0, 0.5, PI);
            put("dining_table", 2.2, 0.0, 2.6, 0.0);
            for (dx, dz, yaw) in [(1.6, 3.4, 0.0), (2.8, 3.4, 0.0), (1.6, 1.8, PI), (2.8, 1.8, PI)]
            {
                put("side_chair", dx, 0.0, dz, yaw);
            }
            put("microwave", 1.0, 0.95, 0.45, PI);
            put("trashbin", 0.4, 0.0, 3.9, 0.0);
        }
        LivingRoom => {
            put("long_sofa", 2.2, 0.0, 0.7, PI);
            put("coffee_table", 2.2, 0.0, 1.9, 0.0);
            put("armchair", 0.7, 0.0, 2.4, -FRAC_PI_2);
            put("tv_stand", 2.0, 0.0, 4.0, 0.0);
            put("potted_plant", 4.0, 0.0, 0.5, 0.0);
            put("floor_lamp", 0.4, 0.0, 0.5, 0.0);
            put("rug", 2.2, 0.0, 2.0, 0.0);
        }
        Bedroom => {
            put("bed", 1.5, 0.0, 3.0, 0.0);
            put("nightstand", 3.0, 0.0, 4.0, 0.0);
            put("wardrobe", 3.4, 0.0, 0.5, PI);
            put("vase", 3.0, 0.56, 4.0, 0.0);
        }
        Office => {
            put("desk", 1.3, 0.0, 0.6, PI);
            put("bookshelf", 3.6, 0.0, 0.4, PI);
            put("navy_chair", 1.3, 0.0, 1.5, 0.0);
            put("printer", 1.8, 0.75, 0.5, PI);
            put("cabinet", 4.0, 0.0, 3.0, FRAC_PI_2);
        }
        Bathroom => {
            put("cabinet", 0.6, 0.0, 0.5, PI);
            put("stool", 2.2, 0.0, 2.2, 0.0);
        }
        _ => put("wicker_basket", 3.0, 0.0, 0.6, 0.0),
    }
    for (k, class) in small.iter().enumerate() {
        let (dx, dz) = (0.9 + 0.26 * k as f32, 2.15 + 0.14 * (k % 3) as f32);
        put(class, dx, if kind == Kitchen { 0.76 } else { 0.0 }, dz, 0.7 * k as f32);
    }
}

/// Returns a part of a street: shops, a bicycle, a child, trees.
pub fn street() -> Setup {
    let mut setup = empty();
    setup.task = TaskId::Shopping;
    setup.bounds = Rect::new([-20.0, -14.0], [20.0, 14.0]);
    setup.floors = vec![
        floor([-24.0, -16.0], [24.0, 16.0], FloorMaterial::Grass, [96, 142, 66]),
        floor([-24.0, -9.0], [24.0, 9.0], FloorMaterial::Pavement, [186, 182, 174]),
        floor([-24.0, -4.0], [24.0, 4.0], FloorMaterial::Asphalt, [92, 94, 98]),
    ];
    setup.things.clear();
    for (k, x) in [-12.0, -4.0, 4.0, 12.0].into_iter().enumerate() {
        setup.things.push(object("tent", x, -7.0, PI));
        setup.things.push(object("tree", x + 4.0, -10.0, 0.0));
        setup.things.push(object("house_front", x, -13.5, PI));
        setup
            .things
            .push(ObjectSpec { variant: k as u8, ..object("street_lamp", x + 3.0, -4.6, 0.0) });
    }
    for (class, x, z, yaw) in [
        ("bench", 1.0, -5.0, PI),
        ("mailbox", 6.2, -4.6, PI),
        ("fire_hydrant", -2.0, -4.6, 0.0),
        ("truck", -7.0, 1.0, FRAC_PI_2),
        ("fence", -9.0, -9.5, 0.0),
        ("bike", 0.9, 1.2, 0.0),
        ("wood_basket", 2.2, -4.8, 0.3),
    ] {
        setup.things.push(object(class, x, z, yaw));
    }
    setup.things[0].fixed = true;
    setup.goal_places = vec![Setup::entity(0)];
    setup.people = vec![
        person(Persona::Rider, 1.5, 1.2, 0.2),
        person(Persona::Helper, -1.0, -1.5, 2.4),
        person(Persona::Child, -2.6, -0.6, 2.9),
    ];
    setup
}
