//! Map of a world for people: a top view without ceilings, with labels.

use chaic_core::geom::Rect;
use chaic_core::{AgentId, EntityId, Role, Vec2, Vec3};
use chaic_world::{ObjectLocation, Room, RoomKind, Wall, World};
use image::{Rgb, RgbImage};

use crate::draw::{Exclusions, Scratch, draw as draw_scene};
use crate::paint::{blend, circle, disk, for_pixels_between, line, triangle};
use crate::people::Body;
use crate::projection::Projection;
use crate::scene::Scene;
use crate::shade::{OutputImages, shade};
#[cfg(feature = "text")]
use crate::text;
use crate::text_label::{Align, TextLabel};
use crate::view::{MAX_SIDE_PX, with_scratch};

/// Height of the camera, meters: above every roof and tree.
const EYE_M: f32 = 60.0;
const INK: [u8; 3] = [30, 32, 38];
const BACKGROUND: [u8; 3] = [250, 250, 248];
const TARGET: [u8; 3] = [214, 40, 120];
const GOAL: [u8; 3] = [20, 150, 70];
const CONTAINER: [u8; 3] = [230, 140, 20];
const OBSTACLE: [u8; 3] = [120, 60, 200];
/// Colors of partner, helper and child; further agents have the color of the child.
const PEOPLE: [[u8; 3]; 3] = [[208, 64, 40], [16, 136, 140], [214, 160, 10]];

/// Renders the map of a world, `width_px` wide (see [`FloorPlan::new`]), with a legend below. It
/// shows room names, walls, target objects (rings), containers and obstacles, the goal place
/// (frame), and the pose of each agent.
#[cfg(feature = "text")]
pub fn draw(world: &World, width_px: u32) -> RgbImage {
    draw_scene_plan(&Scene::new(world.setup()), world, width_px)
}

/// Renders the map with an existing scene.
#[cfg(feature = "text")]
pub fn draw_scene_plan(scene: &Scene, world: &World, width_px: u32) -> RgbImage {
    FloorPlan::new(world, width_px).draw(scene, world)
}

/// Map of one width with the parts that do not change during an episode, for programs that draw many
/// frames.
#[derive(Clone, Debug)]
pub struct FloorPlan {
    width: u32,
    height: u32,
    /// Tinted pixels of each room.
    rooms: Vec<TintedRoom>,
}

/// Pixels of a room without its walls.
#[derive(Clone, Debug)]
struct TintedRoom {
    kind: RoomKind,
    /// Start and end of rows of pixels, as indices row by row.
    runs: Vec<(u32, u32)>,
}

