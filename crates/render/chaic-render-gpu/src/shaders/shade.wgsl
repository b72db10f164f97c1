// Color of each pixel whose triangle is known: one thread a pixel.
//
// What is shown is worked out for each vertex of a thing's triangle and mixed by where the pixel
// sees it; structure, which is large, is lit at the point seen. Then textures and the darkness of
// the ground dim it. `chaic-render` does the same (paint.rs, shade.rs), a few pixels at a time.

@group(0) @binding(0) var<storage, read> views: array<View>;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
@group(0) @binding(2) var<storage, read> meshes: array<Mesh>;
@group(0) @binding(3) var<storage, read> levels: array<u32>;
@group(0) @binding(4) var<storage, read> vertices: array<vec4u>;
@group(0) @binding(5) var<storage, read> triangles: array<vec2u>;
@group(0) @binding(6) var<storage, read> skins: array<Skin>;
@group(0) @binding(7) var<storage, read> lights: array<Light>;
// Lamps of all worlds, metres.
@group(0) @binding(8) var<storage, read> lamps: array<vec4f>;
// Of each cell of the ground its brightness and room, a byte each, two cells a word; rows along x
// begin with a word.
@group(0) @binding(9) var<storage, read> ground: array<u32>;
// Of each texture its tile at all sizes, the largest first; a texel and three neighbors a word.
@group(0) @binding(10) var<storage, read> atlas: array<u32>;
@group(0) @binding(11) var<storage, read> depth: array<f32>;
// First the triangle's name, then the color; shape [view, row, column].
@group(0) @binding(12) var<storage, read_write> color: array<u32>;
@group(0) @binding(13) var<uniform> round: Round;

// `SkinRecord` of records.rs.
struct Skin {
    // Linear.
    color: vec3f,
    // Texels per metre; 0 without texture.
    texels_per_m: f32,
    axes_x: vec3f,
    gloss: u32,
    axes_y: vec3f,
    is_tinted: u32,
    axes_z: vec3f,
    // Where the texture's tile begins.
    first_texel: u32,
}

// `LightRecord` of records.rs.
struct Light {
    to_sun: vec3f,
    ceiling_m: f32,
    sun: vec3f,
    first_lamp: u32,
    lamp: vec3f,
    n_lamps: u32,
    // From above and from below.
    outdoors_high: vec3f,
    first_cell: u32,
    outdoors_low: vec3f,
    n_x: u32,
    indoors_high: vec3f,
    n_z: u32,
    indoors_low: vec3f,
    cells_per_m: f32,
    horizon: vec3f,
    // Where the ground's grid begins, metres.
    min_x: f32,
    zenith: vec3f,
    min_z: f32,
    below: vec3f,
    padding: u32,
}

const SKY: u32 = 0u;
const LAMP: u32 = 1u;
const EACH_POINT: u32 = 2u;

const DULL: u32 = 0u;
const SATIN: u32 = 1u;
const SHINY: u32 = 2u;
const METAL: u32 = 3u;
const GLASS: u32 = 4u;
const GLOW: u32 = 5u;
const PANE: u32 = 6u;

const NO_ROOM: u32 = 255u;

// As in `chaic-render`'s lamps.rs and paint.rs.
const CEILING_FARTHER_M: f32 = 1.0;
const CEILING_TONE: f32 = 1.05;
// The lawn outside of windows, linear.
const LAWN: vec3f = vec3f(0.16, 0.28, 0.09);

// Where the direct light at a point comes from.
struct Direct {
    to: vec3f,
    // What distance leaves of it.
    strength: f32,
    is_indoors: bool,
}

// What a surface sends to an eye: `factor * color + add`.
struct Shine {
    factor: vec3f,
    add: vec3f,
}

@compute @workgroup_size(8, 8)
fn shade(@builtin(global_invocation_id) at: vec3u) {
    if (at.x >= round.width || at.y >= round.height) {
        return;
    }
    let v = round.first_view + at.z;
    let pixel = (v * round.height + at.y) * round.width + at.x;
    let view = views[v];
    if (view.focal == 0.0) {
        color[pixel] = 0xff000000u;
        return;
    }
    let light = lights[view.light];
    let off = (vec2f(at.xy) + 0.5 - vec2f(view.mu, view.mv)) / view.focal;
    let ray = view.ahead + view.right * off.x + view.down * off.y;
    let name = color[pixel];
    var shows = vec3f(0.0);
    if (name == NOBODY) {
        shows = shown(sky_along(light, ray, light.below));
    } else {
        shows = surface(view, light, name, ray, depth[pixel]);
    }
    let whole = vec3u(clamp(shows, vec3f(0.0), vec3f(255.0)));
    color[pixel] = whole.x | (whole.y << 8u) | (whole.z << 16u) | 0xff000000u;
}

