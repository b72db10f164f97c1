//! CPU renderer: RGB, depth and instance ids from the state of a world and a camera.
//!
//! **What it is**: [`Scene`] prepares the static geometry of an episode once. [`Scene::render`]
//! renders any number of cameras ([`View`]) for one state of the world, and [`render_batch`]
//! renders many worlds. [`Scene::label`] labels training data for perception, [`floor_plan::draw`]
//! draws a map for people, [`image_out`] and [`text`] help to write image files. [`geometry`]
//! exports the same geometry as plain data for other renderers.
//!
//! **What it is not**: it changes no state, reads no files, and uses neither GPU nor display.
//!
//! **Invariants**
//! - Images are bit-identical on every machine and for any number of threads: one thread renders
//!   one view, and all arithmetic is correctly rounded or comes from [`chaic_core::geom::math`].
//! - No camera, image size or posture causes a panic.
//!
//! The stages of one view:
//! 1. Culling: the camera frustum, the rooms visible through portals ([`portals`]) and a
//!    hierarchical z-buffer ([`draw`]) remove instances.
//! 2. Level of detail: the size of an instance on the image selects its mesh ([`models`]).
//! 3. Rasterization: triangles are set up in groups ([`setup`]) and filled span by span
//!    ([`raster`]) into a visibility buffer, which holds inverse depth and visibility ids.
//! 4. Read-back: depth and ids are copied from that buffer. Color is computed only on request.
//! 5. Shading: each visible triangle gets a color source ([`shader`]) whose surface points are lit
//!    in groups ([`points`]). Each row of pixels is split into segments of one triangle ([`shade`],
//!    [`segments`]), which are filled from color and texture ([`row`]).
//!
//! The inner loops are compiled for each vector width and do the same operations in each.

#![allow(
    rustdoc::private_intra_doc_links,
    reason = "the code map above is for readers of the source"
)]

// Lets test code that is shared with integration tests name this crate.
#[cfg(test)]
extern crate self as chaic_render;

mod appearance;
mod labels;
mod scene;
mod view;

mod grid;
mod projection;
mod scene_frame;

mod forms;
mod mesh;
mod mesh_builder;
mod models;
mod people;
pub mod shapes;
mod solids;
mod structure;

mod clip;
mod draw;
mod portals;
mod raster;
mod setup;

mod ground;
mod light;
mod light_rig;
mod planes;
mod points;
mod row;
mod segments;
mod shade;
mod shader;
mod texture;
mod vision_limits;

pub mod floor_plan;
pub mod geometry;
pub mod image_out;
pub mod lighting;
mod paint;
#[cfg(feature = "text")]
pub mod text;
mod text_label;

pub use appearance::Appearance;
pub use labels::{Labels, depth_mm};
pub use projection::Projection;
pub use scene::{Scene, WorldViews, render_batch};
pub use solids::LEVEL_RADIUS_PX;
pub use text_label::{Align, TextLabel};
pub use view::{Channels, ImagesMut, MAX_SIDE_PX, View, with_each_width};