impl FloorPlan {
    /// Prepares the map of a world, `width_px` wide (between 64 and [`MAX_SIDE_PX`]). The map of a
    /// world so deep that it would be higher than [`MAX_SIDE_PX`] is narrower.
    pub fn new(world: &World, width_px: u32) -> FloorPlan {
        let widest = (MAX_SIDE_PX as f32 / relative_height(world)) as u32;
        let width = width_px.clamp(64, MAX_SIDE_PX).min(widest.max(1));
        let map = Map::new(world, width);
        let height = (map.area.size().y * map.px_per_m) as u32;
        let height = height.clamp(1, MAX_SIDE_PX);
        let rooms = tinted_rooms(world, &map, width, height);
        FloorPlan { width, height, rooms }
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Renders the current frame of the world.
    #[cfg(feature = "text")]
    pub fn draw(&self, scene: &Scene, world: &World) -> RgbImage {
        let (mut image, labels) = self.draw_without_text(scene, world);
        for label in &labels {
            text::draw_label(&mut image, label);
        }
        image
    }

    /// Renders the current frame of the world, and returns the text that belongs on it.
    pub fn draw_without_text(&self, scene: &Scene, world: &World) -> (RgbImage, Vec<TextLabel>) {
        let map = Map::new(world, self.width);
        let mut image = render_base(scene, world, &map, self.width, self.height);
        self.tint_rooms(&mut image);
        mark_objects(&mut image, world, &map);
        let mut labels = mark_people(&mut image, world, &map);
        labels.extend(room_labels(world, &map, self.width));
        let (image, legend) = with_legend(&image, world);
        labels.extend(legend);
        (image, labels)
    }

    /// Lightens everything but the walls, so that markers stand out, and colors it by the room.
    fn tint_rooms(&self, image: &mut RgbImage) {
        let pixels = image.as_chunks_mut::<3>().0;
        for TintedRoom { kind, runs } in &self.rooms {
            let color = room_color(*kind);
            for (start, end) in runs {
                for pixel in &mut pixels[*start as usize..*end as usize] {
                    blend(pixel, [255; 3], 0.16);
                    blend(pixel, color, 0.2);
                }
            }
        }
    }
}

/// Marks on a map of [`FloorPlan`] the position (x, z) at which an agent believes another
/// one: a ring in the color of the believing agent. The ring is wider than the disk of a person, so
/// that both are visible at one place.
pub fn mark_believed_position(
    image: &mut RgbImage,
    world: &World,
    believer: AgentId,
    position_in_world: Vec2,
) {
    let map = Map::new(world, image.width());
    let at = map.px_from_xz(position_in_world);
    let stroke_px = (0.0045 * image.width() as f32).max(2.0);
    let radius = 1.7 * person_radius_px(image, &map);
    circle(image, at, radius, 2.2 * stroke_px, BACKGROUND);
    circle(image, at, radius, stroke_px, person_color(believer));
}

/// Returns where a map of [`FloorPlan`] shows a position (x, z): the distances from its left and
/// upper edge, relative to its width.
pub fn position_on_map(world: &World, position_in_world: Vec2) -> Vec2 {
    let area = map_area(world);
    let map = Map { area, px_per_m: area.size().x.recip() };
    map.px_from_xz(position_in_world)
}

/// Returns the height of a map of [`FloorPlan`] without its legend, relative to its width.
pub fn relative_height(world: &World) -> f32 {
    let size = map_area(world).size();
    size.y / size.x
}

/// Transform from meters to pixels.
struct Map {
    area: Rect,
    px_per_m: f32,
}

impl Map {
    /// Returns the transform of a map of this width, pixels.
    fn new(world: &World, width: u32) -> Map {
        let area = map_area(world);
        Map { area, px_per_m: width as f32 / area.size().x }
    }

    fn px(&self, p: Vec3) -> Vec2 {
        self.px_from_xz(Vec2::new(p.x, p.z))
    }

    fn px_from_xz(&self, p: Vec2) -> Vec2 {
        (p - self.area.min) * self.px_per_m
    }

    /// Returns the point (x, z) at a pixel.
    fn xz_from_px(&self, px: Vec2) -> Vec2 {
        self.area.min + px / self.px_per_m
    }
}

fn map_area(world: &World) -> Rect {
    let setup = world.setup();
    let mut area = setup.bounds;
    for wall in &setup.walls {
        area.min = area.min.min(wall.a).min(wall.b);
        area.max = area.max.max(wall.a).max(wall.b);
    }
    area.expanded(0.3)
}

fn render_base(scene: &Scene, world: &World, map: &Map, width: u32, height: u32) -> RgbImage {
    let center = map.area.center();
    let eye = Vec3::new(center.x, EYE_M, center.y);
    let projection = Projection::plan(eye, map.px_per_m, width as usize, height as usize);
    let bodies: Vec<Body> = Vec::new();
    let frame = scene.frame(world.state(), &bodies, true);
    let mut rgb = vec![0; 3 * width as usize * height as usize];
    with_scratch(|scratch| {
        let Scratch { target, buffers, shading, .. } = scratch;
        draw_scene(&frame, &projection, Exclusions { body: None, ceiling: true }, target, buffers);
        let output = OutputImages { rgb: &mut rgb, depth_m: None, ids: None };
        shade(&frame, &projection, &buffers.drawn_instances(), target, shading, output);
    });
    RgbImage::from_raw(width, height, rgb).unwrap_or_else(|| RgbImage::new(width, height))
}

fn room_color(kind: RoomKind) -> [u8; 3] {
    match kind {
        RoomKind::Kitchen => [240, 190, 90],
        RoomKind::LivingRoom => [120, 190, 120],
        RoomKind::Bedroom => [130, 150, 230],
        RoomKind::Office => [190, 140, 210],
        RoomKind::Bathroom => [110, 200, 220],
        RoomKind::Corridor => [200, 200, 200],
        RoomKind::Outdoors => [170, 200, 150],
    }
}

fn room_name(kind: RoomKind) -> &'static str {
    match kind {
        RoomKind::Kitchen => "kitchen",
        RoomKind::LivingRoom => "living room",
        RoomKind::Bedroom => "bedroom",
        RoomKind::Office => "office",
        RoomKind::Bathroom => "bathroom",
        RoomKind::Corridor => "corridor",
        RoomKind::Outdoors => "outdoors",
    }
}

