//! Random and hostile setups, states and cameras, with checks of their images; used by the fuzz
//! test and the fuzz example.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use chaic_core::briefing::Goal;
use chaic_core::capability::{Eyesight, Gait, IMPAIRMENTS, Persona};
use chaic_core::geom::{Camera, Pose, Rect, yaw_rotation};
use chaic_core::observation::Images;
use chaic_core::rng::RngStream;
use chaic_core::{AgentId, ClassId, EntityId, Frame, Quat, TaskId, Vec2, Vec3};
use chaic_render::geometry::FINEST_LEVEL;
use chaic_render::{Appearance, Channels, MAX_SIDE_PX, Scene, View, floor_plan};
use chaic_world::{
    AgentSpec, AgentState, Arm, Floor, FloorMaterial, ObjectLocation, ObjectSpec, ObjectState,
    Opening, Posture, Room, RoomKind, Rules, Setup, State, Wall, World,
};
use rayon::ThreadPool;

/// A scene with views.
pub struct Case {
    /// Setup, which may be invalid.
    pub setup: Setup,
    /// Positions of all objects and people.
    pub state: State,
    /// Postures of all people.
    pub postures: Vec<Posture>,
    /// Views to render.
    pub views: Vec<View>,
    /// Light and colors.
    pub appearance: Appearance,
}

/// Maximum number of objects that have ids.
pub const N_IDS: usize = (u16::MAX - EntityId::FIRST_OBJECT.0) as usize + 1;

/// Generator of random values, a fraction of which are hostile.
struct InputGenerator {
    rng: RngStream,
    hostile: f32,
}

impl InputGenerator {
    /// Draws a number of at most this magnitude, or a hostile one.
    fn number(&mut self, reach: f32) -> f32 {
        self.between(-reach, reach)
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        const ODD: [f32; 16] = [
            0.0,
            -0.0,
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MAX,
            f32::MIN,
            f32::MIN_POSITIVE,
            -1e-40,
            1e-7,
            -1.0,
            1e4,
            -1e6,
            1e9,
            1e19,
            -1e30,
        ];
        if self.rng.chance(self.hostile) {
            return ODD[self.rng.below(ODD.len())];
        }
        self.rng.range(low, high)
    }

    fn int_up_to(&mut self, max: usize) -> usize {
        self.rng.below(max + 1)
    }

    fn chance(&mut self, p: f32) -> bool {
        self.rng.chance(p)
    }

    fn pick<T: Copy>(&mut self, items: &[T]) -> T {
        items[self.rng.below(items.len())]
    }

    fn flat(&mut self, reach: f32) -> Vec2 {
        Vec2::new(self.number(reach), self.number(reach))
    }

    fn point(&mut self, reach: f32) -> Vec3 {
        Vec3::new(self.number(reach), self.between(0.0, 3.0), self.number(reach))
    }

    fn color(&mut self) -> [u8; 3] {
        [0; 3].map(|_: u8| self.int_up_to(255) as u8)
    }

    /// Draws a rectangle; hostile ones have swapped corners or no area.
    fn rect(&mut self, reach: f32) -> Rect {
        let (a, b) = (self.flat(reach), self.flat(reach));
        if self.chance(self.hostile) {
            return Rect { min: a, max: if self.chance(0.5) { b } else { a } };
        }
        Rect { min: a.min(b), max: a.max(b) }
    }

    fn turn(&mut self) -> Quat {
        if self.chance(self.hostile) {
            let [x, y, z, w] = [0.0; 4].map(|_: f32| self.number(1.0));
            return Quat::from_xyzw(x, y, z, w);
        }
        let yaw = self.rng.range(-PI, PI);
        let [s, c] = [0.4, 0.9];
        let lying = Quat::from_xyzw(s, 0.0, 0.0, c).normalize();
        if self.chance(0.7) { yaw_rotation(yaw) } else { yaw_rotation(yaw) * lying }
    }