// The linear color of the sky along a ray, and of the ground, far away, that has this color close by.
fn sky_along(light: Light, ray: vec3f, ground: vec3f) -> vec3f {
    let y = ray.y * inverseSqrt(max(dot(ray, ray), 1e-12));
    let up = (1.0 - y) * (1.0 - y);
    let is_above = y >= 0.0;
    let t = select(min(-6.0 * y, 1.0), 1.0 - up * (0.4 + 0.6 * up), is_above);
    return mix(light.horizon, select(ground, light.zenith, is_above), t);
}

fn surface(view: View, light: Light, name: u32, ray: vec3f, depth_m: f32) -> vec3f {
    let index = name >> 16u;
    let instance = instances[view.first_instance + index];
    let level = meshes[instance.mesh].levels[levels[view.first_visible + index]];
    let packed = triangles[level.y + (name & 0xffffu)];
    let is_smooth = packed.y >> 24u != 0u;
    let skin = skins[level.w + ((packed.y >> 16u) & 0xffu)];
    let ca = vertices[level.x + (packed.x & 0xffffu)];
    let cb = vertices[level.x + (packed.x >> 16u)];
    let cc = vertices[level.x + (packed.y & 0xffffu)];
    let a = bitcast<vec3f>(ca.xyz);
    let b = bitcast<vec3f>(cb.xyz);
    let c = bitcast<vec3f>(cc.xyz);
    let area2 = cross(b - a, c - a);
    let face = unit(area2);
    let turn = mat3x3f(instance.x, instance.y, instance.z);
    let normal = turn * face;
    let point = view.eye + ray * depth_m;
    // The point in the instance's frame.
    let local = (point - instance.origin) * turn;
    let is_tinted = skin.is_tinted * instance.is_tinted != 0u;
    let own = select(skin.color, instance.tint, is_tinted) * instance.factor;
    var shows = vec3f(0.0);
    var bright = 1.0;
    if (instance.lit_by == EACH_POINT) {
        shows = structure(light, own, skin.gloss, point, normal, ray);
        if (instance.entity == FLOOR) {
            bright = ground_brightness(light, point);
        }
    } else {
        let middle = instance.origin + turn * (0.5 * (instance.low + instance.high));
        let direct = direct_light(light, instance.lit_by == LAMP, instance.lamp, middle);
        let lit = Lit(turn, instance.origin, view.eye, direct, own, skin.gloss);
        if (!is_smooth && skin.gloss == DULL) {
            shows = thing(light, lit, (a + b + c) / 3.0, face);
        } else {
            let at_a = thing(light, lit, a, select(face, normal_of(ca.w), is_smooth));
            let at_b = thing(light, lit, b, select(face, normal_of(cb.w), is_smooth));
            let at_c = thing(light, lit, c, select(face, normal_of(cc.w), is_smooth));
            let per_area2 = 1.0 / max(dot(area2, area2), 1e-30);
            let s = dot(cross(c - a, area2), local - a) * per_area2;
            let t = dot(cross(area2, b - a), local - a) * per_area2;
            let mixed = at_a + (at_b - at_a) * s + (at_c - at_a) * t;
            shows = clamp(mixed, min(min(at_a, at_b), at_c), max(max(at_a, at_b), at_c));
        }
    }
    if (skin.texels_per_m > 0.0) {
        // Seen at a slant a pixel covers more; the root keeps textures from blurring too early.
        let covers_m = depth_m / (view.focal * sqrt(max(abs(dot(normal, ray)), 0.05)));
        bright *= texture_brightness(skin, face, local, covers_m);
    }
    return shows * bright;
}

fn unit(v: vec3f) -> vec3f {
    let l2 = dot(v, v);
    return select(vec3f(0.0, 1.0, 0.0), v * inverseSqrt(l2), l2 > 1e-30 && l2 < 1e30);
}