/// Returns the pixels of each room that no wall covers.
fn tinted_rooms(world: &World, map: &Map, width: u32, height: u32) -> Vec<TintedRoom> {
    let setup = world.setup();
    let rooms = setup.rooms.iter().filter(|room| room.kind != RoomKind::Outdoors);
    let tinted = rooms.map(|room| {
        let (a, b) = (map.px_from_xz(room.rect.min), map.px_from_xz(room.rect.max));
        let walls: Vec<&Wall> = setup.walls.iter().filter(|w| touches(w, &room.rect)).collect();
        let is_tinted = |at| !walls.iter().any(|w| covers(w, map.xz_from_px(at)));
        let mut runs: Vec<(u32, u32)> = Vec::new();
        for_pixels_between((width, height), a, b, |x, y| {
            if !is_tinted(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)) {
                return;
            }
            let index = y * width + x;
            match runs.last_mut() {
                Some((_, end)) if *end == index => *end += 1,
                _ => runs.push((index, index + 1)),
            }
        });
        TintedRoom { kind: room.kind, runs }
    });
    tinted.collect()
}

fn touches(wall: &Wall, rect: &Rect) -> bool {
    let around = Rect { min: wall.a.min(wall.b), max: wall.a.max(wall.b) };
    around.expanded(wall.thickness_m).overlaps(rect)
}

/// Returns whether a wall covers a point.
fn covers(wall: &Wall, p: Vec2) -> bool {
    let along = wall.b - wall.a;
    let t = ((p - wall.a).dot(along) / along.length_squared().max(1e-6)).clamp(0.0, 1.0);
    p.distance(wall.a + along * t) <= 0.5 * wall.thickness_m
}

/// Returns the names of the rooms that are wide enough.
fn room_labels(world: &World, map: &Map, width_px: u32) -> Vec<TextLabel> {
    let label = |room: &Room| {
        let (a, b) = (map.px_from_xz(room.rect.min), map.px_from_xz(room.rect.max));
        let name = room_name(room.kind);
        let fitting_px = 0.8 * (b.x - a.x) / TextLabel::width_px(name, 1.0).max(1.0);
        let size_px = (0.022 * width_px as f32).min(fitting_px).clamp(9.0, 26.0);
        let is_too_wide = TextLabel::width_px(name, size_px) > (b.x - a.x).max(20.0);
        if is_too_wide || (b.y - a.y) < size_px {
            return None;
        }
        Some(TextLabel {
            text: name.to_owned(),
            top: Vec2::new(0.5 * (a.x + b.x), a.y + 0.10 * (b.y - a.y)),
            size_px,
            align: Align::Center,
            color: INK,
            border: Some(BACKGROUND),
        })
    };
    world.setup().rooms.iter().filter_map(label).collect()
}

/// Returns the marker color of an object; `None` if it has no marker.
fn marker_color(world: &World, entity: EntityId) -> Option<[u8; 3]> {
    let setup = world.setup();
    let object = setup.object(entity)?;
    let state = &world.state().objects[setup.object_index(entity)?];
    if state.location == ObjectLocation::Broken {
        return None;
    }
    if setup.goal.count(object.class) > 0 {
        return Some(TARGET);
    }
    match object.class.info().role {
        Role::Container if !object.fixed => Some(CONTAINER),
        Role::Obstacle if !object.fixed => Some(OBSTACLE),
        _ => None,
    }
}

fn mark_objects(image: &mut RgbImage, world: &World, map: &Map) {
    let setup = world.setup();
    let stroke_px = (0.0028 * image.width() as f32).max(1.5);
    for entity in &setup.goal_places {
        let Some(k) = setup.object_index(*entity) else { continue };
        let (object, state) = (&setup.things[k], &world.state().objects[k]);
        let half = 0.5 * object.size_m() + 0.08;
        let corner = |x: f32, z: f32| {
            map.px(state.position + state.rotation * Vec3::new(x * half.x, 0.0, z * half.z))
        };
        let ring = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        for i in 0..4 {
            line(image, ring[i], ring[(i + 1) % 4], 1.4 * stroke_px, GOAL);
        }
    }
    for (k, entity) in setup.entities().enumerate() {
        let Some(color) = marker_color(world, entity) else { continue };
        let size = setup.things[k].size_m();
        // On a narrow map, the lower bound exceeds the upper one.
        let radius = (0.6 * size.x.max(size.z) * map.px_per_m)
            .min(0.08 * image.width() as f32)
            .max(2.5 * stroke_px);
        let done = world.state().objects[k].delivered.is_some();
        circle(
            image,
            map.px(world.state().objects[k].position),
            radius,
            stroke_px,
            if done { GOAL } else { color },
        );
    }
}

