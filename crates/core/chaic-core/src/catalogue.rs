//! Catalogue of all object classes.
//!
//! One table lists size, mass, role and shape of each class. Generators, collisions, rendering,
//! perception and the docs all use it.
//!
//! Sizes and masses of the benchmark's classes are those of the original after its own scaling
//! (facts S8.1, S9.1 and S11.3, measured from its model records). Masses of small objects, which
//! the original sets to arbitrary numbers, are those of real objects.

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

/// Set of possible targets; the hidden goal consists of one whole set.
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

impl TargetSet {
    /// Short name, unique among all sets.
    pub fn name(self) -> &'static str {
        match self {
            TargetSet::Fruit => "fruit",
            TargetSet::Bread => "bread",
            TargetSet::Work => "work",
            TargetSet::School => "school",
            TargetSet::ShopFruit => "shop_fruit",
            TargetSet::ShopBakery => "shop_bakery",
            TargetSet::ShopDrinks => "shop_drinks",
            TargetSet::Furniture => "furniture",
        }
    }
}

/// Role of a class in the benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
pub enum Role {
    /// May be a target of an episode.
    Target,
    /// Can hold three targets and is carried in one hand.
    Container,
    /// A possible target that a child may break.
    Fragile,
    /// Stands in doorways until an agent removes it.
    Obstacle,
    /// Movable only in the moving-house task, where it is the target.
    HeavyTarget,
    /// Part of a house or street; never moved.
    Furnishing,
    /// The bicycle with its basket.
    Vehicle,
    /// A human body.
    Person,
}

/// Primitive solid that fills the box of its [`Part`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Solid {
    /// The whole box.
    Cuboid,
    /// The ellipsoid inscribed in the box.
    Ellipsoid,
    /// Cone frustum along the part's y axis. Its width at the top is `top` times the width at the
    /// bottom: 1 is a cylinder, 0 a cone.
    Frustum {
        /// Width at the top divided by width at the bottom.
        top: f32,
    },
    /// A ring in the part's xz plane.
    Torus {
        /// Tube diameter divided by outer diameter.
        tube: f32,
    },
    /// A sector of a torus in the part's xz plane with its opening toward +z, for handles and
    /// bananas.
    Arc {
        /// Tube diameter divided by outer diameter.
        tube: f32,
        /// Angle of the sector, degrees, centered on -z.
        degrees: f32,
    },
    /// An open box with inclined walls, square in plan.
    Tub {
        /// Wall thickness divided by the smaller horizontal extent.
        wall: f32,
        /// Width at the bottom divided by width at the top.
        bottom: f32,
    },
    /// An open tub, round in plan.
    RoundTub {
        /// Wall thickness divided by the smaller horizontal extent.
        wall: f32,
        /// Width at the bottom divided by width at the top.
        bottom: f32,
    },
}

/// Surface finish; the renderer assigns a texture and a gloss to each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
pub enum Finish {
    /// Uniform and dull.
    Matte,
    /// Uniform with a highlight.
    Glossy,
    /// Brushed or polished metal.
    Metal,
    /// Wood grain along the longest extent.
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

/// A solid of a class's shape, in the unit box of the class.
///
/// The unit box spans x and z in [-0.5, 0.5] and y in [0, 1]. Multiplied by the size of the object
/// it is in meters, with the origin at the bottom center and the front toward -z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Part {
    /// Primitive solid.
    pub solid: Solid,
    /// Center of the part in the unit box.
    pub center: [f32; 3],
    /// Full extents of the part before rotation, as fractions of the object's box.
    pub extent: [f32; 3],
    /// Rotation about the part's center, degrees, applied about z, then x, then y.
    pub turn_deg: [f32; 3],
    /// sRGB color.
    pub color: [u8; 3],
    /// Surface finish.
    pub finish: Finish,
    /// True if bodies and falling objects collide with it.
    pub collides: bool,
    /// True if objects can be placed on its top face.
    pub supports: bool,
}

impl Part {
    /// Creates a colliding part without rotation or supporting surface.
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