// Unfolds a normal from an octahedron.
fn normal_of(packed: u32) -> vec3f {
    let e = unpack2x16snorm(packed);
    var n = vec3f(e, 1.0 - abs(e.x) - abs(e.y));
    if (n.z < 0.0) {
        n = vec3f((1.0 - abs(e.yx)) * select(vec2f(-1.0), vec2f(1.0), e >= vec2f(0.0)), n.z);
    }
    return normalize(n);
}

fn direct_light(light: Light, is_indoors: bool, lamp: vec3f, p: vec3f) -> Direct {
    if (!is_indoors) {
        return Direct(light.to_sun, 1.0, false);
    }
    let d = lamp - p;
    let d2 = dot(d, d) + 0.3;
    return Direct(d * inverseSqrt(d2), 1.0 / (1.0 + 0.085 * d2), true);
}

// What a surface with this unit normal does with that light and with the light around, seen along
// the unit vector `to_eye`.
fn shine(light: Light, direct: Direct, normal: vec3f, gloss: u32, to_eye: vec3f) -> Shine {
    let cosine = dot(direct.to, normal);
    var source = light.sun * max(cosine, 0.0);
    var high = light.outdoors_high;
    var low = light.outdoors_low;
    if (direct.is_indoors) {
        source = light.lamp * max(cosine + 0.35, 0.0) * direct.strength;
        high = light.indoors_high;
        low = light.indoors_low;
    }
    // Walls at right angles must differ even where no lamp is near, and what faces down sees little
    // but its own shadow.
    let corner = (1.0 + 0.07 * normal.x - 0.05 * normal.z) * select(1.0, 0.7, normal.y < -0.5);
    let factor = mix(low, high, 0.5 * normal.y + 0.5) * corner + source;
    if (gloss == DULL) {
        return Shine(factor, vec3f(0.0));
    }
    let half = direct.to + to_eye;
    let c = max(dot(normal, half), 0.0) * inverseSqrt(max(dot(half, half), 1e-12));
    let facing = dot(normal, to_eye);
    let c2 = c * c;
    let c8 = c2 * c2 * c2 * c2;
    let away = 1.0 - max(facing, 0.0);
    let edge = away * away;
    // How far up the mirrored view looks: 0 down, 1 up.
    let mirror = max(0.5 + 0.5 * (2.0 * facing * normal.y - to_eye.y), 0.0);
    var keep = 1.0;
    var glint = 0.0;
    var sky = 0.0;
    switch gloss {
        case SATIN: {
            glint = 0.07 * c8;
            sky = 0.02 * edge;
        }
        case SHINY: {
            glint = 0.45 * c8 * c8 * c8 * c8;
            sky = 0.07 * edge * edge;
        }
        case METAL: {
            keep = 0.62 + 0.75 * mirror * mirror;
            glint = 0.4 * c8 * c8;
            sky = 0.05 * edge;
        }
        default: {
            keep = 0.6;
            glint = 0.6 * c8 * c8;
            sky = 0.75 * mirror * (0.10 + 0.6 * edge * edge);
        }
    }
    return Shine(factor * keep, source * glint + vec3f(0.85, 0.95, 1.05) * sky);
}

// From linear light to what is shown, 0 to 255.
fn shown(linear: vec3f) -> vec3f {
    return sqrt(clamp(linear, vec3f(0.0), vec3f(1.0))) * 255.0;
}

// By what the color of a lamp is multiplied.
fn glow(light: Light) -> vec3f {
    return 0.5 + 0.5 * light.lamp / max(max(light.lamp.x, max(light.lamp.y, light.lamp.z)), 1e-6);
}

// What all vertices of a thing's triangle share.
struct Lit {
    turn: mat3x3f,
    origin: vec3f,
    eye: vec3f,
    direct: Direct,
    color: vec3f,
    gloss: u32,
}

// What is shown of a point of a thing, given in its frame.
fn thing(light: Light, lit: Lit, p: vec3f, n: vec3f) -> vec3f {
    let point = lit.turn * p;
    let to_eye = unit(lit.eye - lit.origin - point);
    if (lit.gloss == GLOW) {
        return shown(lit.color * glow(light));
    }
    let s = shine(light, lit.direct, lit.turn * n, lit.gloss, to_eye);
    // The foot of a thing stands in its own shadow.
    let foot = 0.76 + 0.24 * clamp(point.y * 7.0, 0.0, 1.0);
    return shown(lit.color * s.factor * foot + s.add);
}