    fn setup(&mut self, n_things: usize) -> Setup {
        let reach = 12.0;
        let (n_rooms, n_walls, n_floors) =
            (self.int_up_to(6), self.int_up_to(8), self.int_up_to(5));
        let bounds = self.rect(reach);
        let ceiling_m = if self.chance(0.6) { Some(self.between(2.0, 4.0)) } else { None };
        let rooms: Vec<Room> = (0..n_rooms).map(|_| self.room(reach)).collect();
        let walls: Vec<Wall> = (0..n_walls).map(|_| self.wall(reach)).collect();
        let openings = (0..self.int_up_to(3)).map(|_| self.opening(&walls, n_rooms)).collect();
        let floors = (0..n_floors).map(|_| self.floor(reach)).collect();
        let things = (0..n_things).map(|_| self.object(reach)).collect();
        let people = (0..self.int_up_to(3)).map(|_| self.person(reach)).collect();
        Setup {
            task: TaskId::NoConstraint,
            seed: self.int_up_to(1 << 20) as u64,
            horizon: 100,
            bounds,
            ceiling_m,
            rooms,
            walls,
            openings,
            floors,
            things,
            people,
            goal: Goal { targets: vec![(ClassId::named("apple"), 1)] },
            goal_places: vec![Setup::entity(0)],
        }
    }

    fn room(&mut self, reach: f32) -> Room {
        use RoomKind::{Bathroom, Bedroom, Corridor, Kitchen, LivingRoom, Office, Outdoors};
        let kinds = [Kitchen, LivingRoom, Bedroom, Office, Bathroom, Corridor, Outdoors];
        Room { kind: self.pick(&kinds), rect: self.rect(reach) }
    }

    fn wall(&mut self, reach: f32) -> Wall {
        let a = self.flat(reach);
        let b = match self.int_up_to(4) {
            0 => Vec2::new(a.x, self.number(reach)),
            1 => Vec2::new(self.number(reach), a.y),
            2 if self.hostile > 0.0 => a,
            _ => self.flat(reach),
        };
        Wall {
            a,
            b,
            thickness_m: if self.chance(self.hostile) { 0.0 } else { self.between(0.02, 0.6) },
            bottom_m: if self.chance(0.7) { 0.0 } else { self.between(1.9, 2.2) },
            top_m: self.between(2.3, 3.0),
            color: self.color(),
        }
    }

    /// Draws an opening next to a wall's end, or anywhere.
    fn opening(&mut self, walls: &[Wall], n_rooms: usize) -> Opening {
        let (mut a, mut b) = (self.flat(8.0), self.flat(8.0));
        if !walls.is_empty() && self.chance(0.7) {
            let wall = self.pick(walls);
            (a, b) = (wall.b, wall.b + 0.1 * (wall.b - wall.a));
        }
        let max = if self.hostile > 0.0 { 9 } else { n_rooms };
        Opening { a, b, rooms: [0; 2].map(|_: u32| self.int_up_to(max) as u32) }
    }

    fn floor(&mut self, reach: f32) -> Floor {
        use FloorMaterial::{Asphalt, Carpet, Grass, Pavement, Tiles, Wood};
        let material = self.pick(&[Asphalt, Carpet, Grass, Pavement, Tiles, Wood]);
        Floor { rect: self.rect(reach), material, color: self.color() }
    }

    fn object(&mut self, reach: f32) -> ObjectSpec {
        let class = ClassId::all().nth(self.rng.below(ClassId::all().count()));
        let class = class.expect("the index is below the number of classes");
        let scale = match self.int_up_to(9) {
            0 => [0.0; 3].map(|_: f32| self.between(0.2, 5.0)),
            1 if self.hostile > 0.0 => [0.0; 3]
                .map(|_: f32| self.pick(&[0.0, 1e-9, -1.0, 1.0, 300.0, 1e6, 1e20, f32::NAN])),
            _ => [1.0; 3],
        };
        ObjectSpec {
            class,
            position: self.point(reach),
            yaw_rad: self.number(PI),
            scale,
            seat_m: if self.chance(0.1) { Some(self.between(0.1, 1.0)) } else { None },
            variant: self.int_up_to(255) as u8,
            fixed: self.chance(0.5),
        }
    }

    fn pose(&mut self, reach: f32) -> Pose {
        let position = Vec3::new(self.number(reach), 0.0, self.number(reach));
        Pose { position, yaw_rad: self.number(TAU) }
    }

    fn persona(&mut self) -> Persona {
        use Persona::{Adult, Child, Frail, Helper, Rider, Wheelchair};
        self.pick(&[Adult, Child, Frail, Helper, Rider, Wheelchair])
    }

    fn person(&mut self, reach: f32) -> AgentSpec {
        let appearance = self.int_up_to(255) as u8;
        AgentSpec::new(self.persona(), self.pose(reach), appearance)
    }

