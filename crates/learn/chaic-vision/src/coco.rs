//! Export of views and detections in COCO format, which pycocotools and most detection libraries
//! read. Masks are compressed run lengths; depth is stored beside the images as 16-bit PNG in
//! millimeters.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use chaic_core::ClassId;
use chaic_files::{FileError, create_folders, write_atomically};
use image::{ExtendedColorType, ImageEncoder as _, codecs::png::PngEncoder};
use serde::Serialize;

use crate::instances::Instance;
use crate::labels::{BACKGROUND, class_of, label_of};
use crate::parallel::map_in_order;
use crate::views::{DatasetSplit, LabeledView, SyntheticViews, ViewConfig};

/// Annotations file of a data set.
pub const ANNOTATIONS: &str = "annotations.json";
/// COCO results of a detector on the data set's images.
pub const DETECTIONS: &str = "detections.json";
/// Number of instances by class and size.
pub const STATISTICS: &str = "statistics.json";
/// Folder of color images.
pub const IMAGES: &str = "images";
/// Folder of depth images.
pub const DEPTH: &str = "depth";
/// Quantization step of stored depth, meters. Depth is clamped to 65.535 m.
pub const DEPTH_STEP_M: f32 = 0.001;

/// Run-length encoded mask: alternating lengths of runs outside and inside the mask, in
/// column-major order.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RleMask {
    /// Height and width.
    pub size: [u32; 2],
    /// Run lengths in COCO's compressed text.
    pub counts: String,
}

impl RleMask {
    /// Encodes pixels that are given by their row-major index.
    pub fn from_pixels(pixels: &[u32], [width, height]: [u32; 2]) -> RleMask {
        let mut by_column: Vec<u32> =
            pixels.iter().map(|k| (k % width) * height + k / width).collect();
        by_column.sort_unstable();
        // Ends of runs; the first run is outside the mask.
        let mut ends: Vec<u32> = Vec::new();
        for k in by_column {
            match ends.last_mut() {
                Some(end) if *end == k => *end = k + 1,
                _ => ends.extend([k, k + 1]),
            }
        }
        if ends.last() != Some(&(width * height)) {
            ends.push(width * height);
        }
        let starts = std::iter::once(0).chain(ends.iter().copied());
        let runs: Vec<u32> = starts.zip(&ends).map(|(start, end)| end - start).collect();
        RleMask { size: [height, width], counts: encode_runs(&runs) }
    }
}

/// Encodes run lengths in COCO's text: differences to the run two before, in groups of five bits,
/// lowest first.
fn encode_runs(runs: &[u32]) -> String {
    let mut text = String::new();
    for (k, run) in runs.iter().enumerate() {
        let previous = if k > 2 { runs[k - 2] } else { 0 };
        let mut remaining = i64::from(*run) - i64::from(previous);
        loop {
            let bits = (remaining & 0x1f) as u8;
            remaining >>= 5;
            let is_last = remaining == if bits & 0x10 == 0 { 0 } else { -1 };
            text.push(char::from(48 + bits + if is_last { 0 } else { 0x20 }));
            if is_last {
                break;
            }
        }
    }
    text
}

#[derive(Debug, Serialize)]
struct Category {
    id: u8,
    name: &'static str,
}

/// COCO image with its camera.
#[derive(Clone, Debug, Serialize)]
struct ImageRecord {
    id: usize,
    file_name: String,
    depth_file_name: String,
    width: u32,
    height: u32,
    vertical_fov_rad: f32,
    eye_in_world: [f32; 3],
    /// Rotation from the camera's frame (x right, y up, z towards the camera) to the world's frame,
    /// a quaternion x, y, z, w.
    world_from_camera: [f32; 4],
}

/// Instance in an image.
#[derive(Clone, Debug, Serialize)]
struct Annotation {
    id: usize,
    image_id: usize,
    category_id: u8,
    segmentation: RleMask,
    area: u32,
    /// Left, top, width, height, pixels.
    bbox: [u32; 4],
    iscrowd: u8,
}

/// Entry of a COCO results file.
#[derive(Clone, Debug, Serialize)]
pub struct CocoResult {
    image_id: usize,
    category_id: u8,
    segmentation: RleMask,
    score: f32,
}

/// COCO records of one view.
#[derive(Clone, Debug)]
pub struct AnnotatedView {
    image: ImageRecord,
    annotations: Vec<Annotation>,
}

