//! Views and detections as COCO files, which pycocotools and most detection libraries read: masks as
//! compressed run lengths, depth beside the images as 16-bit PNG in millimetres.

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use chaic_core::ClassId;
use chaic_files::{FileError, write_whole};
use image::{ExtendedColorType, ImageEncoder as _, codecs::png::PngEncoder};
use serde::Serialize;

use crate::instances::Instance;
use crate::labels::{BACKGROUND, class_of, label_of};
use crate::parallel::in_order;
use crate::views::{LabelledView, Part, ViewRules, Views};

/// The annotations of a data set.
pub const ANNOTATIONS: &str = "annotations.json";
/// What a detector found in its images, as COCO results.
pub const DETECTIONS: &str = "detections.json";
/// How often each class is shown.
pub const STATISTICS: &str = "statistics.json";
/// The folder of color images, and of depth.
pub const IMAGES: &str = "images";
/// See [`IMAGES`].
pub const DEPTH: &str = "depth";
/// Depth is kept in steps of so much, metres; what is farther than 65.535 m is kept as that.
pub const DEPTH_STEP_M: f32 = 0.001;

/// A mask as runs of pixels outside and inside, column by column.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Mask {
    /// Height and width.
    pub size: [u32; 2],
    /// The runs in COCO's compressed text.
    pub counts: String,
}

impl Mask {
    /// Of these pixels, numbered row by row.
    pub fn of(pixels: &[u32], [width, height]: [u32; 2]) -> Mask {
        let mut by_column: Vec<u32> =
            pixels.iter().map(|k| (k % width) * height + k / width).collect();
        by_column.sort_unstable();
        // Where runs end: the first is outside.
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
        let begins = std::iter::once(0).chain(ends.iter().copied());
        let runs: Vec<u32> = begins.zip(&ends).map(|(begin, end)| end - begin).collect();
        Mask { size: [height, width], counts: compressed(&runs) }
    }
}