    fn state(&mut self, setup: &Setup) -> State {
        let mut things: Vec<ObjectState> = setup
            .things
            .iter()
            .map(|object| ObjectState {
                position: if self.chance(0.3) { self.point(12.0) } else { object.position },
                rotation: self.turn(),
                location: if self.chance(0.05) {
                    ObjectLocation::Broken
                } else {
                    ObjectLocation::Resting { on: None }
                },
                delivered: None,
                delivered_by: None,
                last_holder: None,
                released_at: None,
            })
            .collect();
        if self.chance(self.hostile) {
            // The state may have more or fewer objects than the setup, like a recording of another
            // episode.
            things.truncate(self.int_up_to(things.len()));
            let more = self.int_up_to(3);
            things.extend(things.first().cloned().into_iter().cycle().take(more));
        }
        let people = setup.people.iter().map(|person| AgentState::new(person.pose));
        State {
            frame: self.pick(&[0, 7, 1000, Frame::MAX]),
            objects: things,
            agents: people.collect(),
            joint: None,
            child_away_frames: 0,
            stuck_frames: 0,
            child_is_away: false,
            over: false,
            impairment_states: vec![],
        }
    }

    fn posture(&mut self) -> Posture {
        let persona = self.persona();
        let arms = [-1.0, 1.0].map(|side: f32| {
            let default = Vec3::new(0.24 * side, self.between(0.3, 1.9), self.between(-0.6, 0.3));
            let hand_in_body = if self.chance(self.hostile) { self.point(3.0) } else { default };
            Arm { hand_in_body, grips: self.chance(0.3) }
        });
        let impairments =
            IMPAIRMENTS.map(|i| i.id).into_iter().filter(|_| self.chance(0.2)).collect();
        Posture {
            persona,
            impairments,
            fatigue: self.between(-0.5, 1.5),
            gait: self.pick(&[Gait::Walk, Gait::Roll, Gait::WalkBike]),
            height_m: self.between(0.9, 2.1),
            appearance: self.int_up_to(255) as u8,
            pose: self.pose(8.0),
            moving: self.chance(0.5),
            walked_m: self.between(0.0, 1000.0),
            arms,
            bend: self.between(0.0, 1.0),
            stretch: self.between(0.0, 1.0),
            failing: self.chance(0.2),
        }
    }

    fn side(&mut self) -> u32 {
        match self.int_up_to(19) {
            0 => self.pick(&[0, 1, MAX_SIDE_PX + 1, u32::MAX]),
            1 => 300,
            2 => 128,
            _ => self.int_up_to(70) as u32,
        }
    }

    fn view(&mut self, setup: &Setup) -> View {
        let (mut width, mut height) = (self.side(), self.side());
        match self.int_up_to(99) {
            0 => (width, height) = (MAX_SIDE_PX, 1),
            1 => (width, height) = (1, MAX_SIDE_PX),
            2..30 => (width, height) = (17, 3),
            _ => {}
        }
        let eye_in_world = match self.int_up_to(5) {
            // The camera is inside an object or a wall, or exactly on a corner.
            0 if !setup.things.is_empty() => {
                let object = self.pick(&setup.things);
                object.position + Vec3::new(0.0, 0.5 * object.size_m().y, 0.0)
            }
            1 if !setup.walls.is_empty() => {
                let wall = self.pick(&setup.walls);
                let p = if self.chance(0.5) { wall.a } else { 0.5 * (wall.a + wall.b) };
                Vec3::new(p.x, self.between(0.0, 3.0), p.y)
            }
            2 => {
                Vec3::new(self.number(12.0), self.pick(&[0.0, 2.5, -3.0, 40.0]), self.number(12.0))
            }
            _ => self.point(12.0),
        };
        let pitch = self.pick(&[0.0, -0.3, 0.4, FRAC_PI_2, -FRAC_PI_2]);
        let [s, c] = [(0.5f32 * pitch), (0.5 * pitch)];
        let [s, c] = [chaic_core::geom::math::sin(s), chaic_core::geom::math::cos(c)];
        let level = if self.chance(0.3) {
            yaw_rotation(self.pick(&[0.0, FRAC_PI_2, PI, -FRAC_PI_2]))
        } else {
            self.turn()
        };
        let fov = if self.chance(0.7) { FRAC_PI_2 } else { self.between(0.005, 3.2) };
        let [rgb, depth, ids] = [0.9, 0.8, 0.8].map(|p| self.chance(p));
        View {
            camera: Camera {
                eye_in_world,
                world_from_camera: level * Quat::from_xyzw(s, 0.0, 0.0, c),
                vertical_fov_rad: fov,
                width,
                height,
            },
            channels: Channels { rgb, depth, ids },
            hide: if self.chance(0.4) { Some(AgentId(self.int_up_to(4) as u8)) } else { None },
            hide_ceiling: self.chance(0.2),
            sight: if self.chance(0.1) { Some(self.sight()) } else { None },
        }
    }