/// Converts a labeled view to COCO records with this image id.
pub fn annotate(image_id: usize, view: &LabeledView) -> AnnotatedView {
    let size = [view.camera.width, view.camera.height];
    let mut pixels: Vec<Vec<u32>> = vec![Vec::new(); view.labels.len()];
    for (k, id) in view.ids.iter().enumerate() {
        pixels.get_mut(usize::from(*id)).into_iter().for_each(|pixels| pixels.push(k as u32));
    }
    let visible = view.labels.iter().zip(&pixels);
    let visible = visible.filter(|(label, pixels)| **label != BACKGROUND && !pixels.is_empty());
    let annotation = |(label, pixels): (&u8, &Vec<u32>)| {
        let extent = |coordinate: &dyn Fn(u32) -> u32| {
            let all = || pixels.iter().map(|k| coordinate(*k));
            [all().min().unwrap_or(0), all().max().unwrap_or(0)]
        };
        let [left, right] = extent(&|k| k % size[0]);
        let [top, bottom] = extent(&|k| k / size[0]);
        Annotation {
            id: 0,
            image_id,
            category_id: *label,
            segmentation: RleMask::from_pixels(pixels, size),
            area: pixels.len() as u32,
            bbox: [left, top, right - left + 1, bottom - top + 1],
            iscrowd: 0,
        }
    };
    let image = ImageRecord {
        id: image_id,
        file_name: format!("{image_id:06}.png"),
        depth_file_name: format!("{image_id:06}.png"),
        width: size[0],
        height: size[1],
        vertical_fov_rad: view.camera.vertical_fov_rad,
        eye_in_world: view.camera.eye_in_world.to_array(),
        world_from_camera: view.camera.world_from_camera.to_array(),
    };
    AnnotatedView { image, annotations: visible.map(annotation).collect() }
}

/// Converts detections in a view to COCO results, one per candidate label of an instance.
pub fn results(image_id: usize, view: &LabeledView, found: &[Instance]) -> Vec<CocoResult> {
    let size = [view.camera.width, view.camera.height];
    let results_of = |instance: &Instance| {
        let segmentation = RleMask::from_pixels(&instance.pixels, size);
        let result = |&(category_id, score): &(u8, f32)| CocoResult {
            image_id,
            category_id,
            segmentation: segmentation.clone(),
            score,
        };
        instance.names.iter().map(result).collect::<Vec<CocoResult>>()
    };
    found.iter().flat_map(results_of).collect()
}

/// COCO annotations file.
#[derive(Debug, Serialize)]
struct Dataset<'a> {
    info: BTreeMap<&'static str, String>,
    images: Vec<&'a ImageRecord>,
    annotations: Vec<Annotation>,
    categories: Vec<Category>,
}

/// Serializes the annotations of views as a COCO file with this description.
pub fn annotations_json(views: &[AnnotatedView], description: &str) -> Vec<u8> {
    let mut annotations: Vec<Annotation> =
        views.iter().flat_map(|view| view.annotations.iter().cloned()).collect();
    // COCO ids start at 1; pycocotools reads 0 as no match.
    annotations.iter_mut().zip(1..).for_each(|(annotation, id)| annotation.id = id);
    let category = |class: ClassId| Category { id: label_of(Some(class)), name: class.name() };
    let info = BTreeMap::from([
        ("description", description.to_owned()),
        ("depth", format!("{DEPTH}/: meters = value * {DEPTH_STEP_M}")),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
    ]);
    let dataset = Dataset {
        info,
        images: views.iter().map(|view| &view.image).collect(),
        annotations,
        categories: ClassId::all().map(category).collect(),
    };
    serde_json::to_vec(&dataset).expect("the data has string keys and finite numbers")
}

/// Number of instances of a class by area: fewer than 100 pixels, up to 32 x 32, up to 96 x 96,
/// more.
pub type SizeCounts = [usize; 4];
const SIZES_PX: [u32; 3] = [100, 32 * 32 + 1, 96 * 96 + 1];

/// Counts the instances of each class by area.
pub fn statistics(views: &[AnnotatedView]) -> BTreeMap<&'static str, SizeCounts> {
    let mut counts: BTreeMap<&'static str, SizeCounts> =
        ClassId::all().map(|class| (class.name(), SizeCounts::default())).collect();
    for annotation in views.iter().flat_map(|view| &view.annotations) {
        let name = class_of(annotation.category_id).map_or("", |class| class.name());
        let size = SIZES_PX.iter().filter(|px| annotation.area >= **px).count();
        counts.entry(name).or_default()[size] += 1;
    }
    counts
}

