//! The last pictures that a mind has looked at, encoded for a request.

use std::collections::VecDeque;
use std::io::Cursor;

use chaic_core::Observation;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::FilterType;
use image::{ImageFormat, RgbImage};

use crate::endpoint::PicturesByHash;
use crate::exchange::ContentHash;
use crate::settings::{PictureFormat, Pictures};

/// Quality of JPEG pictures, percent.
const JPEG_QUALITY: u8 = 85;

/// One picture; encoded when it is asked for the first time.
#[derive(Debug)]
enum Picture {
    Raw(RgbImage),
    Encoded(ContentHash, Vec<u8>),
}

/// The last pictures, oldest first.
#[derive(Debug, Default)]
pub struct Album {
    pictures: VecDeque<Picture>,
}

impl Album {
    /// Takes in what is seen now.
    pub fn see(&mut self, observation: &Observation, settings: Pictures) {
        let Some(rgb) = observation.images.rgb.clone() else { return };
        let (width, height) = (observation.camera.width, observation.camera.height);
        // A picture of another size than its camera's is none.
        let Some(image) = RgbImage::from_raw(width, height, rgb) else { return };
        while self.pictures.len() >= settings.count {
            self.pictures.pop_front();
        }
        self.pictures.push_back(Picture::Raw(image));
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.pictures.len()
    }

    /// Forgets them.
    pub fn clear(&mut self) {
        self.pictures.clear();
    }

    /// All of them encoded, and their hashes in order.
    pub fn encoded(&mut self, settings: Pictures) -> (Vec<ContentHash>, PicturesByHash) {
        let (mut order, mut by_hash) = (Vec::new(), PicturesByHash::new());
        for picture in &mut self.pictures {
            if let Picture::Raw(image) = picture {
                let bytes = encode(image, settings);
                *picture = Picture::Encoded(ContentHash::of(&bytes), bytes);
            }
            if let Picture::Encoded(hash, bytes) = picture {
                order.push(*hash);
                by_hash.insert(*hash, bytes.clone());
            }
        }
        (order, by_hash)
    }
}

fn encode(image: &RgbImage, settings: Pictures) -> Vec<u8> {
    let is_larger = image.width() > settings.size;
    let small = is_larger.then(|| {
        image::imageops::resize(image, settings.size, settings.size, FilterType::Triangle)
    });
    let image = small.as_ref().unwrap_or(image);
    let mut bytes = Cursor::new(Vec::new());
    let written = match settings.format {
        PictureFormat::Png => image.write_to(&mut bytes, ImageFormat::Png),
        PictureFormat::Jpeg => {
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
    fn pictures_are_made_smaller_and_encoded_the_same_each_time() {
        let image = RgbImage::from_fn(64, 64, |x, y| image::Rgb([x as u8, y as u8, 7]));
        for (format, signature) in
            [(PictureFormat::Png, &b"\x89PNG"[..]), (PictureFormat::Jpeg, &b"\xff\xd8"[..])]
        {
            let settings = Pictures { count: 2, size: 32, format };
            let bytes = encode(&image, settings);
            assert!(bytes.starts_with(signature));
            assert_eq!(bytes, encode(&image, settings));
            assert_ne!(bytes, encode(&image, Pictures { size: 64, ..settings }));
        }
    }
}
