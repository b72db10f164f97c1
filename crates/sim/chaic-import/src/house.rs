//! Indoor episodes: a house of the package's furniture between the table's walls.

use chaic_core::briefing::Goal;
use chaic_core::geom::{Rect, xz};
use chaic_core::task::GoalTop;
use chaic_core::{Role, TaskId, Vec2, Vec3};
use chaic_episodes::mm;
use chaic_world::{Floor, FloorMaterial, Opening, Room, RoomKind, Rules, Setup, Thing, Wall};

use crate::dataset::{Names, Object, RoomTypes, Source};
use crate::package::{Package, Piece};
use crate::piece::{Posed, thing};
use crate::settle::{Rest, Surroundings};
use crate::tables::{FLOORPLANS, Floorplan};
use crate::{ImportError, axes, common};

/// Loose pieces stored this far above the floor drop onto it when the scene starts, metres
/// (the layouts' note on such pieces; everything higher stands on something).
const DROPS_M: [f32; 2] = [0.0, 0.15];
/// Loose pieces that are stored at most this far above what is under them lie on it, metres.
const SINKS_M: f32 = 0.3;
/// Pieces farther than this outside the house are strays, metres.
const STRAY_M: f32 = 1.0;
/// Loose furniture that leans less than this stands upright once settled, degrees.
const UPRIGHT_DEG: f32 = 15.0;
/// Bottoms lower than this lie on the floor, metres; some lean.
const ON_FLOOR_M: f32 = 0.05;
/// What is put lower than this is put on the floor, metres (the original puts it at 0.1).
const PUT_ON_FLOOR_M: f32 = 0.2;

/// A house by the names of the original.
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
    /// The house of a scene like `1a` and a layout like `0`; otherwise which of the two names
    /// nothing, and what is wrong with it.
    pub fn named(
        scene: &'a str,
        layout: &'a str,
        rooms: &'a RoomTypes,
    ) -> Result<House<'a>, (&'static str, String)> {
        let (number, variant) = scene.split_at(scene.len().min(1));
        let plan = FLOORPLANS.get(number).filter(|p| p.variants.contains_key(variant));
        let plan = plan.ok_or_else(|| ("scene", format!("is {scene:?}, which no table has")))?;
        let names = layout.parse().ok().and_then(|k: usize| rooms.get(number)?.get(k));
        let names = names.filter(|n| n.len() == plan.regions.len()).ok_or_else(|| {
            ("layout", format!("is {layout:?}, whose rooms room_types.json doesn't name"))
        })?;
        Ok(House { plan, number, variant, layout, names })
    }

    /// The house with its furniture, as the package has it. Pieces of `goal_categories` are goal
    /// places. Also which things drop when the scene starts, by their places.
    pub fn furnished(
        &self,
        task: TaskId,
        goal_categories: &[String],
        package: &Package,
    ) -> Result<(Setup, Vec<usize>), ImportError> {
        let mut setup = shell(task, self);
        let mut loose = Vec::new();
        for (i, piece) in package.layout(self.number, self.layout)?.iter().enumerate() {
            let problem = |p: String| {
                let field = format!("{}.{}[{i}].name", self.number, self.layout);
                ImportError::field(package.layouts_path(), field, p)
            };
            let furniture = furnish(piece, package).map_err(problem)?;
            if !setup.bounds.grown(STRAY_M).contains(xz(furniture.position)) {
                continue;
            }
            let category = package.record(&piece.name).map_or("", |r| r.category);
            if goal_categories.iter().any(|c| c == category) && is_goal(task, piece, &furniture) {
                setup.goal_places.push(Setup::entity(setup.things.len()));
            }
            if is_loose(piece) && furniture.position.y > DROPS_M[1] {
                loose.push(setup.things.len());
            }
            setup.things.push(furniture);
        }
        Ok((setup, loose))
    }

    /// The same with nothing in the air.
    pub fn settled(&self, package: &Package) -> Result<Setup, ImportError> {
        let beds = ["bed".to_owned()];
        let (mut setup, loose) = self.furnished(TaskId::NoConstraint, &beds, package)?;
        drop_loose(&mut setup, &loose);
        Ok(setup)
    }
}

/// The beginning of an indoor episode.
pub(crate) fn setup(
    source: &Source,
    rooms: &RoomTypes,
    package: &Package,
) -> Result<Setup, ImportError> {
    let entry = &source.entry;
    let layout = entry.layout.split('_').next().unwrap_or_default();
    let house = House::named(&entry.scene, layout, rooms).map_err(|(field, problem)| {
        ImportError::field(&source.list_path, format!("[{}].{field}", source.index), problem)
    })?;
    let goal_categories = match &entry.task.goal_position_names {
        Names::Many(names) => names.clone(),
        Names::One(name) => vec![name.clone()],
    };
    let (mut setup, loose) = house.furnished(source.task, &goal_categories, package)?;
    setup.seed = entry.seed;
    setup.goal = common::goal(source)?;
    // Everybody looks along Unity's +z at the start.
    setup.people = common::people(source, &setup, [0.0; 3])?;
    drop_loose(&mut setup, &loose);
    lay_out(&mut setup, source, house.names, package)?;
    Ok(setup)
}

