//! Indoor episodes: the package's furniture between the walls of the table.

use chaic_core::briefing::Goal;
use chaic_core::geom::{Rect, to_xz};
use chaic_core::rng::RngStream;
use chaic_core::task::GoalTop;
use chaic_core::{Role, TaskId, Vec2, Vec3};
use chaic_episodes::mm;
use chaic_world::{Floor, FloorMaterial, ObjectSpec, Opening, Room, RoomKind, Rules, Setup, Wall};

use crate::dataset::{Names, Object, RoomTypes, Source};
use crate::package::{Package, Piece};
use crate::piece::{PosedModel, to_object};
use crate::settle::{RestConstraint, Surroundings};
use crate::tables::{FLOORPLANS, Floorplan};
use crate::{ImportError, axes, common};

/// Heights in this range are those of free pieces that drop onto the floor when the scene starts,
/// meters. Higher pieces stand on furniture (the layouts' note on such pieces).
const DROP_HEIGHTS_M: [f32; 2] = [0.0, 0.15];
/// Maximum distance by which a free piece sinks onto the surface below it, meters.
const MAX_SINK_M: f32 = 0.3;
/// Pieces farther than this outside the house are left out, meters.
const STRAY_M: f32 = 1.0;
/// Free furniture that leans less than this is upright after settling, degrees.
const UPRIGHT_DEG: f32 = 15.0;
/// Objects with a lower bottom lie on the floor, meters; some lean.
const ON_FLOOR_M: f32 = 0.05;
/// Objects that are placed lower than this are placed on the floor, meters (the original uses 0.1).
const PLACED_ON_FLOOR_M: f32 = 0.2;

/// A house, identified by names of the original.
#[derive(Clone, Copy, Debug)]
pub(crate) struct House<'a> {
    plan: &'static Floorplan,
    number: &'a str,
    variant: &'a str,
    layout: &'a str,
    /// Names of the rooms, by region.
    names: &'a [String],
}

impl<'a> House<'a> {
    /// Returns the house of a scene such as `1a` and a layout such as `0`. The error contains the
    /// invalid field and its problem.
    pub fn from_names(
        scene: &'a str,
        layout: &'a str,
        rooms: &'a RoomTypes,
    ) -> Result<House<'a>, (&'static str, String)> {
        let (number, variant) = scene.split_at_checked(1).unwrap_or_default();
        let plan = FLOORPLANS.get(number).filter(|p| p.variants.contains_key(variant));
        let plan = plan.ok_or_else(|| ("scene", format!("is {scene:?}, which is in no table")))?;
        let names = layout.parse().ok().and_then(|k: usize| rooms.get(number)?.get(k));
        let names = names.filter(|n| n.len() == plan.regions.len()).ok_or_else(|| {
            ("layout", format!("is {layout:?}, but room_types.json has no rooms for it"))
        })?;
        Ok(House { plan, number, variant, layout, names })
    }

    /// Returns the house with its furniture from the package. Pieces of `goal_categories` are goal
    /// places. Also returns the indices of pieces that drop when the scene starts.
    pub fn with_furniture(
        &self,
        task: TaskId,
        goal_categories: &[String],
        package: &Package,
    ) -> Result<(Setup, Vec<usize>), ImportError> {
        let mut setup = empty_house(task, self);
        let mut free_pieces = Vec::new();
        for (i, piece) in package.layout(self.number, self.layout)?.iter().enumerate() {
            let problem = |p: String| {
                let field = format!("{}.{}[{i}].name", self.number, self.layout);
                ImportError::field(package.layouts_path(), field, p)
            };
            let furniture = to_furniture(piece, package).map_err(problem)?;
            if !setup.bounds.expanded(STRAY_M).contains(to_xz(furniture.position)) {
                continue;
            }
            let category = package.record(&piece.name).map_or("", |r| r.category);
            if goal_categories.iter().any(|c| c == category) && is_goal(task, piece, &furniture) {
                setup.goal_places.push(Setup::entity(setup.things.len()));
            }
            if is_free_piece(piece) && furniture.position.y > DROP_HEIGHTS_M[1] {
                free_pieces.push(setup.things.len());
            }
            setup.things.push(furniture);
        }
        Ok((setup, free_pieces))
    }

    /// Returns the furnished house with all free pieces at rest.
    pub fn settled(&self, package: &Package) -> Result<Setup, ImportError> {
        let beds = ["bed".to_owned()];
        let (mut setup, free_pieces) = self.with_furniture(TaskId::NoConstraint, &beds, package)?;
        settle_pieces(&mut setup, &free_pieces);
        Ok(setup)
    }
}

