// Deferred shading: one thread per pixel.
//
// The color of an object is computed at the vertices of the triangle and interpolated; structure,
// which is large, is lit per pixel. Texture and ground shadow then scale the result. `chaic-render`
// does the same for several pixels at a time (shader.rs, shade.rs).

@group(0) @binding(0) var<storage, read> views: array<View>;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
@group(0) @binding(2) var<storage, read> meshes: array<Mesh>;
@group(0) @binding(3) var<storage, read> levels: array<u32>;
@group(0) @binding(4) var<storage, read> vertices: array<vec4u>;
@group(0) @binding(5) var<storage, read> triangles: array<vec2u>;
@group(0) @binding(6) var<storage, read> materials: array<Material>;
@group(0) @binding(7) var<storage, read> lights: array<Light>;
// Lamps of all worlds, meters.
@group(0) @binding(8) var<storage, read> lamps: array<vec4f>;
// Brightness and room of each ground cell, one byte each, two cells per word; rows along x begin
// with a new word.
@group(0) @binding(9) var<storage, read> ground: array<u32>;
// Tiles of all textures with all mip levels, the largest first; a texel and three neighbors per
// word.
@group(0) @binding(10) var<storage, read> atlas: array<u32>;
@group(0) @binding(11) var<storage, read> depth: array<f32>;
// Input: visibility id; output: color. Shape [view, row, column].
@group(0) @binding(12) var<storage, read_write> color: array<u32>;
@group(0) @binding(13) var<uniform> params: RoundParams;

// `SkinRecord` of records.rs.
struct Material {
    // Linear color.
    color: vec3f,
    // Texels per meter; 0 without texture.
    texels_per_m: f32,
    axes_x: vec3f,
    gloss: u32,
    axes_y: vec3f,
    is_tinted: u32,
    axes_z: vec3f,
    // Offset of the texture tile.
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
    // Ambient light from above and from below.
    outdoors_high: vec3f,
    first_cell: u32,
    outdoors_low: vec3f,
    n_x: u32,
    indoors_high: vec3f,
    n_z: u32,
    indoors_low: vec3f,
    cells_per_m: f32,
    horizon: vec3f,
    // Corner of the ground grid, meters.
    min_x: f32,
    zenith: vec3f,
    min_z: f32,
    below: vec3f,
    padding: u32,
}

const SKY: u32 = 0u;
const LAMP: u32 = 1u;
const PER_POINT: u32 = 2u;

const DULL: u32 = 0u;
const SATIN: u32 = 1u;
const SHINY: u32 = 2u;
const METAL: u32 = 3u;
const GLASS: u32 = 4u;
const GLOW: u32 = 5u;
const PANE: u32 = 6u;

const NO_ROOM: u32 = 255u;

// As in light_rig.rs and shader.rs of `chaic-render`.
const CEILING_EXTRA_M: f32 = 1.0;
const CEILING_FACTOR: f32 = 1.05;
// Lawn outside of windows, linear color.
const LAWN: vec3f = vec3f(0.16, 0.28, 0.09);

// Direct light at a point.
struct Direct {
    to: vec3f,
    // Attenuation by distance.
    strength: f32,
    is_indoors: bool,
}

// Light reflected to the eye: `factor * color + add`.
struct Reflection {
    factor: vec3f,
    add: vec3f,
}

@compute @workgroup_size(8, 8)
fn shade(@builtin(global_invocation_id) at: vec3u) {
    if (at.x >= params.width || at.y >= params.height) {
        return;
    }
    let v = params.first_view + at.z;
    let pixel = (v * params.height + at.y) * params.width + at.x;
    let view = views[v];
    if (view.focal == 0.0) {
        color[pixel] = 0xff000000u;
        return;
    }
    let light = lights[view.light];
    let off = (vec2f(at.xy) + 0.5 - vec2f(view.mu, view.mv)) / view.focal;
    let ray = view.forward + view.right * off.x + view.down * off.y;
    let visibility_id = color[pixel];
    var display = vec3f(0.0);
    if (visibility_id == BACKGROUND) {
        display = to_display(sky_color(light, ray, light.below));
    } else {
        display = surface_color(view, light, visibility_id, ray, depth[pixel]);
    }
    // A conversion to integers truncates; `chaic-render` rounds.
    let rgb8 = vec3u(round(clamp(display, vec3f(0.0), vec3f(255.0))));
    color[pixel] = rgb8.x | (rgb8.y << 8u) | (rgb8.z << 16u) | 0xff000000u;
}

