//! Messages of the protocol between chaic and a helper process.
//!
//! docs/subprocess-helpers.md describes them. The types of this module fix the keys on the wire,
//! even if the same data has other keys in traces.

use chaic_core::agent::Thought;
use chaic_core::geom::Camera;
use chaic_core::observation::{
    FrameHistorySpec, GrantedInfo, HistoryFrame, Images, Proprioception, SensorConfig,
};
use chaic_core::{Action, Briefing, Observation};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::frame::MessageFrame;

/// Longest text of a helper that is kept, bytes: a thought, a problem.
pub const MAX_TEXT: usize = 2000;
/// Largest number of entries of a list in a thought that are kept.
pub const MAX_THOUGHT_ENTRIES: usize = 256;

/// Cuts a text of any length after [`MAX_TEXT`] bytes.
pub(crate) fn cut(text: &str) -> String {
    let end = (0..=text.len().min(MAX_TEXT)).rev().find(|k| text.is_char_boundary(*k));
    text[..end.unwrap_or(0)].to_owned()
}

/// Version of the protocol. Both sides state theirs in `hello`, and a helper of another version is
/// refused.
pub const PROTOCOL: u32 = 2;

/// Message of chaic to a helper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum RequestMessage {
    /// First message; the answer is [`ResponseMessage::Hello`].
    Hello {
        /// [`PROTOCOL`].
        protocol: u32,
        /// Version of the program.
        chaic: String,
    },
    /// Start of an episode; the answer is [`ResponseMessage::Ready`].
    Reset {
        /// Briefing of the agent.
        briefing: Box<Briefing>,
    },
    /// End of the agent's last action; the answer is [`ResponseMessage::Act`]. The frame's body holds the
    /// images.
    Observe(Box<ObservationMessage>),
    /// End of the episode; the process exits without an answer.
    Bye,
}

/// Answer of a helper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum ResponseMessage {
    /// Answer to [`RequestMessage::Hello`].
    Hello {
        /// [`PROTOCOL`].
        protocol: u32,
        /// Name of the helper.
        name: String,
    },
    /// Answer to [`RequestMessage::Reset`].
    Ready {
        /// Requested sensors.
        sensors: SensorRequest,
    },
    /// Answer to [`RequestMessage::Observe`].
    Act {
        /// Next action.
        action: Action,
        /// Thought, for replays.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        thought: Option<Thought>,
    },
    /// Replaces any other answer if the helper can't continue. The episode scores zero.
    Failed {
        /// Problem.
        problem: String,
    },
}

/// Sensors that a helper requests; fields as in [`SensorConfig`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SensorRequest {
    /// Width and height of the images, pixels.
    pub image_size: u32,
    /// True for color.
    pub rgb: bool,
    /// True for depth.
    pub depth: bool,
    /// True for instance ids, which need a grant.
    pub ids: bool,
    /// Images between decisions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame_history: Option<FrameHistoryRequest>,
}

/// Images between decisions that a helper requests; fields as in [`FrameHistorySpec`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameHistoryRequest {
    /// Width and height of the images, pixels.
    pub image_size: u32,
    /// Period of the images, frames.
    pub every_frames: u32,
    /// Largest number of images; older ones are dropped.
    pub max_len: u32,
}

impl From<SensorConfig> for SensorRequest {
    fn from(config: SensorConfig) -> SensorRequest {
        let SensorConfig { image_size, rgb, depth, ids, frame_history } = config;
        let frame_history = frame_history.map(|spec| {
            let FrameHistorySpec { image_size, every_frames, max_len } = spec;
            FrameHistoryRequest { image_size, every_frames, max_len }
        });
        SensorRequest { image_size, rgb, depth, ids, frame_history }
    }
}

impl From<SensorRequest> for SensorConfig {
    fn from(request: SensorRequest) -> SensorConfig {
        let SensorRequest { image_size, rgb, depth, ids, frame_history } = request;
        let frame_history = frame_history.map(|request| {
            let FrameHistoryRequest { image_size, every_frames, max_len } = request;
            FrameHistorySpec { image_size, every_frames, max_len }
        });
        SensorConfig { image_size, rgb, depth, ids, frame_history }
    }
}

/// An observation without pixels; fields as in [`Observation`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObservationMessage {
    /// Frames since the start of the episode.
    pub frame: chaic_core::Frame,
    /// State of the agent's own body.
    pub proprioception: Proprioception,
    /// Camera of the images.
    pub camera: Camera,
    /// Granted information.
    pub granted: GrantedInfo,
    /// Images in the body of the frame.
    pub images: Vec<ImageHeader>,
    /// Frame and camera of each history image, oldest first. The oldest image is named
    /// `frame_history0.rgb` and `frame_history0.depth_m`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub frame_history: Vec<FrameHistoryHeader>,
}

/// Frame and camera of a history image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameHistoryHeader {
    /// Frame of the image.
    pub frame: chaic_core::Frame,
    /// Camera of the image.
    pub camera: Camera,
}

/// Position of an image in the body of its frame: row-major, row 0 at the top, little-endian.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageHeader {
    /// `rgb`, `depth_m` or `ids`, as in [`Images`]; with a prefix such as `frame_history0.` for a history
    /// image.
    pub name: String,
    /// `u8`, `f32` or `u16`.
    pub dtype: String,
    /// Height and width, and 3 for color.
    pub shape: Vec<u32>,
    /// Offset of the first byte.
    pub offset: usize,
    /// Number of bytes.
    pub bytes: usize,
}

