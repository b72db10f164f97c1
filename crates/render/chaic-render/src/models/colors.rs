//! Paints that several models share.

use chaic_core::catalogue::Finish;

use crate::mesh_builder::{Paint, paint};

pub(super) const WHITE: Paint = paint([238, 238, 234], Finish::Matte);
pub(super) const BLACK: Paint = paint([28, 28, 31], Finish::Matte);
pub(super) const RUBBER: Paint = paint([34, 34, 36], Finish::Matte);
pub(super) const GLOSSY_BLACK: Paint = paint([20, 20, 23], Finish::Glossy);
pub(super) const STEEL: Paint = paint([186, 189, 194], Finish::Metal);
pub(super) const DARK_STEEL: Paint = paint([84, 88, 94], Finish::Metal);
pub(super) const BRASS: Paint = paint([200, 162, 74], Finish::Metal);
pub(super) const GLASS: Paint = paint([38, 52, 64], Finish::Glass);
pub(super) const LEAF: Paint = paint([70, 128, 56], Finish::Matte);
pub(super) const STALK: Paint = paint([92, 70, 40], Finish::Wood);
pub(super) const PAPER: Paint = paint([240, 240, 236], Finish::Matte);
pub(super) const LINEN: Paint = paint([240, 238, 232], Finish::Fabric);
pub(super) const WALNUT: Paint = paint([112, 74, 50], Finish::Wood);
pub(super) const OAK: Paint = paint([192, 150, 98], Finish::Wood);
pub(super) const PALE_OAK: Paint = paint([214, 180, 132], Finish::Wood);
pub(super) const IRON: Paint = paint([52, 56, 58], Finish::Metal);
pub(super) const LAMP: Paint = paint([255, 250, 226], Finish::Glossy);
/// Dark gap between two doors or drawers.
pub(super) const GAP: Paint = paint([62, 54, 48], Finish::Matte);