/// Walls, rooms and floors.
fn shell(task: TaskId, house: &House<'_>) -> Setup {
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
    // Rooms end at the faces of walls: each floor goes on to the middle of the wall, and the first
    // one under all covers bays and doorways.
    let walls: Vec<Wall> =
        plan.walls.iter().map(|w| wall(*w, plan.height_m, colors.wall)).collect();
    let covered = walls
        .iter()
        .fold(bounds, |r, w| Rect { min: r.min.min(w.a).min(w.b), max: r.max.max(w.a).max(w.b) });
    let under = Floor { rect: covered, material: FloorMaterial::Wood, color: colors.floors[0] };
    let floors = rooms.iter().zip(&colors.floors).map(|(room, color)| Floor {
        rect: room.rect.grown(0.5 * plan.thickness_m + 0.04),
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

/// The wall that fills a rectangle of Unity's plane. Ours go on for half their thickness beyond
/// both ends.
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

/// A piece of the layout as it stands once the scene has begun; nobody moves it, unless it is of a
/// class that may be a target.
fn furnish(piece: &Piece, package: &Package) -> Result<Thing, String> {
    let is_loose = is_loose(piece);
    let mut euler_deg: Vec3 = piece.rotation.into();
    let tilt_deg = |deg: f32| ((deg + 180.0).rem_euclid(360.0) - 180.0).abs();
    if is_loose && tilt_deg(euler_deg.x).max(tilt_deg(euler_deg.z)) < UPRIGHT_DEG {
        (euler_deg.x, euler_deg.z) = (0.0, 0.0);
    }
    let posed = Posed {
        model: &piece.name,
        position: piece.position.into(),
        euler_deg,
        scale: piece.scale_factor.into(),
    };
    let mut furniture = thing(&posed, package)?;
    let y = &mut furniture.position.y;
    if *y < DROPS_M[0] || (is_loose && *y < DROPS_M[1]) {
        *y = 0.0;
    }
    furniture.fixed = furniture.class.info().role != Role::Target;
    Ok(furniture)
}

/// Whether a piece falls when the scene starts.
fn is_loose(piece: &Piece) -> bool {
    piece.gravity && !piece.kinematic
}

/// Whether a piece of the right category is a goal place. Of cabinets and refrigerators only high
/// ones are, and no doors (facts S5.1).
fn is_goal(task: TaskId, piece: &Piece, furniture: &Thing) -> bool {
    let top_m = furniture.position.y + furniture.size_m().y;
    let is_high = top_m >= Rules::paper().high_goal_min_top_m && !piece.name.contains("door");
    task.info().goal_top == GoalTop::Any || is_high
}

/// Lets what may be a target and stands on the furniture sink onto it, and what else is `loose` and
/// has not far to go.
fn drop_loose(setup: &mut Setup, loose: &[usize]) {
    let around = Surroundings::of(setup);
    for (k, thing) in setup.things.iter_mut().enumerate() {
        let Some(height_m) = around.height_under(thing) else { continue };
        let sinks = loose.contains(&k) && thing.position.y - height_m <= SINKS_M;
        if !thing.fixed || sinks {
            thing.position.y = height_m;
        }
    }
}

/// Puts the episode's objects where they came to rest.
fn lay_out(
    setup: &mut Setup,
    source: &Source,
    names: &[String],
    package: &Package,
) -> Result<(), ImportError> {
    let mut around = Surroundings::of(setup);
    let recorded = recorded(source, names, setup)?;
    let containers = &source.entry.task.container_names;
    let mut laid: Vec<Option<Thing>> = vec![None; source.objects.len()];
    // Containers first: they need the most room.
    let mut order: Vec<usize> = (0..source.objects.len()).collect();
    order.sort_by_key(|i| !containers.contains(&source.objects[*i].model));
    for i in order {
        let (object, record) = (&source.objects[i], &recorded[i]);
        let start = common::object(source, i, package)?;
        let rest = Rest { height_m: record.height_m, rooms: &record.rooms };
        let found = match () {
            () if start.position.y < PUT_ON_FLOOR_M => around.laid_on_floor(&start, &rest),
            () if record.height_m <= ON_FLOOR_M => around.fallen(&start, &rest),
            () => around.laid_on_furniture(&start, &rest),
        };
        let thing = found.ok_or_else(|| no_room(source, object))?;
        around.add(&thing);
        laid[i] = Some(thing);
    }
    setup.things.extend(laid.into_iter().flatten());
    Ok(())
}

fn no_room(source: &Source, object: &Object) -> ImportError {
    let problem = format!("puts a {} where there is no room for it", object.model);
    ImportError::field(&source.commands_path, "add_object", problem)
}

/// Where the original found an object in the end.
struct Recorded {
    height_m: f32,
    /// The rooms of the recorded name; any room if there is none.
    rooms: Vec<Rect>,
}

/// Heights and rooms of all objects: the metadata lists them in the order of commands, containers
/// apart, and leaves obstacles out.
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
        // Names of what was put on the floor are unreliable (facts S12.4), its place is exact.
        let is_sure = object.position.y >= PUT_ON_FLOOR_M;
        if is_sure && *model != object.model {
            let problem = format!("names {model}, expected {} as in the commands", object.model);
            return Err(ImportError::field(&source.metadata_path, "object_room_list", problem));
        }
        let of_name = names.iter().zip(&setup.rooms).filter(|(name, _)| *name == room);
        let rooms = of_name.filter(|_| is_sure).map(|(_, room)| room.rect).collect();
        recorded.push(Recorded { height_m, rooms });
    }
    Ok(recorded)
}