// Linear color of the sky along a ray. Below the horizon, it fades into `ground`, the color of the
// nearby ground.
fn sky_color(light: Light, ray: vec3f, ground: vec3f) -> vec3f {
    let y = ray.y * inverseSqrt(max(dot(ray, ray), 1e-12));
    let up = (1.0 - y) * (1.0 - y);
    let is_above = y >= 0.0;
    let t = select(min(-6.0 * y, 1.0), 1.0 - up * (0.4 + 0.6 * up), is_above);
    return mix(light.horizon, select(ground, light.zenith, is_above), t);
}

fn surface_color(view: View, light: Light, visibility_id: u32, ray: vec3f, depth_m: f32) -> vec3f {
    let index = visibility_id >> 16u;
    let instance = instances[view.first_instance + index];
    let level = meshes[instance.mesh].levels[levels[view.first_visible + index]];
    let packed = triangles[level.y + (visibility_id & 0xffffu)];
    let is_smooth = packed.y >> 24u != 0u;
    let material = materials[level.w + ((packed.y >> 16u) & 0xffu)];
    let ca = vertices[level.x + (packed.x & 0xffffu)];
    let cb = vertices[level.x + (packed.x >> 16u)];
    let cc = vertices[level.x + (packed.y & 0xffffu)];
    let a = bitcast<vec3f>(ca.xyz);
    let b = bitcast<vec3f>(cb.xyz);
    let c = bitcast<vec3f>(cc.xyz);
    let area2 = cross(b - a, c - a);
    let face = unit(area2);
    let rotation = mat3x3f(instance.x, instance.y, instance.z);
    let normal = rotation * face;
    let point = view.eye + ray * depth_m;
    // The point in the instance frame.
    let local = (point - instance.origin) * rotation;
    let is_tinted = material.is_tinted * instance.is_tinted != 0u;
    let base_color = select(material.color, instance.tint, is_tinted) * instance.factor;
    var display = vec3f(0.0);
    var brightness = 1.0;
    if (instance.light_source == PER_POINT) {
        display = structure_color(light, base_color, material.gloss, point, normal, ray);
        if (instance.entity == FLOOR) {
            brightness = ground_brightness(light, point);
        }
    } else {
        let center = instance.origin + rotation * (0.5 * (instance.low + instance.high));
        let direct = direct_light(light, instance.light_source == LAMP, instance.lamp, center);
        let lighting = VertexLighting(rotation, instance.origin, view.eye, direct, base_color, material.gloss);
        if (!is_smooth && material.gloss == DULL) {
            display = object_color(light, lighting, (a + b + c) / 3.0, face);
        } else {
            let at_a = object_color(light, lighting, a, select(face, decode_normal(ca.w), is_smooth));
            let at_b = object_color(light, lighting, b, select(face, decode_normal(cb.w), is_smooth));
            let at_c = object_color(light, lighting, c, select(face, decode_normal(cc.w), is_smooth));
            let per_area2 = 1.0 / max(dot(area2, area2), 1e-30);
            let s = dot(cross(c - a, area2), local - a) * per_area2;
            let t = dot(cross(area2, b - a), local - a) * per_area2;
            let mixed = at_a + (at_b - at_a) * s + (at_c - at_a) * t;
            display = clamp(mixed, min(min(at_a, at_b), at_c), max(max(at_a, at_b), at_c));
        }
    }
    if (material.texels_per_m > 0.0) {
        // A pixel covers more at a slant; the square root keeps textures from blurring too early.
        let covers_m = depth_m / (view.focal * sqrt(max(abs(dot(normal, ray)), 0.05)));
        brightness *= texture_brightness(material, face, local, covers_m);
    }
    return display * brightness;
}

