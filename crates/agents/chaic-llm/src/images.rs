//! Recent images of an agent, encoded for requests.

use std::collections::VecDeque;
use std::io::Cursor;

use chaic_core::Observation;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::FilterType;
use image::{ImageFormat, RgbImage};

use crate::endpoint::ImagesByHash;
use crate::exchange::ContentHash;
use crate::settings::{ImageEncoding, ImageSettings};

/// JPEG quality, percent.
const JPEG_QUALITY: u8 = 85;

/// Image, encoded at its first use.
#[derive(Debug)]
enum StoredImage {
    Raw(RgbImage),
    Encoded(ContentHash, Vec<u8>),
}

/// Recent images, oldest first.
#[derive(Debug, Default)]
pub struct RecentImages {
    images: VecDeque<StoredImage>,
}

impl RecentImages {
    /// Appends the current image.
    pub fn push(&mut self, observation: &Observation, settings: ImageSettings) {
        let Some(rgb) = observation.images.rgb.clone() else { return };
        let (width, height) = (observation.camera.width, observation.camera.height);
        // Images whose size differs from the camera's are ignored.
        let Some(image) = RgbImage::from_raw(width, height, rgb) else { return };
        while self.images.len() >= settings.count {
            self.images.pop_front();
        }
        self.images.push_back(StoredImage::Raw(image));
    }

    /// Returns the number of images.
    pub fn count(&self) -> usize {
        self.images.len()
    }

    /// Removes all images.
    pub fn clear(&mut self) {
        self.images.clear();
    }

    /// Returns all images encoded, and their hashes in order.
    pub fn encoded(&mut self, settings: ImageSettings) -> (Vec<ContentHash>, ImagesByHash) {
        let (mut order, mut by_hash) = (Vec::new(), ImagesByHash::new());
        for stored in &mut self.images {
            if let StoredImage::Raw(image) = stored {
                let bytes = encode(image, settings);
                *stored = StoredImage::Encoded(ContentHash::new(&bytes), bytes);
            }
            if let StoredImage::Encoded(hash, bytes) = stored {
                order.push(*hash);
                by_hash.insert(*hash, bytes.clone());
            }
        }
        (order, by_hash)
    }
}

fn encode(image: &RgbImage, settings: ImageSettings) -> Vec<u8> {
    let is_larger = image.width() > settings.size;
    let small = is_larger.then(|| {
        image::imageops::resize(image, settings.size, settings.size, FilterType::Triangle)
    });
    let image = small.as_ref().unwrap_or(image);
    let mut bytes = Cursor::new(Vec::new());
    let written = match settings.format {
        ImageEncoding::Png => image.write_to(&mut bytes, ImageFormat::Png),
        ImageEncoding::Jpeg => {
            JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY).encode_image(image)
        }
    };
    written.expect("an RGB image can be encoded into memory");
    bytes.into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_resized_and_encoded_deterministically() {
        let image = RgbImage::from_fn(64, 64, |x, y| image::Rgb([x as u8, y as u8, 7]));
        for (format, signature) in
            [(ImageEncoding::Png, &b"\x89PNG"[..]), (ImageEncoding::Jpeg, &b"\xff\xd8"[..])]
        {
            let settings = ImageSettings { count: 2, size: 32, format };
            let bytes = encode(&image, settings);
            assert!(bytes.starts_with(signature));
            assert_eq!(bytes, encode(&image, settings));
            assert_ne!(bytes, encode(&image, ImageSettings { size: 64, ..settings }));
        }
    }
}
