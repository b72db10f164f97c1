//! What a batch of views gave.

use std::sync::{Arc, Mutex, PoisonError};

use chaic_core::observation::Images;
use chaic_render::Channels;

use crate::device::Link;
use crate::error::GpuError;

/// The images of a batch in the device's memory.
#[derive(Debug)]
pub(crate) struct Outputs {
    pub depth: wgpu::Buffer,
    pub ids: wgpu::Buffer,
    pub color: wgpu::Buffer,
}

/// Outputs that no batch uses, to be used again: making them anew costs as much as a picture.
pub(crate) type Spare = Arc<Mutex<Vec<Outputs>>>;

/// What a batch of views gave: on the device until [`Batch::read`] copies it.
#[derive(Debug)]
pub struct Batch {
    pub(crate) link: Arc<Link>,
    pub(crate) spare: Spare,
    pub(crate) outputs: Option<Outputs>,
    pub(crate) channels: Vec<Channels>,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

impl Batch {
    /// Number of views.
    pub fn n_views(&self) -> usize {
        self.channels.len()
    }

    /// Width and height of each view, pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Words in a row of [`Batch::ids`].
    pub fn id_words(&self) -> u32 {
        self.width.div_ceil(2)
    }

    /// Depth along the cameras' axes, f32 metres, shape [view, height, width].
    pub fn depth(&self) -> Option<&wgpu::Buffer> {
        self.outputs.as_ref().map(|o| &o.depth)
    }

    /// Instance ids, u16, shape [view, height, width rounded up to a multiple of 2], as
    /// little-endian pairs.
    pub fn ids(&self) -> Option<&wgpu::Buffer> {
        self.outputs.as_ref().map(|o| &o.ids)
    }

    /// Color as it is shown, u8, shape [view, height, width, 4] (red, green, blue, 255); only if a view
    /// asked for it.
    pub fn color(&self) -> Option<&wgpu::Buffer> {
        let is_there = self.channels.iter().any(|c| c.rgb);
        self.outputs.as_ref().map(|o| &o.color).filter(|_| is_there)
    }

    /// Waits until the images are drawn.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.link.wait()
    }

    /// Copies what the views asked for back from the device, in their order.
    pub fn read(&self) -> Result<Vec<Images>, GpuError> {
        let n = self.width as usize * self.height as usize;
        let n_views = self.n_views();
        let wants = |of: fn(&Channels) -> bool| self.channels.iter().any(of);
        let (rgb, depth, ids) = (wants(|c| c.rgb), wants(|c| c.depth), wants(|c| c.ids));
        let line = 2 * self.id_words() as usize;
        let bytes =
            |asked: bool, per_view: usize| if asked { (n_views * per_view) as u64 } else { 0 };
        let got = match &self.outputs {
            Some(o) => self.link.read(&[
                (&o.color, bytes(rgb, 4 * n)),
                (&o.depth, bytes(depth, 4 * n)),
                (&o.ids, bytes(ids, 2 * line * self.height as usize)),
            ])?,
            None => vec![Vec::new(); 3],
        };
        let images = self.channels.iter().enumerate().map(|(k, channels)| {
            let part =
                |array: usize, per_view: usize| &got[array][k * per_view..(k + 1) * per_view];
            Images {
                rgb: channels.rgb.then(|| {
                    let pixels = part(0, 4 * n).chunks_exact(4);
                    pixels.flat_map(|p| [p[0], p[1], p[2]]).collect()
                }),
                depth_m: channels.depth.then(|| {
                    let pixels = part(1, 4 * n).chunks_exact(4);
                    pixels.map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
                }),
                ids: channels.ids.then(|| {
                    let rows =
                        part(2, 2 * line * self.height as usize).chunks_exact(2 * line.max(1));
                    let row = |row: &[u8]| -> Vec<u16> {
                        let ids = row.chunks_exact(2).take(self.width as usize);
                        ids.map(|b| u16::from_le_bytes([b[0], b[1]])).collect()
                    };
                    rows.flat_map(row).collect()
                }),
            }
        });
        Ok(images.collect())
    }
}

impl Drop for Batch {
    fn drop(&mut self) {
        if let Some(outputs) = self.outputs.take() {
            self.spare.lock().unwrap_or_else(PoisonError::into_inner).push(outputs);
        }
    }
}
