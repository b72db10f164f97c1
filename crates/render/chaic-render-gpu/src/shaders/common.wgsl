// What the shaders share. Lengths are metres, places on the image pixels from its left and top.

// Nobody's pixel.
const NOBODY: u32 = 0xffffffffu;

// `ViewRecord` of records.rs.
struct View {
    right: vec3f,
    focal: f32,
    down: vec3f,
    // Middle of the image.
    mu: f32,
    ahead: vec3f,
    mv: f32,
    eye: vec3f,
    first_instance: u32,
    n_instances: u32,
    // Entities that are left out; 0 is nothing's id.
    hidden_body: u32,
    hidden_ceiling: u32,
    // Where the view's lists of instances begin.
    first_visible: u32,
    // The world's light.
    light: u32,
    // A bit for each region that may be seen, in two words.
    regions_low: u32,
    regions_high: u32,
    padding: u32,
}

// `InstanceRecord` of records.rs.
struct Instance {
    x: vec3f,
    mesh: u32,
    y: vec3f,
    entity: u32,
    z: vec3f,
    // 0 the sky, 1 the lamp, 2 at each point the light of the room in front of it.
    lit_by: u32,
    origin: vec3f,
    is_tinted: u32,
    tint: vec3f,
    // A bit for each region that it reaches into, in two words.
    regions_low: u32,
    lamp: vec3f,
    regions_high: u32,
    // Bounds of all levels, in the object's frame.
    low: vec3f,
    padding: u32,
    high: vec3f,
    padding_2: u32,
    // By what linear colors are multiplied.
    factor: vec3f,
    padding_3: u32,
}

// `MeshRecord` of records.rs.
struct Mesh {
    // First vertex, first triangle, number of triangles, first skin.
    levels: array<vec4u, N_LEVELS>,
}

// What culling found out about a view.
struct Tally {
    n_visible: u32,
    // No more triangles than these can come of them.
    most_triangles: u32,
    n_triangles: u32,
    padding: u32,
}

// What the dispatches of one round share.
struct Round {
    width: u32,
    height: u32,
    // The view that the round begins with.
    first_view: u32,
    // Words of a row of ids.
    id_words: u32,
    wants_color: u32,
    padding: u32,
    padding_2: u32,
    padding_3: u32,
}

// Maps an object's points to (x, y, w): w is the depth, (x / w, y / w) the offset in pixels from
// the middle of the image, right and down.
struct IntoCamera {
    x: vec3f,
    y: vec3f,
    w: vec3f,
    at: vec3f,
}

fn camera_from(view: View, instance: Instance) -> IntoCamera {
    let d = instance.origin - view.eye;
    let right = view.right;
    let down = view.down;
    let ahead = view.ahead;
    let x = vec3f(dot(right, instance.x), dot(right, instance.y), dot(right, instance.z));
    let y = vec3f(dot(down, instance.x), dot(down, instance.y), dot(down, instance.z));
    let w = vec3f(dot(ahead, instance.x), dot(ahead, instance.y), dot(ahead, instance.z));
    let at = vec3f(dot(right, d) * view.focal, dot(down, d) * view.focal, dot(ahead, d));
    return IntoCamera(x * view.focal, y * view.focal, w, at);
}

fn into_camera(into: IntoCamera, p: vec3f) -> vec3f {
    return vec3f(dot(into.x, p), dot(into.y, p), dot(into.w, p)) + into.at;
}

// The smallest whole number whose center (+ 0.5) isn't before `x`, within [0, most].
fn first_center(x: f32, most: u32) -> u32 {
    return u32(ceil(clamp(x - 0.5, 0.0, f32(most))));
}