    /// Returns the part with a rotation (degrees about z, then x, then y).
    pub const fn turned(mut self, turn_deg: [f32; 3]) -> Part {
        self.turn_deg = turn_deg;
        self
    }

    /// Returns the part without collision.
    pub const fn non_colliding(mut self) -> Part {
        self.collides = false;
        self
    }

    /// Returns the part with a supporting top face.
    pub const fn surface(mut self) -> Part {
        self.supports = true;
        self
    }
}

/// Properties of an object class.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ClassInfo {
    /// Unique name in snake case, for files, traces and agents.
    pub name: &'static str,
    /// Display name. Classes may share it, as the two bananas and the two chairs do.
    pub label: &'static str,
    /// Model of the original that this class represents.
    pub original_model: Option<&'static str>,
    /// Index in the original detector's list of 53 classes.
    pub detector_index: Option<u8>,
    /// Role in the benchmark.
    pub role: Role,
    /// Target sets with this class.
    pub sets: &'static [TargetSet],
    /// Extents along x (width), y (height) and z (depth), meters.
    pub size_m: [f32; 3],
    /// Mass, kilograms (moving house: the mass units of the original).
    pub mass_kg: f32,
    /// Shape.
    pub parts: &'static [Part],
    /// Alternative colors of the main part (`parts[0]`), selected by the `variant` of an object.
    pub palette: &'static [[u8; 3]],
}

impl ClassInfo {
    /// Returns whether one hand can carry such an object: a target, container or fragile object.
    pub fn is_carriable(&self) -> bool {
        matches!(self.role, Role::Target | Role::Container | Role::Fragile)
    }

    /// Returns whether such an object can be a target of an episode.
    pub fn is_possible_target(&self) -> bool {
        matches!(self.role, Role::Target | Role::Fragile | Role::HeavyTarget)
    }

    /// Returns whether such an object can be moved during an episode.
    pub fn is_movable(&self) -> bool {
        self.is_carriable() || matches!(self.role, Role::Obstacle | Role::HeavyTarget)
    }
}

/// All classes, in a fixed order.
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
    fn names_are_unique() {
        for id in ClassId::all() {
            assert_eq!(ClassId::from_name(id.name()), Some(id), "{}", id.name());
        }
        assert_eq!(ClassId::from_name("no such thing"), None);
    }

    #[test]
    fn all_53_classes_of_the_original_detector_are_listed_once() {
        let mut indices: Vec<u8> = CLASSES.iter().filter_map(|c| c.detector_index).collect();
        indices.sort_unstable();
        assert_eq!(indices, (0..53).collect::<Vec<u8>>());
    }

    #[test]
    fn shapes_stay_in_their_boxes_and_have_a_colliding_part() {
        for class in &CLASSES {
            assert!(class.size_m.iter().all(|s| *s > 0.0) && class.mass_kg > 0.0, "{}", class.name);
            if class.role == Role::Person {
                continue;
            }
            assert!(class.parts.iter().any(|p| p.collides), "{} has no colliding part", class.name);
            for part in class.parts.iter().filter(|p| p.turn_deg == [0.0; 3]) {
                for axis in 0..3 {
                    let base = if axis == 1 { 0.5 } else { 0.0 };
                    let extent = (part.center[axis] - base).abs() + 0.5 * part.extent[axis];
                    assert!(
                        extent <= 0.5 + 1e-3,
                        "{}: a part leaves the box on axis {axis}",
                        class.name
                    );
                }
            }
        }
    }

    #[test]
    fn the_first_palette_color_is_the_color_of_the_main_part() {
        for class in CLASSES.iter().filter(|c| !c.palette.is_empty()) {
            assert_eq!(class.palette[0], class.parts[0].color, "{}", class.name);
        }
    }

    #[test]
    fn supporting_parts_collide_and_are_horizontal() {
        for class in &CLASSES {
            for part in class.parts.iter().filter(|p| p.supports) {
                assert!(part.collides && part.turn_deg == [0.0; 3], "{}", class.name);
            }
        }
    }
}
