//! What eyes see: RGB, depth and instance ids from a world's state and a camera.
//!
//! **What it is**: [`Scene`] makes an episode's shapes ready once, [`Scene::render`] draws what
//! any number of cameras ([`View`]) see at a moment, [`render_batch`] those of many worlds,
//! [`Scene::label`] labels what learners see, [`floor_plan::draw`] draws a map for people,
//! [`image_out`] and [`text`] help to write pictures. [`geometry`] gives the same shapes as plain data,
//! for other renderers.
//!
//! **What it is not**: it changes no state, reads no files, and uses neither GPU nor display.
//!
//! **Invariants**
//! - Images are the same bits on every machine and for any number of threads: one thread draws
//!   one view, and all arithmetic is correctly rounded or comes from
//!   [`chaic_core::geom::math`].
//! - No camera, size or posture makes it panic.
//!
//! How a view comes about: instances are culled by the camera's frustum, by the rooms that can be seen
//! from where it stands ([`portals`]) and by what is already drawn ([`draw`]), drawn at a level of
//! detail that fits their size on the image ([`models`]) into a visibility buffer (inverse depth and
//! visibility ids): triangles are set up many at once ([`setup`]) and filled span by span ([`raster`]).
//! Depth and ids are read off that buffer, and color only if it is asked for: each triangle that is
//! seen gets a paint ([`paint`]) whose points are lit many at once ([`points`]); each row of pixels is
//! cut into segments of one triangle ([`shade`], [`segments`]) that are filled from paint and texture
//! ([`row`]). The inner loops are compiled for each kind of vectors, and do the same operations in
//! each.

#![allow(
    rustdoc::private_intra_doc_links,
    reason = "the code map above is for readers of the source"
)]

// What tests share with integration tests calls this crate by its name.
#[cfg(test)]
extern crate self as chaic_render;

mod appearance;
mod labels;
mod scene;
mod view;

mod frame;
mod grid;
mod lens;

mod forms;
mod mesh;
mod mesh_builder;
mod models;
mod people;
mod shapes;
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
mod paint;
mod planes;
mod points;
mod row;
mod segments;
mod shade;
mod sight;
mod texture;

pub mod floor_plan;
pub mod geometry;
pub mod image_out;
pub mod lighting;
pub mod text;

pub use appearance::Appearance;
pub use labels::{Labels, depth_mm};
pub use lens::Lens;
pub use scene::{Scene, WorldViews, render_batch};
pub use solids::LEVEL_RADIUS_PX;
pub use view::{Channels, ImagesMut, MAX_SIDE_PX, View, with_each_width};