// What is shown of a point of structure in the world.
fn structure(light: Light, own: vec3f, gloss: u32, p: vec3f, n: vec3f, ray: vec3f) -> vec3f {
    if (gloss == PANE) {
        let lawn = LAWN * (light.outdoors_high + light.sun * max(light.to_sun.y, 0.0));
        return shown(sky_along(light, ray, lawn));
    }
    if (gloss == GLOW) {
        return shown(own * glow(light));
    }
    // A step off the surface leaves the wall.
    let at = on_ground(light, p + 0.1 * n);
    let room = cell(light, vec2i(at)) >> 8u;
    let has_lamp = room < light.n_lamps;
    let lamp = lamps[light.first_lamp + select(0u, room, has_lamp)].xyz;
    // A ceiling is lit as if it were higher.
    let is_ceiling = n.y < -0.5;
    let farther = vec3f(0.0, select(0.0, CEILING_FARTHER_M, is_ceiling), 0.0);
    let s = shine(light, direct_light(light, has_lamp, lamp, p + farther), n, gloss, -unit(ray));
    var factor = s.factor;
    if (is_ceiling) {
        factor *= CEILING_TONE;
    } else if (n.y < 0.5) {
        let low = max(1.0 - p.y * 2.2, 0.0);
        let high = max(1.0 - (light.ceiling_m - p.y) * 2.2, 0.0);
        factor *= 1.0 - 0.22 * low * low - 0.16 * high * high;
    }
    return shown(own * factor + s.add);
}

// Where a point lies on the ground's grid, in cells.
fn on_ground(light: Light, p: vec3f) -> vec2f {
    return (p.xz - vec2f(light.min_x, light.min_z)) * light.cells_per_m;
}

// Brightness of a cell, and its room in the second byte.
fn cell(light: Light, at: vec2i) -> u32 {
    let k = vec2u(clamp(at, vec2i(0), vec2i(vec2u(light.n_x, light.n_z)) - 1));
    let word = light.first_cell + k.y * ((light.n_x + 1u) / 2u) + k.x / 2u;
    return (ground[word] >> (16u * (k.x % 2u))) & 0xffffu;
}

// How bright the ground is, 0 to 1.
fn ground_brightness(light: Light, p: vec3f) -> f32 {
    let at = on_ground(light, p) - 0.5;
    let k = vec2i(floor(at));
    let f = at - floor(at);
    let b = vec4f(
        f32(cell(light, k) & 0xffu),
        f32(cell(light, k + vec2i(1, 0)) & 0xffu),
        f32(cell(light, k + vec2i(0, 1)) & 0xffu),
        f32(cell(light, k + vec2i(1, 1)) & 0xffu),
    );
    return mix(mix(b.x, b.y, f.x), mix(b.z, b.w, f.x), f.y) / 255.0;
}

// Brightness of a texture where a pixel covers so much of it.
fn texture_brightness(skin: Skin, face: vec3f, local: vec3f, covers_m: f32) -> f32 {
    let facing = abs(vec3f(dot(skin.axes_x, face), dot(skin.axes_y, face), dot(skin.axes_z, face)));
    // Look along the axis that the face is most square to; the longest axis left is u.
    var u = skin.axes_x;
    var v = skin.axes_y;
    if (facing.x > facing.y && facing.x > facing.z) {
        u = skin.axes_y;
        v = skin.axes_z;
    } else if (facing.y > facing.z) {
        v = skin.axes_z;
    }
    let covered = clamp(covers_m * skin.texels_per_m, 1.0, f32(TILE_TEXELS));
    let level = min((bitcast<u32>(covered) >> 23u) - 127u, LOG2_TILE_TEXELS);
    // Levels of 4^n, 4^(n-1), ... texels: the first ones together.
    let whole = 4u * TILE_TEXELS * TILE_TEXELS;
    let first = skin.first_texel + (whole - (whole >> (2u * level))) / 3u;
    let log2_side = LOG2_TILE_TEXELS - level;
    let scale = skin.texels_per_m / f32(1u << level);
    // Middles of texels lie at halves.
    let at = vec2f(dot(u, local), dot(v, local)) * scale - 0.5;
    let k = vec2u(vec2i(floor(at))) & vec2u((1u << log2_side) - 1u);
    let f = at - floor(at);
    let texel = unpack4x8unorm(atlas[first + ((k.y << log2_side) | k.x)]);
    let mean = mix(mix(texel.x, texel.y, f.x), mix(texel.z, texel.w, f.x), f.y);
    return mean * (255.0 / 128.0);
}