/// Writes the color and depth images of a view.
fn write_images(folder: &Path, view: &LabeledView, image: &ImageRecord) -> Result<(), FileError> {
    let depth: Vec<u8> =
        view.depth_m.iter().flat_map(|m| chaic_render::depth_mm(*m).to_ne_bytes()).collect();
    for (name, file, bytes, color) in [
        (IMAGES, &image.file_name, &view.rgb, ExtendedColorType::Rgb8),
        (DEPTH, &image.depth_file_name, &depth, ExtendedColorType::L16),
    ] {
        let mut png = Cursor::new(Vec::new());
        let encoder = PngEncoder::new(&mut png);
        let written = encoder.write_image(bytes, image.width, image.height, color);
        written.expect("the buffer has the image's shape");
        write_atomically(&folder.join(name).join(file), &png.into_inner())?;
    }
    Ok(())
}

/// Number of views that are rendered between two calls of `should_continue`: about a second of work
/// for one thread.
const VIEWS_PER_ROUND: usize = 16;

/// Writes a data set of the first `n_views` views into a folder: images, depth, annotations and
/// statistics. `should_continue` is called with the number of finished views; if it returns
/// `false`, collection stops, and the data set contains the finished views.
///
/// # Errors
/// If a file cannot be written.
pub fn collect(
    folder: &Path,
    split: DatasetSplit,
    config: ViewConfig,
    n_views: usize,
    n_threads: usize,
    should_continue: &mut dyn FnMut(usize) -> bool,
) -> Result<BTreeMap<&'static str, SizeCounts>, FileError> {
    for name in [IMAGES, DEPTH] {
        let path = folder.join(name);
        create_folders(&path)?;
    }
    let mut views: Vec<AnnotatedView> = Vec::new();
    while views.len() < n_views && should_continue(views.len()) {
        let indices = views.len()..n_views.min(views.len() + VIEWS_PER_ROUND);
        let render = |(): &mut (), k: usize| {
            let view = SyntheticViews::new(split, config, 1, k as u64).draw();
            let annotated = annotate(k, &view);
            write_images(folder, &view, &annotated.image).map(|()| annotated)
        };
        let never = AtomicBool::new(false);
        let drawn = map_in_order(indices, n_threads, &never, || (), render);
        let drawn: Result<Vec<AnnotatedView>, FileError> =
            drawn.expect("the flag is never set").into_iter().collect();
        views.extend(drawn?);
    }
    let description = format!("{split} views of chaic");
    write_atomically(&folder.join(ANNOTATIONS), &annotations_json(&views, &description))?;
    let counts = statistics(&views);
    let json = serde_json::to_string_pretty(&counts)
        .expect("the data has string keys and finite numbers")
        + "\n";
    write_atomically(&folder.join(STATISTICS), json.as_bytes())?;
    Ok(counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Decodes COCO's text as COCO's C code does.
    fn runs(text: &str) -> Vec<i64> {
        let (mut runs, mut bytes) = (Vec::new(), text.bytes().peekable());
        while bytes.peek().is_some() {
            let (mut x, mut shift) = (0i64, 0);
            loop {
                let c = i64::from(bytes.next().unwrap()) - 48;
                x |= (c & 0x1f) << shift;
                shift += 5;
                if c & 0x20 == 0 {
                    if c & 0x10 != 0 {
                        x |= -1 << shift;
                    }
                    break;
                }
            }
            let n = runs.len();
            runs.push(x + if n > 2 { runs[n - 2] } else { 0 });
        }
        runs
    }

    #[test]
    fn masks_are_runs_by_column() {
        // Image of two columns and three rows: the center of the first column, the whole second
        // column.
        let mask = RleMask::from_pixels(&[1, 2, 3, 5], [2, 3]);
        assert_eq!((mask.size, runs(&mask.counts)), ([3, 2], vec![1, 1, 1, 3]));
        assert_eq!(runs(&RleMask::from_pixels(&[], [100, 200]).counts), [20_000]);
        let first = RleMask::from_pixels(&[0], [512, 512]);
        assert_eq!(runs(&first.counts), [0, 1, 512 * 512 - 1]);
        // Runs by pycocotools for a square of 10 x 10 at (20, 30) in 64 x 64.
        let square: Vec<u32> = (30..40).flat_map(|y| (20..30).map(move |x| 64 * y + x)).collect();
        let expected: Vec<i64> =
            [vec![20 * 64 + 30, 10], [54, 10].repeat(9), vec![64 * 64 - 29 * 64 - 40]].concat();
        assert_eq!(runs(&RleMask::from_pixels(&square, [64, 64]).counts), expected);
    }
}