/// Returns the initial state of an indoor episode.
pub(crate) fn setup(
    source: &Source,
    rooms: &RoomTypes,
    package: &Package,
) -> Result<Setup, ImportError> {
    let entry = &source.entry;
    let layout = entry.layout.split('_').next().unwrap_or_default();
    let house = House::from_names(&entry.scene, layout, rooms).map_err(|(field, problem)| {
        ImportError::field(&source.list_path, format!("[{}].{field}", source.index), problem)
    })?;
    let goal_categories = match &entry.task.goal_position_names {
        Names::Many(names) => names.clone(),
        Names::One(name) => vec![name.clone()],
    };
    let (mut setup, free_pieces) = house.with_furniture(source.task, &goal_categories, package)?;
    setup.seed = draw_seed(source);
    setup.goal = common::goal(source)?;
    // All people face Unity's +z at the start.
    setup.people = common::people(source, &setup, [0.0; 3])?;
    settle_pieces(&mut setup, &free_pieces);
    place_objects(&mut setup, source, house.names, package)?;
    Ok(setup)
}

/// Returns the seed of an episode's random draws. The original's draws have no seed (facts S,
/// summary 12). All indoor episodes of its data have the seed 2824 (facts S12.2). That seed alone
/// would give all episodes of a run the same draws.
fn draw_seed(source: &Source) -> u64 {
    let entry = &source.entry;
    let name = format!("{} {} {}", source.task, entry.scene, entry.layout);
    u64::from(u32::MAX) & RngStream::new(entry.seed, &name, source.index as u64).seed()
}

/// Returns a setup with walls, rooms and floors only.
fn empty_house(task: TaskId, house: &House<'_>) -> Setup {
    let House { plan, names, .. } = house;
    let colors = &plan.variants[house.variant];
    let rooms: Vec<Room> = plan
        .regions
        .iter()
        .zip(names.iter())
        .map(|(region, name)| Room { kind: room_kind(name), rect: axes::rect(*region) })
        .collect();
    let bounds = axes::rect(plan.bounds);
    let material = |kind: RoomKind| match kind {
        RoomKind::Kitchen => FloorMaterial::Tiles,
        RoomKind::Bedroom => FloorMaterial::Carpet,
        _ => FloorMaterial::Wood,
    };
    // Rooms end at the faces of walls. Each floor extends to the middle of the wall, and the first
    // one, below all others, covers bays and doorways.
    let walls: Vec<Wall> =
        plan.walls.iter().map(|w| wall(*w, plan.height_m, colors.wall)).collect();
    let covered = walls
        .iter()
        .fold(bounds, |r, w| Rect { min: r.min.min(w.a).min(w.b), max: r.max.max(w.a).max(w.b) });
    let under = Floor { rect: covered, material: FloorMaterial::Wood, color: colors.floors[0] };
    let floors = rooms.iter().zip(&colors.floors).map(|(room, color)| Floor {
        rect: room.rect.expanded(0.5 * plan.thickness_m + 0.04),
        material: material(room.kind),
        color: *color,
    });
    Setup {
        task,
        seed: 0,
        horizon: task.info().horizon,
        bounds,
        ceiling_m: Some(plan.height_m),
        floors: std::iter::once(under).chain(floors).collect(),
        rooms,
        walls,
        openings: plan
            .openings
            .iter()
            .map(|o| Opening { a: axes::plan(o.a), b: axes::plan(o.b), rooms: o.regions })
            .collect(),
        things: Vec::new(),
        people: Vec::new(),
        goal: Goal { targets: Vec::new() },
        goal_places: Vec::new(),
    }
}

/// Returns the wall that fills a rectangle of Unity's plane. Walls of chaic extend half their
/// thickness beyond both ends.
fn wall(rect: [f32; 4], height_m: f32, color: [u8; 3]) -> Wall {
    let Rect { min, max } = axes::rect(rect);
    let size = max - min;
    let thickness_m = size.min_element();
    let along = if size.x >= size.y { Vec2::X } else { Vec2::Y };
    let (middle, half) = (0.5 * (min + max), 0.5 * (size.max_element() - thickness_m));
    let end = |side: f32| {
        let p = middle + side * half * along;
        Vec2::new(mm(p.x), mm(p.y))
    };
    Wall {
        a: end(-1.0),
        b: end(1.0),
        thickness_m: mm(thickness_m),
        bottom_m: 0.0,
        top_m: height_m,
        color,
    }
}

fn room_kind(name: &str) -> RoomKind {
    match name {
        "Kitchen" => RoomKind::Kitchen,
        "Livingroom" => RoomKind::LivingRoom,
        "Bedroom" => RoomKind::Bedroom,
        "Office" => RoomKind::Office,
        // The original calls the corridor of floor plan 2 a porch.
        _ => RoomKind::Corridor,
    }
}

/// Returns a piece of the layout after the scene has started. It is fixed unless its class may be a
/// target.
fn to_furniture(piece: &Piece, package: &Package) -> Result<ObjectSpec, String> {
    let is_free_piece = is_free_piece(piece);
    let mut euler_deg: Vec3 = piece.rotation.into();
    let tilt_deg = |deg: f32| ((deg + 180.0).rem_euclid(360.0) - 180.0).abs();
    if is_free_piece && tilt_deg(euler_deg.x).max(tilt_deg(euler_deg.z)) < UPRIGHT_DEG {
        (euler_deg.x, euler_deg.z) = (0.0, 0.0);
    }
    let posed = PosedModel {
        model: &piece.name,
        position: piece.position.into(),
        euler_deg,
        scale: piece.scale_factor.into(),
    };
    let mut furniture = to_object(&posed, package)?;
    let y = &mut furniture.position.y;
    if *y < DROP_HEIGHTS_M[0] || (is_free_piece && *y < DROP_HEIGHTS_M[1]) {
        *y = 0.0;
    }
    furniture.fixed = furniture.class.info().role != Role::Target;
    Ok(furniture)
}

