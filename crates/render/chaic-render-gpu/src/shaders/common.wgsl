// Shared declarations. Lengths are meters, image positions are pixels from the left and the top.

// Visibility id of background pixels.
const BACKGROUND: u32 = 0xffffffffu;

// `ViewRecord` of records.rs.
struct View {
    right: vec3f,
    focal: f32,
    down: vec3f,
    // Image center.
    mu: f32,
    forward: vec3f,
    mv: f32,
    eye: vec3f,
    first_instance: u32,
    n_instances: u32,
    // Hidden entities; 0 hides none.
    hidden_body: u32,
    hidden_ceiling: u32,
    // Offset of the view in the instance lists.
    first_visible: u32,
    // Index of the world's light.
    light: u32,
    // One bit per visible region, in two words.
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
    // 0: sky; 1: lamp; 2: per point, the light of the room in front of it.
    light_source: u32,
    origin: vec3f,
    is_tinted: u32,
    tint: vec3f,
    // One bit per region that it overlaps, in two words.
    regions_low: u32,
    lamp: vec3f,
    regions_high: u32,
    // Bounding box over all levels of detail, in the object frame.
    low: vec3f,
    padding: u32,
    high: vec3f,
    padding_2: u32,
    // Factor on linear colors.
    factor: vec3f,
    padding_3: u32,
}

// `MeshRecord` of records.rs.
struct Mesh {
    // First vertex, first triangle, number of triangles, first material.
    levels: array<vec4u, N_LEVELS>,
}

// Counters of a view.
struct Tally {
    n_visible: u32,
    // Upper bound on the number of triangles.
    max_triangles: u32,
    n_triangles: u32,
    padding: u32,
}

// Parameters shared by the dispatches of one round.
struct RoundParams {
    width: u32,
    height: u32,
    // First view of the round.
    first_view: u32,
    // Number of words in a row of ids.
    id_words: u32,
    wants_color: u32,
    padding: u32,
    padding_2: u32,
    padding_3: u32,
}

// Maps object points to (x, y, w): w is the depth, (x / w, y / w) the offset in pixels from the
// image center, right and down.
struct CameraTransform {
    x: vec3f,
    y: vec3f,
    w: vec3f,
    offset: vec3f,
}

fn camera_from(view: View, instance: Instance) -> CameraTransform {
    let d = instance.origin - view.eye;
    let right = view.right;
    let down = view.down;
    let forward = view.forward;
    let x = vec3f(dot(right, instance.x), dot(right, instance.y), dot(right, instance.z));
    let y = vec3f(dot(down, instance.x), dot(down, instance.y), dot(down, instance.z));
    let w = vec3f(dot(forward, instance.x), dot(forward, instance.y), dot(forward, instance.z));
    let at = vec3f(dot(right, d) * view.focal, dot(down, d) * view.focal, dot(forward, d));
    return CameraTransform(x * view.focal, y * view.focal, w, at);
}

fn to_camera(transform: CameraTransform, p: vec3f) -> vec3f {
    return vec3f(dot(transform.x, p), dot(transform.y, p), dot(transform.w, p)) + transform.offset;
}

// Smallest index whose pixel center (index + 0.5) is not before `x`, clamped to [0, max_index].
fn first_center(x: f32, max_index: u32) -> u32 {
    return u32(ceil(clamp(x - 0.5, 0.0, f32(max_index))));
}