/// Returns the frame of a message without images.
pub(crate) fn plain<M: Serialize>(message: &M) -> MessageFrame {
    MessageFrame { head: serde_json::to_vec(message).expect("messages are JSON"), body: Vec::new() }
}

/// Parses the message in the head of a frame.
pub(crate) fn message<M: DeserializeOwned>(frame: &MessageFrame) -> Result<M, String> {
    serde_json::from_slice(&frame.head).map_err(|e| {
        let start = String::from_utf8_lossy(&frame.head[..frame.head.len().min(200)]).into_owned();
        cut(&format!("no message of the protocol: {start} ({e})"))
    })
}

/// Prefix of the names of history images, before their index.
const HISTORY_PREFIX: &str = "frame_history";

/// Returns the frame of an observation.
pub fn observation_frame(observation: &Observation) -> MessageFrame {
    let Observation { frame, proprioception, camera, images, frame_history, granted } = observation;
    let (mut headers, mut body) = (Vec::new(), Vec::new());
    let mut add = |name: &str, dtype: &str, shape: &[u32], bytes: &mut dyn Iterator<Item = u8>| {
        let offset = body.len();
        body.extend(bytes);
        headers.push(ImageHeader {
            name: name.to_owned(),
            dtype: dtype.to_owned(),
            shape: shape.to_vec(),
            offset,
            bytes: body.len() - offset,
        });
    };
    let mut add_all = |prefix: &str, images: &Images, camera: &Camera| {
        let shape = [camera.height, camera.width];
        if let Some(rgb) = &images.rgb {
            let name = format!("{prefix}rgb");
            add(&name, "u8", &[shape[0], shape[1], 3], &mut rgb.iter().copied());
        }
        if let Some(depth) = &images.depth_m {
            let bytes = &mut depth.iter().flat_map(|d| d.to_le_bytes());
            add(&format!("{prefix}depth_m"), "f32", &shape, bytes);
        }
        if let Some(ids) = &images.ids {
            let bytes = &mut ids.iter().flat_map(|id| id.to_le_bytes());
            add(&format!("{prefix}ids"), "u16", &shape, bytes);
        }
    };
    add_all("", images, camera);
    for (k, history) in frame_history.iter().enumerate() {
        add_all(&format!("{HISTORY_PREFIX}{k}."), &history.images, &history.camera);
    }
    let message = ObservationMessage {
        frame: *frame,
        proprioception: proprioception.clone(),
        camera: *camera,
        granted: granted.clone(),
        images: headers,
        frame_history: frame_history
            .iter()
            .map(|history| FrameHistoryHeader { frame: history.frame, camera: history.camera })
            .collect(),
    };
    MessageFrame { body, ..plain(&RequestMessage::Observe(Box::new(message))) }
}

/// Assembles the observation of a message and its frame's body.
pub(crate) fn observation(message: ObservationMessage, body: &[u8]) -> Result<Observation, String> {
    let mut images = Images::default();
    let without_images = |FrameHistoryHeader { frame, camera }| HistoryFrame {
        frame,
        camera,
        images: Images::default(),
    };
    let mut frame_history: Vec<HistoryFrame> =
        message.frame_history.iter().copied().map(without_images).collect();
    for header in &message.images {
        let end = header.offset.checked_add(header.bytes);
        let bytes = end.and_then(|end| body.get(header.offset..end));
        let bytes = bytes.ok_or_else(|| format!("the image {} is not in the body", header.name))?;
        let unknown = || format!("there is no image `{}`", header.name);
        let (images, name) = match header.name.split_once('.') {
            None => (&mut images, header.name.as_str()),
            Some((prefix, name)) => {
                let index =
                    prefix.strip_prefix(HISTORY_PREFIX).and_then(|k| k.parse::<usize>().ok());
                let history = index.and_then(|k| frame_history.get_mut(k)).ok_or_else(unknown)?;
                (&mut history.images, name)
            }
        };
        match name {
            "rgb" => images.rgb = Some(bytes.to_vec()),
            "depth_m" => {
                let (values, _) = bytes.as_chunks::<4>();
                images.depth_m = Some(values.iter().map(|b| f32::from_le_bytes(*b)).collect());
            }
            "ids" => {
                let (values, _) = bytes.as_chunks::<2>();
                images.ids = Some(values.iter().map(|b| u16::from_le_bytes(*b)).collect());
            }
            _ => return Err(unknown()),
        }
    }
    let ObservationMessage { frame, proprioception, camera, granted, .. } = message;
    Ok(Observation { frame, proprioception, camera, images, frame_history, granted })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_have_the_keys_of_version_2() {
        let text = r#"{"image_size":128,"rgb":true,"depth":true,"ids":false,"frame_history":{"image_size":64,"every_frames":3,"max_len":16}}"#;
        let request: SensorRequest = serde_json::from_str(text).unwrap();
        assert_eq!(serde_json::to_string(&request).unwrap(), text);
        let config = SensorConfig::from(request);
        assert_eq!(config.frame_history.map(|spec| spec.max_len), Some(16));
        assert_eq!(SensorRequest::from(config), request);
        let old =
            r#"{"type":"ready","senses":{"image_size":128,"rgb":true,"depth":true,"ids":false}}"#;
        let problem = serde_json::from_str::<ResponseMessage>(old).unwrap_err().to_string();
        assert!(problem.contains("sensors"), "{problem}");
    }
}