    fn sight(&mut self) -> Eyesight {
        Eyesight {
            range_m: self.between(0.1, 20.0),
            blur_rad: self.between(0.0, 0.2),
            field_rad: self.between(0.01, std::f32::consts::PI),
            lowered_rad: 0.0,
        }
    }

    fn appearance(&mut self) -> Appearance {
        match self.int_up_to(3) {
            0 => Appearance::Canonical,
            1 => Appearance::Evening,
            _ => Appearance::Varied { seed: self.int_up_to(1 << 20) as u64 },
        }
    }
}

/// Generates the case of a seed, the same on every machine. One third of the cases has only valid
/// numbers, one third has a few hostile numbers, and one third has many.
pub fn case(seed: u64, n_things: Option<usize>) -> Case {
    let hostile = [0.0, 0.02, 0.25][(seed % 3) as usize];
    let mut generator =
        InputGenerator { rng: RngStream::new(seed, "fuzz of pictures", 0), hostile };
    let n_things = n_things.unwrap_or_else(|| generator.int_up_to(24));
    let setup = generator.setup(n_things);
    let state = generator.state(&setup);
    let n_postures =
        if generator.chance(0.1) { generator.int_up_to(12) } else { setup.people.len() };
    let postures = (0..n_postures).map(|_| generator.posture()).collect();
    let views = (0..1 + generator.int_up_to(4)).map(|_| generator.view(&setup)).collect();
    Case { setup, state, postures, views, appearance: generator.appearance() }
}

/// Renders a case in several ways and checks the images.
///
/// # Panics
/// Panics if a check fails.
pub fn check(case: &Case, [one, three]: &[ThreadPool; 2]) {
    let Case { setup, state, postures, views, appearance } = case;
    let draw = |appearance, views: &[View]| {
        Scene::with_appearance(setup, appearance).render_state(state, postures, views)
    };
    let images = one.install(|| draw(*appearance, views));
    assert_eq!(images.len(), views.len());
    for (view, images) in views.iter().zip(&images) {
        check_view(case, view, images);
    }
    assert!(
        three.install(|| draw(*appearance, views)) == images,
        "the number of threads changes the image"
    );
    // Render again with a scene that has rendered before, each view separately, and with all
    // channels.
    let scene = Scene::with_appearance(setup, *appearance);
    for (view, expected) in views.iter().zip(&images) {
        let alone = scene.render_state(state, postures, &[*view]);
        assert!(alone == [expected.clone()], "{view:?}: the view alone has another image");
        let all = View { channels: Channels::ALL, ..*view };
        let all = &scene.render_state(state, postures, &[all])[0];
        for (requested, is_same, channel) in [
            (view.channels.rgb, all.rgb == expected.rgb, "rgb"),
            (view.channels.depth, all.depth_m == expected.depth_m, "depth"),
            (view.channels.ids, all.ids == expected.ids, "ids"),
        ] {
            assert!(!requested || is_same, "{view:?}: other channels change {channel}");
        }
    }
    check_geometry(case, &scene);
    let default = draw(Appearance::Canonical, views);
    for (a, b) in default.iter().zip(&images) {
        assert!(a.depth_m == b.depth_m && a.ids == b.ids, "{appearance} changes more than color");
    }
}