/// Runs in COCO's text: each less the one two before it, in groups of five bits, lowest first.
fn compressed(runs: &[u32]) -> String {
    let mut text = String::new();
    for (k, run) in runs.iter().enumerate() {
        let before = if k > 2 { runs[k - 2] } else { 0 };
        let mut rest = i64::from(*run) - i64::from(before);
        loop {
            let bits = (rest & 0x1f) as u8;
            rest >>= 5;
            let is_last = rest == if bits & 0x10 == 0 { 0 } else { -1 };
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

/// An image and its camera.
#[derive(Clone, Debug, Serialize)]
struct Entry {
    id: usize,
    file_name: String,
    depth_file_name: String,
    width: u32,
    height: u32,
    vertical_fov_rad: f32,
    eye_in_world: [f32; 3],
    /// The rotation from the camera's frame (x right, y up, z towards the eye) to the world's, a
    /// quaternion x, y, z, w.
    world_from_camera: [f32; 4],
}

/// A thing in an image.
#[derive(Clone, Debug, Serialize)]
struct Annotation {
    id: usize,
    image_id: usize,
    category_id: u8,
    segmentation: Mask,
    area: u32,
    /// Left, top, width, height.
    bbox: [u32; 4],
    iscrowd: u8,
}

/// A detection, as COCO results have them.
#[derive(Clone, Debug, Serialize)]
pub struct Found {
    image_id: usize,
    category_id: u8,
    segmentation: Mask,
    score: f32,
}

/// What is in one view.
#[derive(Clone, Debug)]
pub struct Annotated {
    entry: Entry,
    annotations: Vec<Annotation>,
}

/// What is in a view, which is the image of this number.
pub fn annotate(image_id: usize, view: &LabelledView) -> Annotated {
    let size = [view.camera.width, view.camera.height];
    let mut pixels: Vec<Vec<u32>> = vec![Vec::new(); view.labels.len()];
    for (k, id) in view.ids.iter().enumerate() {
        pixels.get_mut(usize::from(*id)).into_iter().for_each(|pixels| pixels.push(k as u32));
    }
    let shown = view.labels.iter().zip(&pixels);
    let shown = shown.filter(|(label, pixels)| **label != BACKGROUND && !pixels.is_empty());
    let annotation = |(label, pixels): (&u8, &Vec<u32>)| {
        let extent = |of: &dyn Fn(u32) -> u32| {
            let all = || pixels.iter().map(|k| of(*k));
            [all().min().unwrap_or(0), all().max().unwrap_or(0)]
        };
        let [left, right] = extent(&|k| k % size[0]);
        let [top, bottom] = extent(&|k| k / size[0]);
        Annotation {
            id: 0,
            image_id,
            category_id: *label,
            segmentation: Mask::of(pixels, size),
            area: pixels.len() as u32,
            bbox: [left, top, right - left + 1, bottom - top + 1],
            iscrowd: 0,
        }
    };
    let entry = Entry {
        id: image_id,
        file_name: format!("{image_id:06}.png"),
        depth_file_name: format!("{image_id:06}.png"),
        width: size[0],
        height: size[1],
        vertical_fov_rad: view.camera.vertical_fov_rad,
        eye_in_world: view.camera.eye_in_world.to_array(),
        world_from_camera: view.camera.world_from_camera.to_array(),
    };
    Annotated { entry, annotations: shown.map(annotation).collect() }
}

/// What was found in the image of this number.
pub fn results(image_id: usize, view: &LabelledView, found: &[Instance]) -> Vec<Found> {
    let size = [view.camera.width, view.camera.height];
    let result = |instance: &Instance| Found {
        image_id,
        category_id: instance.label,
        segmentation: Mask::of(&instance.pixels, size),
        score: instance.score,
    };
    found.iter().map(result).collect()
}

/// A data set's annotations file.
#[derive(Debug, Serialize)]
struct Dataset<'a> {
    info: BTreeMap<&'static str, String>,
    images: Vec<&'a Entry>,
    annotations: Vec<Annotation>,
    categories: Vec<Category>,
}

/// The annotations of views as a COCO file; `of` says what they are of.
pub fn annotations_json(views: &[Annotated], of: &str) -> Vec<u8> {
    let mut annotations: Vec<Annotation> =
        views.iter().flat_map(|view| view.annotations.iter().cloned()).collect();
    // COCO's own numbers begin at 1; pycocotools takes 0 for no match.
    annotations.iter_mut().zip(1..).for_each(|(annotation, id)| annotation.id = id);
    let category = |class: ClassId| Category { id: label_of(Some(class)), name: class.name() };
    let info = BTreeMap::from([
        ("description", of.to_owned()),
        ("depth", format!("{DEPTH}/: metres = value * {DEPTH_STEP_M}")),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
    ]);
    let dataset = Dataset {
        info,
        images: views.iter().map(|view| &view.entry).collect(),
        annotations,
        categories: ClassId::all().map(category).collect(),
    };
    serde_json::to_vec(&dataset).expect("plain data")
}

/// Of a class, how many instances by pixels: fewer than 100, to 32 by 32, to 96 by 96, more.
pub type Sizes = [usize; 4];
const SIZES_PX: [u32; 3] = [100, 32 * 32 + 1, 96 * 96 + 1];

/// How often each class is shown, by sizes.
pub fn statistics(views: &[Annotated]) -> BTreeMap<&'static str, Sizes> {
    let mut counts: BTreeMap<&'static str, Sizes> =
        ClassId::all().map(|class| (class.name(), Sizes::default())).collect();
    for annotation in views.iter().flat_map(|view| &view.annotations) {
        let name = class_of(annotation.category_id).map_or("", |class| class.name());
        let size = SIZES_PX.iter().filter(|px| annotation.area >= **px).count();
        counts.entry(name).or_default()[size] += 1;
    }
    counts
}

/// Writes the color and depth of a view.
fn write_images(folder: &Path, view: &LabelledView, entry: &Entry) -> Result<(), FileError> {
    let depth: Vec<u8> = view
        .depth_m
        .iter()
        .flat_map(|m| ((m / DEPTH_STEP_M).clamp(0.0, 65_535.0) as u16).to_ne_bytes())
        .collect();
    for (name, file, bytes, color) in [
        (IMAGES, &entry.file_name, &view.rgb, ExtendedColorType::Rgb8),
        (DEPTH, &entry.depth_file_name, &depth, ExtendedColorType::L16),
    ] {
        let mut png = Cursor::new(Vec::new());
        let encoder = PngEncoder::new(&mut png);
        let written = encoder.write_image(bytes, entry.width, entry.height, color);
        written.expect("the shape fits, and memory takes it");
        write_whole(&folder.join(name).join(file), &png.into_inner())?;
    }
    Ok(())
}

/// Views that are drawn before `go_on` is asked: about a second of work for one thread.
const ROUND: usize = 16;

/// Writes a data set of the first so many views into a folder: images, depth, annotations, and how often
/// each class is shown. `go_on` is asked with the number of views that are done; the set of these is
/// whole if it says no.
///
/// # Errors
/// If the file system refuses.
pub fn collect(
    folder: &Path,
    (part, rules): (Part, ViewRules),
    n_views: usize,
    n_threads: usize,
    go_on: &mut dyn FnMut(usize) -> bool,
) -> Result<BTreeMap<&'static str, Sizes>, FileError> {
    for name in [IMAGES, DEPTH] {
        let path = folder.join(name);
        fs::create_dir_all(&path).map_err(FileError::of("make", &path))?;
    }
    let mut views: Vec<Annotated> = Vec::new();
    while views.len() < n_views && go_on(views.len()) {
        let numbers = views.len()..n_views.min(views.len() + ROUND);
        let one = |(): &mut (), k: usize| {
            let view = Views::new(part, rules, 1, k as u64).draw();
            let annotated = annotate(k, &view);
            write_images(folder, &view, &annotated.entry).map(|()| annotated)
        };
        let never = AtomicBool::new(false);
        let drawn = in_order(numbers, n_threads, &never, || (), one);
        let drawn: Result<Vec<Annotated>, FileError> =
            drawn.expect("nobody raises the flag").into_iter().collect();
        views.extend(drawn?);
    }
    let of = format!("{part:?} views of chaic");
    write_whole(&folder.join(ANNOTATIONS), &annotations_json(&views, &of))?;
    let counts = statistics(&views);
    let json = serde_json::to_string_pretty(&counts).expect("plain data") + "\n";
    write_whole(&folder.join(STATISTICS), json.as_bytes())?;
    Ok(counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads COCO's text as its own C code does.
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
        // Two columns of three: the middle of the first, all of the second.
        let mask = Mask::of(&[1, 2, 3, 5], [2, 3]);
        assert_eq!((mask.size, runs(&mask.counts)), ([3, 2], vec![1, 1, 1, 3]));
        assert_eq!(runs(&Mask::of(&[], [100, 200]).counts), [20_000]);
        let first = Mask::of(&[0], [512, 512]);
        assert_eq!(runs(&first.counts), [0, 1, 512 * 512 - 1]);
        // As pycocotools writes a square of ten by ten at (20, 30) in 64 by 64.
        let square: Vec<u32> = (30..40).flat_map(|y| (20..30).map(move |x| 64 * y + x)).collect();
        let expected: Vec<i64> =
            [vec![20 * 64 + 30, 10], [54, 10].repeat(9), vec![64 * 64 - 29 * 64 - 40]].concat();
        assert_eq!(runs(&Mask::of(&square, [64, 64]).counts), expected);
    }
}
