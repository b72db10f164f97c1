//! The catalogue: every class of object, once.
//!
//! One table says how big a thing is, what it weighs, what part it plays, and of which simple
//! solids it is made. Generators place by it, the world collides and lifts by it, the renderer
//! draws it, perception names it, and the docs list it.
//!
//! Sizes and masses of the benchmark's classes are the original's after its own scaling (facts
//! S8.1, S9.1 and S11.3, measured from its model records); masses of small
//! things, which the original sets to arbitrary numbers, are those of the real thing.

use serde::Serialize;

mod actors;
mod containers;
mod decor;
mod food;
mod goods;
mod house;
mod kitchen;
mod moving;
mod obstacles;
mod shape;
mod street;

/// Which set a possible target belongs to: the hidden goal asks for one whole set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub enum TargetSet {
    /// Indoor: apple, banana, orange.
    Fruit,
    /// Indoor: bread, burger, loaf bread.
    Bread,
    /// Indoor: iPhone, iPod, purse, key.
    Work,
    /// Indoor: mouse, pen, pencil bucket, calculator.
    School,
    /// Shopping: apple, orange, banana, grape.
    ShopFruit,
    /// Shopping: loaf bread, croissant, burger, pink donut.
    ShopBakery,
    /// Shopping: cans of pepsi, cocacola, sprite, fanta.
    ShopDrinks,
    /// Moving house: all furniture.
    Furniture,
}

/// The part a class plays in the benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
pub enum Role {
    /// May be a target of some episode.
    Target,
    /// Can hold three targets and be carried in one hand.
    Container,
    /// A possible target that a child may break.
    Fragile,
    /// Stands in doorways until somebody removes it.
    Obstacle,
    /// Movable only in moving house, where it is the target.
    HeavyTarget,
    /// Part of a house or street; never moved.
    Furnishing,
    /// The bicycle with its basket.
    Vehicle,
    /// A human body.
    Person,
}

/// A simple solid, filling the box of its [`Part`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Solid {
    /// The whole box.
    Cuboid,
    /// The ellipsoid inscribed in the box.
    Ellipsoid,
    /// Upright (along the part's y), tapering linearly to `top` times its width at the top; 1 is a
    /// cylinder, 0 a cone.
    Frustum {
        /// Width at the top divided by width at the bottom.
        top: f32,
    },
    /// A ring lying in the part's xz plane; `tube` is the tube's diameter over the outer diameter.
    Torus {
        /// Tube diameter divided by outer diameter.
        tube: f32,
    },
    /// A sector of a torus in the part's xz plane, opening towards +z: a handle, a banana.
    Arc {
        /// Tube diameter divided by outer diameter.
        tube: f32,
        /// How much of the full turn is there, degrees, centered on -z.
        degrees: f32,
    },
    /// An open-topped box or tub with walls of thickness `wall` (fraction of the smaller
    /// horizontal extent), sides leaning out so that the bottom is `bottom` times as wide as the
    /// top; square in plan.
    Tub {
        /// Wall thickness over the smaller horizontal extent.
        wall: f32,
        /// Width at the bottom divided by width at the top.
        bottom: f32,
    },
    /// The same, round in plan.
    RoundTub {
        /// Wall thickness over the smaller horizontal extent.
        wall: f32,
        /// Width at the bottom divided by width at the top.
        bottom: f32,
    },
}

/// What a surface is like; the renderer gives each its texture and gloss.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
pub enum Finish {
    /// Even and dull.
    Matte,
    /// Even with a highlight.
    Glossy,
    /// Brushed or polished metal.
    Metal,
    /// Grain along the longest extent.
    Wood,
    /// Fine weave.
    Fabric,
    /// Coarse basket weave.
    Wicker,
    /// Fruit skin: slight mottling.
    Skin,
    /// Crust: strong mottling.
    Crust,
    /// Dark, reflecting glass.
    Glass,
}

/// One solid of a class's shape, in the class's unit box.
///
/// The unit box spans x and z in [-0.5, 0.5] and y in [0, 1]; multiplied by the size of the
/// object it becomes metres, with the origin at the bottom center and the front towards -z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Part {
    /// Its form.
    pub solid: Solid,
    /// Middle of the part in the unit box.
    pub center: [f32; 3],
    /// Full extents of the part before turning, as fractions of the object's box.
    pub extent: [f32; 3],
    /// Turn about the part's middle, degrees, applied about z, then x, then y.
    pub turn_deg: [f32; 3],
    /// sRGB color.
    pub color: [u8; 3],
    /// Texture and gloss.
    pub finish: Finish,
    /// Whether bodies and falling things collide with it.
    pub collides: bool,
    /// Whether things may be put on its top face.
    pub supports: bool,
}

impl Part {
    /// A part that collides, without turn or supporting surface.
    pub const fn new(
        solid: Solid,
        center: [f32; 3],
        extent: [f32; 3],
        color: [u8; 3],
        finish: Finish,
    ) -> Part {
        Part {
            solid,
            center,
            extent,
            turn_deg: [0.0; 3],
            color,
            finish,
            collides: true,
            supports: false,
        }
    }