/// Returns whether a piece falls when the scene starts.
fn is_free_piece(piece: &Piece) -> bool {
    piece.gravity && !piece.kinematic
}

/// Returns whether a piece of the right category is a goal place. Cabinets and refrigerators must
/// be high, and doors are excluded (facts S5.1).
fn is_goal(task: TaskId, piece: &Piece, furniture: &ObjectSpec) -> bool {
    let top_m = furniture.position.y + furniture.size_m().y;
    let is_high = top_m >= Rules::paper().high_goal_min_top_m && !piece.name.contains("door");
    task.info().goal_top == GoalTop::Any || is_high
}

/// Moves possible targets down onto the surface below them. Other pieces listed in `free_pieces`
/// move only if the distance is small.
fn settle_pieces(setup: &mut Setup, free_pieces: &[usize]) {
    let surroundings = Surroundings::new(setup);
    for (k, object) in setup.things.iter_mut().enumerate() {
        let Some(height_m) = surroundings.height_under(object) else { continue };
        let sinks = free_pieces.contains(&k) && object.position.y - height_m <= MAX_SINK_M;
        if !object.fixed || sinks {
            object.position.y = height_m;
        }
    }
}

/// Places the episode's objects at their recorded heights and in their recorded rooms.
fn place_objects(
    setup: &mut Setup,
    source: &Source,
    names: &[String],
    package: &Package,
) -> Result<(), ImportError> {
    let mut surroundings = Surroundings::new(setup);
    let recorded = recorded(source, names, setup)?;
    let containers = &source.entry.task.container_names;
    let mut laid: Vec<Option<ObjectSpec>> = vec![None; source.objects.len()];
    // Containers first: they need the most space.
    let mut order: Vec<usize> = (0..source.objects.len()).collect();
    order.sort_by_key(|i| !containers.contains(&source.objects[*i].model));
    for i in order {
        let (source_object, record) = (&source.objects[i], &recorded[i]);
        let start = common::object(source, i, package)?;
        let constraint = RestConstraint { height_m: record.height_m, rooms: &record.rooms };
        let found = match () {
            () if start.position.y < PLACED_ON_FLOOR_M => {
                surroundings.place_on_floor(&start, &constraint)
            }
            () if record.height_m <= ON_FLOOR_M => surroundings.place_fallen(&start, &constraint),
            () => surroundings.place_on_furniture(&start, &constraint),
        };
        let object = found.ok_or_else(|| no_space(source, source_object))?;
        surroundings.add(&object);
        laid[i] = Some(object);
    }
    setup.things.extend(laid.into_iter().flatten());
    Ok(())
}

fn no_space(source: &Source, source_object: &Object) -> ImportError {
    let problem = format!("places a {} where there is no space for it", source_object.model);
    ImportError::field(&source.commands_path, "add_object", problem)
}

/// Final height and room of an object in the original.
struct Recorded {
    height_m: f32,
    /// Rooms with the recorded name; empty if any room is possible.
    rooms: Vec<Rect>,
}

/// Returns heights and rooms of all objects. The metadata lists them in the order of commands, with
/// containers in a separate list and without obstacles.
fn recorded(
    source: &Source,
    names: &[String],
    setup: &Setup,
) -> Result<Vec<Recorded>, ImportError> {
    let (task, metadata) = (&source.entry.task, &source.metadata);
    let mut objects = metadata.object_height.iter();
    let mut containers = metadata.container_height.iter();
    let mut rooms = metadata.object_room_list.iter();
    let missing = |field: &str| {
        ImportError::field(&source.metadata_path, field, "has fewer entries than there are objects")
    };
    let mut recorded = Vec::new();
    for object in &source.objects {
        if task.obstacle_names.contains(&object.model) {
            recorded.push(Recorded { height_m: 0.0, rooms: Vec::new() });
            continue;
        }
        let height_m = if task.container_names.contains(&object.model) {
            *containers.next().ok_or_else(|| missing("container_height"))?
        } else {
            *objects.next().ok_or_else(|| missing("object_height"))?
        };
        let (model, room) = rooms.next().ok_or_else(|| missing("object_room_list"))?;
        // Recorded names of objects on the floor are unreliable (facts S12.4), but their positions
        // are exact.
        let is_reliable = object.position.y >= PLACED_ON_FLOOR_M;
        if is_reliable && *model != object.model {
            let problem = format!("names {model}, expected {} as in the commands", object.model);
            return Err(ImportError::field(&source.metadata_path, "object_room_list", problem));
        }
        let of_name = names.iter().zip(&setup.rooms).filter(|(name, _)| *name == room);
        let rooms = of_name.filter(|_| is_reliable).map(|(_, room)| room.rect).collect();
        recorded.push(Recorded { height_m, rooms });
    }
    Ok(recorded)
}