fn person_color(agent: AgentId) -> [u8; 3] {
    PEOPLE[agent.index().min(PEOPLE.len() - 1)]
}

/// Returns the radius of the disk of a person, pixels.
fn person_radius_px(image: &RgbImage, map: &Map) -> f32 {
    (0.26 * map.px_per_m).max(0.009 * image.width() as f32)
}

/// Draws the agents and returns their letters.
fn mark_people(image: &mut RgbImage, world: &World, map: &Map) -> Vec<TextLabel> {
    let mut letters = Vec::new();
    let radius = person_radius_px(image, map);
    for agent in world.setup().agents() {
        let pose = world.state().agents[agent.index()].pose;
        let (at, color) = (map.px(pose.position), person_color(agent));
        let forward = pose.forward();
        let nose = at + Vec2::new(forward.x, forward.z) * (1.9 * radius);
        let side = Vec2::new(-forward.z, forward.x) * (0.62 * radius);
        let base = at + Vec2::new(forward.x, forward.z) * (0.75 * radius);
        triangle(image, [nose, base + side, base - side], INK);
        disk(image, at, radius * 1.16, BACKGROUND);
        disk(image, at, radius, color);
        let size_px = 1.5 * radius;
        letters.push(TextLabel {
            text: agent.role_name()[..1].to_owned(),
            top: at - Vec2::new(0.0, 0.58 * size_px),
            size_px,
            align: Align::Center,
            color: BACKGROUND,
            border: None,
        });
    }
    letters
}

/// Returns the map with the symbols of a legend below, and the text of the legend.
fn with_legend(map: &RgbImage, world: &World) -> (RgbImage, Vec<TextLabel>) {
    let size = (0.017 * map.width() as f32).clamp(9.0, 22.0);
    let pad = 0.7 * size;
    let mut entries: Vec<([u8; 3], String, bool)> = world
        .setup()
        .agents()
        .map(|agent| (person_color(agent), agent.role_name().to_owned(), true))
        .collect();
    let targets = &world.setup().goal.targets;
    let targets_text: Vec<String> =
        targets.iter().map(|(c, n)| format!("{n} {}", c.info().label)).collect();
    entries.push((TARGET, format!("wanted: {}", targets_text.join(", ")), false));
    entries.push((GOAL, "goal place, delivered".to_owned(), false));
    for (color, label, role) in
        [(CONTAINER, "container", Role::Container), (OBSTACLE, "obstacle", Role::Obstacle)]
    {
        if world.setup().things.iter().any(|t| t.class.info().role == role) {
            entries.push((color, label.to_owned(), false));
        }
    }
    // Wraps the entries into lines.
    let (mut x, mut y) = (pad, 0.0);
    let mut placed = Vec::new();
    for (color, label, filled) in entries {
        let width_px = TextLabel::width_px(&label, size) + 2.6 * size;
        if x + width_px > map.width() as f32 && x > pad {
            (x, y) = (pad, y + 1.6 * size);
        }
        placed.push((x, y, color, label, filled));
        x += width_px;
    }
    let height_px = (y + 2.6 * size) as u32;
    let mut out = RgbImage::from_pixel(map.width(), map.height() + height_px, Rgb(BACKGROUND));
    image::imageops::replace(&mut out, map, 0, 0);
    let top = map.height() as f32 + 0.5 * size;
    let mut labels = Vec::new();
    for (x, y, color, text, filled) in placed {
        let dot = Vec2::new(x + 0.5 * size, top + y + 0.6 * size);
        if filled {
            disk(&mut out, dot, 0.5 * size, color);
        } else {
            circle(&mut out, dot, 0.45 * size, 0.22 * size, color);
        }
        labels.push(TextLabel {
            text,
            top: Vec2::new(x + 1.4 * size, top + y),
            size_px: size,
            align: Align::Left,
            color: INK,
            border: None,
        });
    }
    (out, labels)
}
