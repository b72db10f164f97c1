//! A triangle's own part of its pixels' color: normals, texture, and what darkens it.

use chaic_protocol::{EntityId, Vec3};

use crate::frame::{Frame, Instance};
use crate::light::NO_ROOM;
use crate::mesh::{Mesh, unit};
use crate::shade::Row;
use crate::texture::Tile;

/// Height of the skirting board, metres.
const SKIRTING_M: f32 = 0.075;

/// Pixels that share one look for their room.
const PIECE: usize = 16;

/// A triangle, ready to be shaded: its quantities are affine functions of the point in the world.
pub(crate) struct Surface {
    entity: EntityId,
    color: Vec3,
    /// Normal at `at`, and its changes along the triangle's two edges if it is smooth.
    at: Vec3,
    normal: Vec3,
    change: [Vec3; 2],
    weights: [Vec3; 2],
    smooth: bool,
    tile: Option<&'static Tile>,
    origin: Vec3,
    /// Directions of the texture, in the world.
    u: Vec3,
    v: Vec3,
    room: Option<u8>,
}

impl Surface {
    pub fn of(instance: &Instance, mesh: &Mesh, triangle: usize) -> Surface {
        let t = &mesh.triangles[triangle];
        let skin = &mesh.skins[usize::from(t.skin)];
        let corner = t.corners.map(usize::from);
        let [a, b, c] = corner.map(|k| mesh.positions[k]);
        let flat = (b - a).cross(c - a);
        let area2 = flat.dot(flat).max(1e-30);
        let face = unit(flat);
        let turn = |v: Vec3| instance.rotation * v;
        let (mut normal, mut change, mut weights) = (turn(face), [Vec3::ZERO; 2], [Vec3::ZERO; 2]);
        if t.smooth {
            let [na, nb, nc] = corner.map(|k| mesh.normals[k]);
            normal = turn(na);
            change = [turn(nb - na), turn(nc - na)];
            weights = [turn((c - a).cross(flat)) / area2, turn(flat.cross(b - a)) / area2];
        }
        let tile = skin.texture.tile();
        let (mut u, mut v) = (Vec3::ZERO, Vec3::ZERO);
        if tile.is_some() {
            let axes = &skin.axes;
            let facing = [axes.x_axis, axes.y_axis, axes.z_axis].map(|x| x.dot(face).abs());
            // Look along the axis that the face is most square to; the longest axis left is u.
            (u, v) = if facing[0] > facing[1] && facing[0] > facing[2] {
                (turn(axes.y_axis), turn(axes.z_axis))
            } else if facing[1] > facing[2] {
                (turn(axes.x_axis), turn(axes.z_axis))
            } else {
                (turn(axes.x_axis), turn(axes.y_axis))
            };
        }
        let color = match instance.tint {
            Some(tint) if skin.tinted => tint,
            _ => skin.color,
        };
        Surface {
            entity: instance.entity,
            color: Vec3::from(color),
            at: turn(a) + instance.origin,
            normal,
            change,
            weights,
            smooth: t.smooth,
            tile,
            origin: instance.origin,
            u,
            v,
            room: instance.room,
        }
    }

    /// Writes the normals of pixels `from..to`.
    pub fn normals(&self, row: &mut Row, from: usize, to: usize) {
        if !self.smooth {
            row.nx[from..to].fill(self.normal.x);
            row.ny[from..to].fill(self.normal.y);
            row.nz[from..to].fill(self.normal.z);
            return;
        }
        for k in from..to {
            let d = row.point(k) - self.at;
            let s = self.weights[0].dot(d).clamp(0.0, 1.0);
            let t = self.weights[1].dot(d).clamp(0.0, 1.0);
            let n = unit(self.normal + self.change[0] * s + self.change[1] * t);
            (row.nx[k], row.ny[k], row.nz[k]) = (n.x, n.y, n.z);
        }
    }

    /// Writes color, darkness and lamp of pixels `from..to`; their points and normals are known.
    pub fn paint(&self, frame: &Frame, row: &mut Row, from: usize, to: usize, is_plan: bool) {
        row.r[from..to].fill(self.color.x);
        row.g[from..to].fill(self.color.y);
        row.b[from..to].fill(self.color.z);
        if let Some(tile) = self.tile {
            let (u0, v0) = (self.u.dot(self.origin), self.v.dot(self.origin));
            for k in from..to {
                let p = row.point(k);
                let t = tile.sample(self.u.dot(p) - u0, self.v.dot(p) - v0, row.covers_m[k]);
                row.r[k] *= t;
                row.g[k] *= t;
                row.b[k] *= t;
            }
        }
        match self.entity {
            EntityId::FLOOR => {
                for k in from..to {
                    row.shade[k] = frame.light.ground_brightness(row.x[k], row.z[k]);
                }
            }
            EntityId::WALL => self.paint_wall(frame, row, from, to, is_plan),
            EntityId::CEILING => row.shade[from..to].fill(2.0),
            _ => {
                for k in from..to {
                    let up = ((row.y[k] - self.origin.y) * 7.0).clamp(0.0, 1.0);
                    row.shade[k] = 0.76 + 0.24 * up;
                }
            }
        }
        self.find_lamps(frame, row, from, to);
    }

    fn paint_wall(&self, frame: &Frame, row: &mut Row, from: usize, to: usize, is_plan: bool) {
        let top = is_plan && self.normal.y > 0.5;
        let ceiling = frame.light.ground.ceiling_m;
        for k in from..to {
            let y = row.y[k];
            let low = (1.0 - y * 2.2).max(0.0);
            let high = ceiling.map_or(0.0, |c| (1.0 - (c - y) * 2.2).max(0.0));
            row.shade[k] = 1.0 - 0.22 * low * low - 0.16 * high * high;
            let is_skirting = ceiling.is_some() && y < SKIRTING_M && self.normal.y < 0.5;
            if is_skirting || top {
                let white = if top { 0.03 } else { 0.62 };
                (row.r[k], row.g[k], row.b[k]) = (white, white, white);
                row.shade[k] *= if !top && y > SKIRTING_M - 0.012 { 0.72 } else { 1.0 };
            }
        }
    }

    fn find_lamps(&self, frame: &Frame, row: &mut Row, from: usize, to: usize) {
        let ground = frame.light.ground;
        // Structure spans rooms: each point has its own. A step off the surface leaves the wall.
        let step = Vec3::new(0.1 * self.normal.x, 0.0, 0.1 * self.normal.z);
        let room_of = |row: &Row, k: usize| ground.room_at(row.point(k) + step);
        let mut begin = from;
        while begin < to {
            let (room, end) = match self.room {
                Some(room) => (room, to),
                None => {
                    // Rooms are wider than a few pixels: where both ends of a piece agree, all do.
                    let room = room_of(row, begin);
                    let far = (begin + PIECE).min(to);
                    let agrees = room_of(row, far - 1) == room;
                    (room, if agrees { far } else { begin + 1 })
                }
            };
            let lamp = if room == NO_ROOM { None } else { ground.lamp(room) };
            row.indoors[begin..end].fill(if lamp.is_some() { 1.0 } else { 0.0 });
            let lamp = lamp.unwrap_or(Vec3::ZERO);
            row.lx[begin..end].fill(lamp.x);
            row.ly[begin..end].fill(lamp.y);
            row.lz[begin..end].fill(lamp.z);
            begin = end;
        }
    }
}
