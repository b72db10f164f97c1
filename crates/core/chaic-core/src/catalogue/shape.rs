//! Helpers for writing the shapes of the catalogue in meters.
//!
//! Upright solids are placed by the center of their bottom face, like objects. Rods, rings and arcs
//! are placed by their center. [`in_meters`] converts a list of parts into fractions of the
//! object's box.

use super::{ClassInfo, Finish, Part, Role, Solid};

/// sRGB color and finish of a part.
#[derive(Clone, Copy)]
pub(super) struct Paint(pub(super) [u8; 3], pub(super) Finish);

pub(super) const WHITE: Paint = Paint([238, 238, 234], Finish::Matte);
pub(super) const LACQUER: Paint = Paint([236, 234, 228], Finish::Glossy);
pub(super) const BLACK: Paint = Paint([28, 28, 31], Finish::Matte);
pub(super) const GLOSSY_BLACK: Paint = Paint([20, 20, 23], Finish::Glossy);
pub(super) const STEEL: Paint = Paint([186, 189, 194], Finish::Metal);
pub(super) const DARK_STEEL: Paint = Paint([84, 88, 94], Finish::Metal);
pub(super) const BRASS: Paint = Paint([200, 162, 74], Finish::Metal);
pub(super) const GLASS: Paint = Paint([38, 52, 64], Finish::Glass);

/// Defaults of immovable classes.
pub(super) const FURNISHING: ClassInfo = ClassInfo {
    name: "",
    label: "",
    original_model: None,
    detector_index: None,
    role: Role::Furnishing,
    sets: &[],
    size_m: [1.0; 3],
    mass_kg: 1.0,
    parts: &[],
    palette: &[],
};

/// Defaults of classes that one hand carries.
pub(super) const TARGET: ClassInfo = ClassInfo { role: Role::Target, ..FURNISHING };

/// Converts parts in meters to fractions of an object of this size.
pub(super) const fn in_meters<const N: usize>(size_m: [f32; 3], mut parts: [Part; N]) -> [Part; N] {
    let mut n = 0;
    while n < N {
        let mut axis = 0;
        while axis < 3 {
            parts[n].center[axis] /= size_m[axis];
            parts[n].extent[axis] /= size_m[axis];
            axis += 1;
        }
        n += 1;
    }
    parts
}

pub(super) const fn cuboid(bottom: [f32; 3], size: [f32; 3], paint: Paint) -> Part {
    upright(Solid::Cuboid, bottom, size, paint)
}

pub(super) const fn ball(bottom: [f32; 3], size: [f32; 3], paint: Paint) -> Part {
    upright(Solid::Ellipsoid, bottom, size, paint)
}

pub(super) const fn cylinder(bottom: [f32; 3], size: [f32; 3], paint: Paint) -> Part {
    taper(1.0, bottom, size, paint)
}

/// A frustum whose top is `top` times as wide as its bottom.
pub(super) const fn taper(top: f32, bottom: [f32; 3], size: [f32; 3], paint: Paint) -> Part {
    upright(Solid::Frustum { top }, bottom, size, paint)
}

/// An open box with walls of `wall_m`; its bottom is `narrowing` times as wide as its top.
pub(super) const fn tub(
    bottom: [f32; 3],
    size: [f32; 3],
    wall_m: f32,
    narrowing: f32,
    paint: Paint,
) -> Part {
    let wall = wall_m / if size[0] < size[2] { size[0] } else { size[2] };
    upright(Solid::Tub { wall, bottom: narrowing }, bottom, size, paint)
}

/// An open round tub, with the same parameters as [`tub`].
pub(super) const fn round_tub(
    bottom: [f32; 3],
    size: [f32; 3],
    wall_m: f32,
    narrowing: f32,
    paint: Paint,
) -> Part {
    let wall = wall_m / if size[0] < size[2] { size[0] } else { size[2] };
    upright(Solid::RoundTub { wall, bottom: narrowing }, bottom, size, paint)
}

/// A thin cylinder about `center`, rotated from upright (degrees about z, then x, then y).
pub(super) const fn rod(
    center: [f32; 3],
    length_m: f32,
    width_m: f32,
    turn_deg: [f32; 3],
    paint: Paint,
) -> Part {
    let Paint(color, finish) = paint;
    let extent = [width_m, length_m, width_m];
    Part::new(Solid::Frustum { top: 1.0 }, center, extent, color, finish).turned(turn_deg)
}

/// A cylinder along x.
pub(super) const fn rod_x(center: [f32; 3], length_m: f32, width_m: f32, paint: Paint) -> Part {
    rod(center, length_m, width_m, [0.0, 0.0, 90.0], paint)
}

/// A cylinder along z.
pub(super) const fn rod_z(center: [f32; 3], length_m: f32, width_m: f32, paint: Paint) -> Part {
    rod(center, length_m, width_m, [90.0, 0.0, 0.0], paint)
}

/// A flat ring about `center`.
pub(super) const fn ring(center: [f32; 3], outer_m: f32, tube_m: f32, paint: Paint) -> Part {
    let Paint(color, finish) = paint;
    let solid = Solid::Torus { tube: tube_m / outer_m };
    Part::new(solid, center, [outer_m, tube_m, outer_m], color, finish)
}

/// The sector of a flat ring about `center` within `degrees` around -z. It does not collide,
/// because most of its box is empty.
pub(super) const fn arc(
    center: [f32; 3],
    outer_m: f32,
    tube_m: f32,
    degrees: f32,
    paint: Paint,
) -> Part {
    let Paint(color, finish) = paint;
    let solid = Solid::Arc { tube: tube_m / outer_m, degrees };
    Part::new(solid, center, [outer_m, tube_m, outer_m], color, finish).non_colliding()
}

/// Rotation of an arc to upright, left to right, like the handle of a bucket.
pub(super) const ARCH: [f32; 3] = [90.0, 0.0, 0.0];
/// Rotation of an arc to upright, front to back.
pub(super) const ARCH_ALONG: [f32; 3] = [90.0, 90.0, 0.0];
/// Rotation of a ring to upright, rolling along z; an arc with it bulges forward.
pub(super) const ROLLING: [f32; 3] = [0.0, 0.0, 90.0];
/// Rotation of an arc that makes it bulge backward.
pub(super) const BACKWARD: [f32; 3] = [0.0, 180.0, 90.0];

const fn upright(solid: Solid, bottom: [f32; 3], size: [f32; 3], paint: Paint) -> Part {
    let Paint(color, finish) = paint;
    let center = [bottom[0], bottom[1] + 0.5 * size[1], bottom[2]];
    Part::new(solid, center, size, color, finish)
}