/// Checks the exported geometry.
fn check_geometry(case: &Case, scene: &Scene) {
    let level = case.state.objects.len() % (FINEST_LEVEL + 1);
    let geometry = scene.geometry(&case.state, &case.postures, level);
    for mesh in &geometry.meshes {
        let n = mesh.positions.len();
        assert_eq!(n, mesh.normals.len());
        for triangle in &mesh.triangles {
            let is_there = triangle.vertices.iter().all(|c| (*c as usize) < n);
            assert!(is_there, "{triangle:?} of a mesh with {n} vertices");
            assert!(
                usize::from(triangle.material) < mesh.materials.len(),
                "{triangle:?} has no material"
            );
        }
    }
    let n = geometry.meshes.len();
    assert!(
        geometry.instances.iter().all(|i| (i.mesh as usize) < n),
        "an instance refers to a missing mesh"
    );
}

fn check_view(case: &Case, view: &View, images: &Images) {
    let Camera { width, height, .. } = view.camera;
    let Channels { rgb, depth, ids } = view.channels;
    if width > MAX_SIDE_PX || height > MAX_SIDE_PX {
        assert!(*images == Images::default(), "an image of {width} x {height} exceeds the limit");
        return;
    }
    let n = width as usize * height as usize;
    assert_eq!(images.rgb.as_ref().map(Vec::len), rgb.then_some(3 * n));
    assert_eq!(images.depth_m.as_ref().map(Vec::len), depth.then_some(n));
    assert_eq!(images.ids.as_ref().map(Vec::len), ids.then_some(n));
    for d in images.depth_m.iter().flatten() {
        // Tolerance for rounding at the near plane.
        let is_seen = *d >= 0.999 * Camera::NEAR_M && *d <= Camera::FAR_M;
        let is_valid = is_seen || (*d == 0.0 && view.sight.is_some());
        assert!(is_valid, "{view:?}: a depth of {d} m");
    }
    for id in images.ids.iter().flatten() {
        let id = EntityId(*id);
        let exists = match id {
            EntityId::NOTHING | EntityId::FLOOR | EntityId::WALL => true,
            EntityId::CEILING => case.setup.ceiling_m.is_some() && !view.hide_ceiling,
            id if id.is_object() => {
                let k = usize::from(id.0 - EntityId::FIRST_OBJECT.0);
                k < case.setup.things.len().min(case.state.objects.len())
            }
            id => {
                let k = usize::from(id.0.saturating_sub(EntityId::FIRST_PERSON.0));
                let is_person = id.0 >= EntityId::FIRST_PERSON.0 && k < case.postures.len();
                is_person && view.hide.map(EntityId::from_agent) != Some(id)
            }
        };
        assert!(exists, "{view:?}: {id} does not exist");
    }
    if let (Some(depth), Some(ids)) = (&images.depth_m, &images.ids) {
        let is_background = |d: f32| d == Camera::FAR_M || (d == 0.0 && view.sight.is_some());
        let sky = |(d, id): (&f32, &u16)| EntityId(*id) != EntityId::NOTHING || is_background(*d);
        assert!(depth.iter().zip(ids).all(sky), "{view:?}: empty pixels must be at the far plane");
    }
}

/// Draws a floor plan, and checks its size and that it is reproducible. Returns whether the random
/// setup is a valid world.
///
/// # Panics
/// Panics if a check fails.
pub fn check_plan(seed: u64) -> bool {
    let hostile = [0.0, 0.01][(seed % 2) as usize];
    let mut generator = InputGenerator { rng: RngStream::new(seed, "fuzz of plans", 0), hostile };
    let n_things = 1 + generator.int_up_to(12);
    let mut setup = generator.setup(n_things);
    setup.things[0].fixed = true;
    if setup.people.is_empty() {
        setup.people.push(generator.person(8.0));
    }
    let n_rooms = setup.rooms.len() as u32;
    setup.openings.retain(|o| o.rooms.iter().all(|k| *k < n_rooms));
    let width = generator.pick(&[0, 1, 63, 64, 65, 100, 300]);
    let appearance = generator.appearance();
    let Ok(world) = World::new(setup, Rules::paper()) else { return false };
    let scene = Scene::with_appearance(world.setup(), appearance);
    let image = floor_plan::draw_scene_plan(&scene, &world, width);
    let widest = width.clamp(64, MAX_SIDE_PX);
    let is_too_high = floor_plan::relative_height(&world) * widest as f32 > MAX_SIDE_PX as f32;
    assert!(image.width() == widest || (is_too_high && image.width() < widest));
    assert!(image == floor_plan::draw_scene_plan(&scene, &world, width));
    true
}

/// Returns pools with one and with three threads.
pub fn pools() -> [ThreadPool; 2] {
    [1, 3].map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("threads"))
}