    /// The same part turned (degrees about z, then x, then y).
    pub const fn turned(mut self, turn_deg: [f32; 3]) -> Part {
        self.turn_deg = turn_deg;
        self
    }

    /// The same part, only to be looked at.
    pub const fn ghost(mut self) -> Part {
        self.collides = false;
        self
    }

    /// The same part, with a top face on which things may be put.
    pub const fn surface(mut self) -> Part {
        self.supports = true;
        self
    }
}

/// All there is to know of a class.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ClassInfo {
    /// Unique, in snake case; what files, traces and agents use.
    pub name: &'static str,
    /// What a person calls it; two bananas and two chairs share a label.
    pub label: &'static str,
    /// The model of the original that this class stands for, if any.
    pub original_model: Option<&'static str>,
    /// Place in the original detector's list of 53 classes, if it is one of them.
    pub detector_index: Option<u8>,
    /// The part it plays.
    pub role: Role,
    /// The target sets it belongs to.
    pub sets: &'static [TargetSet],
    /// Extents along x (width), y (height) and z (depth), metres.
    pub size_m: [f32; 3],
    /// Mass, kilograms (moving house: the original's mass units).
    pub mass_kg: f32,
    /// Its shape.
    pub parts: &'static [Part],
    /// Alternative colors of its main part (`parts[0]`); an object's `variant` chooses.
    pub palette: &'static [[u8; 3]],
}

impl ClassInfo {
    /// Whether people pick it up with one hand: targets, containers, fragile things.
    pub fn is_carriable(&self) -> bool {
        matches!(self.role, Role::Target | Role::Container | Role::Fragile)
    }

    /// Whether it can be a target of some episode.
    pub fn is_possible_target(&self) -> bool {
        matches!(self.role, Role::Target | Role::Fragile | Role::HeavyTarget)
    }

    /// Whether it can be moved at all during an episode.
    pub fn is_movable(&self) -> bool {
        self.is_carriable() || matches!(self.role, Role::Obstacle | Role::HeavyTarget)
    }
}

/// Every class, in a fixed order.
pub static CLASSES: [ClassInfo; COUNT] = concat(GROUPS);

const GROUPS: &[&[ClassInfo]] = &[
    food::CLASSES,
    goods::CLASSES,
    containers::CLASSES,
    moving::CLASSES,
    street::CLASSES,
    house::CLASSES,
    obstacles::CLASSES,
    actors::CLASSES,
    decor::CLASSES,
];

const COUNT: usize = {
    let mut n = 0;
    let mut g = 0;
    while g < GROUPS.len() {
        n += GROUPS[g].len();
        g += 1;
    }
    n
};

const fn concat(groups: &[&[ClassInfo]]) -> [ClassInfo; COUNT] {
    let mut out = [groups[0][0]; COUNT];
    let (mut g, mut k) = (0, 0);
    while g < groups.len() {
        let mut i = 0;
        while i < groups[g].len() {
            out[k] = groups[g][i];
            k += 1;
            i += 1;
        }
        g += 1;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ClassId;

    #[test]
    fn names_are_unique_and_found() {
        for id in ClassId::all() {
            assert_eq!(ClassId::by_name(id.name()), Some(id), "{}", id.name());
        }
        assert_eq!(ClassId::by_name("no such thing"), None);
    }

    #[test]
    fn the_original_detectors_53_classes_are_all_here_once() {
        let mut indices: Vec<u8> = CLASSES.iter().filter_map(|c| c.detector_index).collect();
        indices.sort_unstable();
        assert_eq!(indices, (0..53).collect::<Vec<u8>>());
    }

    #[test]
    fn shapes_stay_in_their_boxes_and_have_a_solid_part() {
        for class in &CLASSES {
            assert!(class.size_m.iter().all(|s| *s > 0.0) && class.mass_kg > 0.0, "{}", class.name);
            if class.role == Role::Person {
                continue;
            }
            assert!(class.parts.iter().any(|p| p.collides), "{} would be air", class.name);
            for part in class.parts.iter().filter(|p| p.turn_deg == [0.0; 3]) {
                for axis in 0..3 {
                    let base = if axis == 1 { 0.5 } else { 0.0 };
                    let reach = (part.center[axis] - base).abs() + 0.5 * part.extent[axis];
                    assert!(
                        reach <= 0.5 + 1e-3,
                        "{}: a part leaves the box on axis {axis}",
                        class.name
                    );
                }
            }
        }
    }

    #[test]
    fn the_first_alternative_color_is_that_of_the_shape() {
        for class in CLASSES.iter().filter(|c| !c.palette.is_empty()) {
            assert_eq!(class.palette[0], class.parts[0].color, "{}", class.name);
        }
    }

    #[test]
    fn what_supports_things_also_stops_them_and_is_level() {
        for class in &CLASSES {
            for part in class.parts.iter().filter(|p| p.supports) {
                assert!(part.collides && part.turn_deg == [0.0; 3], "{}", class.name);
            }
        }
    }
}
