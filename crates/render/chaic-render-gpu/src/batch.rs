//! Output images of a batch of views.

use std::sync::{Arc, Mutex, PoisonError};

use chaic_core::observation::Images;
use chaic_render::Channels;

use crate::device::GpuContext;
use crate::error::GpuError;

/// Output images of a batch in device memory.
#[derive(Debug)]
pub(crate) struct Outputs {
    pub depth: wgpu::Buffer,
    pub ids: wgpu::Buffer,
    pub color: wgpu::Buffer,
}

/// Free output buffers for reuse: allocating them costs as much as rendering an image.
pub(crate) type FreeOutputs = Arc<Mutex<Vec<Outputs>>>;

/// Rendered batch of views. The images stay on the device until [`Batch::read`] copies them.
#[derive(Debug)]
pub struct Batch {
    pub(crate) context: Arc<GpuContext>,
    pub(crate) free_outputs: FreeOutputs,
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

    /// Number of 32-bit words in a row of [`Batch::ids`].
    pub fn id_words(&self) -> u32 {
        self.width.div_ceil(2)
    }

    /// Depth along the camera axis, f32 meters, shape [view, height, width]. It is rendered for
    /// every view, requested or not; `None` if the batch has no pixels.
    pub fn depth(&self) -> Option<&wgpu::Buffer> {
        self.outputs.as_ref().map(|o| &o.depth)
    }

    /// Instance ids, u16, shape [view, height, width rounded up to a multiple of 2], as
    /// little-endian pairs. They are rendered for every view, requested or not; `None` if the batch
    /// has no pixels.
    pub fn ids(&self) -> Option<&wgpu::Buffer> {
        self.outputs.as_ref().map(|o| &o.ids)
    }

    /// Display color, u8, shape [view, height, width, 4] (red, green, blue, 255); `None` if no view
    /// requested it, or the batch has no pixels.
    pub fn color(&self) -> Option<&wgpu::Buffer> {
        let has_color = self.channels.iter().any(|c| c.rgb);
        self.outputs.as_ref().map(|o| &o.color).filter(|_| has_color)
    }

    /// Waits until the images are rendered.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.context.wait()
    }

    /// Copies the requested images from the device, in the order of the views.
    pub fn read(&self) -> Result<Vec<Images>, GpuError> {
        let n = self.width as usize * self.height as usize;
        let n_views = self.n_views();
        let is_any_requested = |channel: fn(&Channels) -> bool| self.channels.iter().any(channel);
        let (rgb, depth, ids) = (
            is_any_requested(|c| c.rgb),
            is_any_requested(|c| c.depth),
            is_any_requested(|c| c.ids),
        );
        let ids_per_row = 2 * self.id_words() as usize;
        let n_bytes = |is_requested: bool, per_view: usize| {
            if is_requested { (n_views * per_view) as u64 } else { 0 }
        };
        let data = match &self.outputs {
            Some(o) => self.context.read(&[
                (&o.color, n_bytes(rgb, 4 * n)),
                (&o.depth, n_bytes(depth, 4 * n)),
                (&o.ids, n_bytes(ids, 2 * ids_per_row * self.height as usize)),
            ])?,
            None => vec![Vec::new(); 3],
        };
        let images = self.channels.iter().enumerate().map(|(k, channels)| {
            let bytes_of_view =
                |array: usize, per_view: usize| &data[array][k * per_view..(k + 1) * per_view];
            Images {
                rgb: channels.rgb.then(|| {
                    let pixels = bytes_of_view(0, 4 * n).chunks_exact(4);
                    pixels.flat_map(|p| [p[0], p[1], p[2]]).collect()
                }),
                depth_m: channels.depth.then(|| {
                    let pixels = bytes_of_view(1, 4 * n).chunks_exact(4);
                    pixels.map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
                }),
                ids: channels.ids.then(|| {
                    let rows = bytes_of_view(2, 2 * ids_per_row * self.height as usize)
                        .chunks_exact(2 * ids_per_row.max(1));
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
            self.free_outputs.lock().unwrap_or_else(PoisonError::into_inner).push(outputs);
        }
    }
}