fn unit(v: vec3f) -> vec3f {
    let l2 = dot(v, v);
    return select(vec3f(0.0, 1.0, 0.0), v * inverseSqrt(l2), l2 > 1e-30 && l2 < 1e30);
}

// Decodes an octahedral normal.
fn decode_normal(packed: u32) -> vec3f {
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

// Reflection of direct and ambient light by a surface with this unit normal, toward the unit vector
// `to_eye`.
fn reflect_light(light: Light, direct: Direct, normal: vec3f, gloss: u32, to_eye: vec3f) -> Reflection {
    let cosine = dot(direct.to, normal);
    var source = light.sun * max(cosine, 0.0);
    var high = light.outdoors_high;
    var low = light.outdoors_low;
    if (direct.is_indoors) {
        source = light.lamp * max(cosine + 0.35, 0.0) * direct.strength;
        high = light.indoors_high;
        low = light.indoors_low;
    }
    // Perpendicular walls must differ in brightness even without a lamp nearby, and a surface that
    // faces down receives little light.
    let corner = (1.0 + 0.07 * normal.x - 0.05 * normal.z) * select(1.0, 0.7, normal.y < -0.5);
    let factor = mix(low, high, 0.5 * normal.y + 0.5) * corner + source;
    if (gloss == DULL) {
        return Reflection(factor, vec3f(0.0));
    }
    let half = direct.to + to_eye;
    let c = max(dot(normal, half), 0.0) * inverseSqrt(max(dot(half, half), 1e-12));
    let facing = dot(normal, to_eye);
    let c2 = c * c;
    let c8 = c2 * c2 * c2 * c2;
    let away = 1.0 - max(facing, 0.0);
    let edge = away * away;
    // Upward direction of the mirrored view: 0 is down, 1 is up.
    let mirror = max(0.5 + 0.5 * (2.0 * facing * normal.y - to_eye.y), 0.0);
    var diffuse = 1.0;
    var specular = 0.0;
    var mirror_light = 0.0;
    switch gloss {
        case SATIN: {
            specular = 0.07 * c8;
            mirror_light = 0.02 * edge;
        }
        case SHINY: {
            specular = 0.45 * c8 * c8 * c8 * c8;
            mirror_light = 0.07 * edge * edge;
        }
        case METAL: {
            diffuse = 0.62 + 0.75 * mirror * mirror;
            specular = 0.4 * c8 * c8;
            mirror_light = 0.05 * edge;
        }
        default: {
            diffuse = 0.6;
            specular = 0.6 * c8 * c8;
            mirror_light = 0.75 * mirror * (0.10 + 0.6 * edge * edge);
        }
    }
    return Reflection(factor * diffuse, source * specular + vec3f(0.85, 0.95, 1.05) * mirror_light);
}

// Converts linear light to a display color, 0 to 255.
fn to_display(linear: vec3f) -> vec3f {
    return sqrt(clamp(linear, vec3f(0.0), vec3f(1.0))) * 255.0;
}

// Factor on the color of a glowing lamp.
fn glow(light: Light) -> vec3f {
    return 0.5 + 0.5 * light.lamp / max(max(light.lamp.x, max(light.lamp.y, light.lamp.z)), 1e-6);
}

// Data that all vertices of an object's triangle share.
struct VertexLighting {
    rotation: mat3x3f,
    origin: vec3f,
    eye: vec3f,
    direct: Direct,
    color: vec3f,
    gloss: u32,
}

// Display color of an object point, given in the object frame.
fn object_color(light: Light, lighting: VertexLighting, p: vec3f, n: vec3f) -> vec3f {
    let point = lighting.rotation * p;
    let to_eye = unit(lighting.eye - lighting.origin - point);
    if (lighting.gloss == GLOW) {
        return to_display(lighting.color * glow(light));
    }
    let s = reflect_light(light, lighting.direct, lighting.rotation * n, lighting.gloss, to_eye);
    // Approximates ambient occlusion at the foot of an object.
    let occlusion = 0.76 + 0.24 * clamp(point.y * 7.0, 0.0, 1.0);
    return to_display(lighting.color * s.factor * occlusion + s.add);
}

// Display color of a structure point in the world.
fn structure_color(light: Light, base_color: vec3f, gloss: u32, p: vec3f, n: vec3f, ray: vec3f) -> vec3f {
    if (gloss == PANE) {
        let lawn = LAWN * (light.outdoors_high + light.sun * max(light.to_sun.y, 0.0));
        return to_display(sky_color(light, ray, lawn));
    }
    if (gloss == GLOW) {
        return to_display(base_color * glow(light));
    }
    // A step along the normal leaves the wall.
    let at = ground_coordinates(light, p + 0.1 * n);
    let room = cell(light, vec2i(at)) >> 8u;
    let has_lamp = room < light.n_lamps;
    let lamp = lamps[light.first_lamp + select(0u, room, has_lamp)].xyz;
    // A ceiling is lit as if it were higher.
    let is_ceiling = n.y < -0.5;
    let extra = vec3f(0.0, select(0.0, CEILING_EXTRA_M, is_ceiling), 0.0);
    let s = reflect_light(light, direct_light(light, has_lamp, lamp, p + extra), n, gloss, -unit(ray));
    var factor = s.factor;
    if (is_ceiling) {
        factor *= CEILING_FACTOR;
    } else if (n.y < 0.5) {
        let low = max(1.0 - p.y * 2.2, 0.0);
        let high = max(1.0 - (light.ceiling_m - p.y) * 2.2, 0.0);
        factor *= 1.0 - 0.22 * low * low - 0.16 * high * high;
    }
    return to_display(base_color * factor + s.add);
}

// Position of a point on the ground grid, in cells.
fn ground_coordinates(light: Light, p: vec3f) -> vec2f {
    return (p.xz - vec2f(light.min_x, light.min_z)) * light.cells_per_m;
}

// Brightness of a cell, and its room in the second byte.
fn cell(light: Light, at: vec2i) -> u32 {
    let k = vec2u(clamp(at, vec2i(0), vec2i(vec2u(light.n_x, light.n_z)) - 1));
    let word = light.first_cell + k.y * ((light.n_x + 1u) / 2u) + k.x / 2u;
    return (ground[word] >> (16u * (k.x % 2u))) & 0xffffu;
}

// Bilinear brightness of the ground, 0 to 1.
fn ground_brightness(light: Light, p: vec3f) -> f32 {
    let at = ground_coordinates(light, p) - 0.5;
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

// Brightness of a texture at the mip level for a pixel of size `covers_m`.
fn texture_brightness(material: Material, face: vec3f, local: vec3f, covers_m: f32) -> f32 {
    let facing = abs(vec3f(dot(material.axes_x, face), dot(material.axes_y, face), dot(material.axes_z, face)));
    // Project along the axis most perpendicular to the face; the longer remaining axis is u.
    var u = material.axes_x;
    var v = material.axes_y;
    if (facing.x > facing.y && facing.x > facing.z) {
        u = material.axes_y;
        v = material.axes_z;
    } else if (facing.y > facing.z) {
        v = material.axes_z;
    }
    let texels_covered = clamp(covers_m * material.texels_per_m, 1.0, f32(TILE_TEXELS));
    let level = min((bitcast<u32>(texels_covered) >> 23u) - 127u, LOG2_TILE_TEXELS);
    // Levels have 4^n, 4^(n-1), ... texels: the sum of the first terms.
    let rgb8 = 4u * TILE_TEXELS * TILE_TEXELS;
    let first = material.first_texel + (rgb8 - (rgb8 >> (2u * level))) / 3u;
    let log2_side = LOG2_TILE_TEXELS - level;
    let scale = material.texels_per_m / f32(1u << level);
    // Texel centers are at half-integers.
    let at = vec2f(dot(u, local), dot(v, local)) * scale - 0.5;
    let k = vec2u(vec2i(floor(at))) & vec2u((1u << log2_side) - 1u);
    let f = at - floor(at);
    let texel = unpack4x8unorm(atlas[first + ((k.y << log2_side) | k.x)]);
    let texel_mean = mix(mix(texel.x, texel.y, f.x), mix(texel.z, texel.w, f.x), f.y);
    return texel_mean * (255.0 / 128.0);
}
