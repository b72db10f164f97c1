//! What is said between an environment and a mind in another process.

use chaic_core::agent::Thought;
use chaic_core::geom::Camera;
use chaic_core::observation::{FilmFrame, Granted, Images, SelfState, Senses};
use chaic_core::{Action, Briefing, Observation};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::frame::Frame;

/// Longest text of a mind that is kept, bytes: a thought, a problem.
pub const MAX_TEXT: usize = 2000;
/// Most things that a thought may say are in sight; more aren't kept.
pub const MAX_SEES: usize = 256;

/// The beginning of a text that may be of any length.
pub(crate) fn cut(text: &str) -> String {
    let end = (0..=text.len().min(MAX_TEXT)).rev().find(|k| text.is_char_boundary(*k));
    text[..end.unwrap_or(0)].to_owned()
}

/// The version of the protocol. Both sides say theirs, and part if they differ.
pub const PROTOCOL: u32 = 1;

/// What the environment says, with the answers that it waits for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum ToMind {
    /// Comes first; answered by [`ToEnv::Hello`].
    Hello {
        /// [`PROTOCOL`].
        protocol: u32,
        /// Version of the program.
        chaic: String,
    },
    /// An episode begins; answered by [`ToEnv::Ready`].
    Reset {
        /// What the agent is told.
        briefing: Box<Briefing>,
    },
    /// The agent's last action has ended; answered by [`ToEnv::Act`]. The images are the body of the
    /// frame.
    Observe(Box<Seen>),
    /// The episode is over, and nothing is to be answered: the process ends.
    Bye,
}

/// What the mind answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum ToEnv {
    /// It is there.
    Hello {
        /// [`PROTOCOL`].
        protocol: u32,
        /// What it calls itself.
        name: String,
    },
    /// It is briefed.
    Ready {
        /// What it wants to perceive.
        senses: Senses,
    },
    /// It has decided.
    Act {
        /// What to do.
        action: Action,
        /// What it thinks, for replays.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        thought: Option<Thought>,
    },
    /// In place of any other answer: it can't go on. Its episode counts as zero.
    Failed {
        /// Why.
        problem: String,
    },
}

/// An observation without the images themselves; fields as in [`Observation`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// Frames since the episode began.
    pub frame: chaic_core::Frame,
    /// What the agent knows of itself.
    pub own: SelfState,
    /// The camera that took the images.
    pub camera: Camera,
    /// What was granted beyond that.
    pub granted: Granted,
    /// Where the images are.
    pub images: Vec<ImageHead>,
    /// When and from where the images of a film were taken, oldest first; those of the first are called
    /// `film0.rgb` and `film0.depth_m`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub film: Vec<FilmHead>,
}

/// When and from where an image of a film was taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FilmHead {
    /// When.
    pub frame: chaic_core::Frame,
    /// The camera that took it.
    pub camera: Camera,
}

/// Where an image lies in the body of its frame: row-major, row 0 at the top, little-endian.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageHead {
    /// `rgb`, `depth_m` or `ids`, as in [`Images`]; with `film` and a number before it for a film's.
    pub name: String,
    /// `u8`, `f32` or `u16`.
    pub dtype: String,
    /// Height and width, and 3 for color.
    pub shape: Vec<u32>,
    /// The first byte.
    pub offset: usize,
    /// How many bytes.
    pub bytes: usize,
}

/// A frame for a message without images.
pub(crate) fn plain<M: Serialize>(message: &M) -> Frame {
    Frame { head: serde_json::to_vec(message).expect("messages are JSON"), body: Vec::new() }
}

/// The message in the head of a frame.
pub(crate) fn message<M: DeserializeOwned>(frame: &Frame) -> Result<M, String> {
    serde_json::from_slice(&frame.head).map_err(|e| {
        let start = String::from_utf8_lossy(&frame.head[..frame.head.len().min(200)]).into_owned();
        cut(&format!("no message of the protocol: {start} ({e})"))
    })
}

/// What the names of images of a film begin with: `film0.rgb` is the color of the oldest.
fn film_prefix(k: usize) -> String {
    format!("film{k}.")
}

/// The frame of an observation.
pub fn observation_frame(observation: &Observation) -> Frame {
    let Observation { frame, own, camera, images, film, granted } = observation;
    let (mut heads, mut body) = (Vec::new(), Vec::new());
    let mut add = |name: &str, dtype: &str, shape: &[u32], bytes: &mut dyn Iterator<Item = u8>| {
        let offset = body.len();
        body.extend(bytes);
        heads.push(ImageHead {
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
    for (k, of_film) in film.iter().enumerate() {
        add_all(&film_prefix(k), &of_film.images, &of_film.camera);
    }
    let seen = Seen {
        frame: *frame,
        own: own.clone(),
        camera: *camera,
        granted: granted.clone(),
        images: heads,
        film: film.iter().map(|f| FilmHead { frame: f.frame, camera: f.camera }).collect(),
    };
    Frame { body, ..plain(&ToMind::Observe(Box::new(seen))) }
}

/// The observation in a frame.
pub(crate) fn observation(seen: Seen, body: &[u8]) -> Result<Observation, String> {
    let mut images = Images::default();
    let of_film =
        |FilmHead { frame, camera }| FilmFrame { frame, camera, images: Images::default() };
    let mut film: Vec<FilmFrame> = seen.film.iter().copied().map(of_film).collect();
    for head in &seen.images {
        let end = head.offset.checked_add(head.bytes);
        let bytes = end.and_then(|end| body.get(head.offset..end));
        let bytes = bytes.ok_or_else(|| format!("the image {} isn't there", head.name))?;
        let unknown = || format!("there is no image `{}`", head.name);
        let (images, name) = match head.name.split_once('.') {
            None => (&mut images, head.name.as_str()),
            Some((prefix, name)) => {
                let number = prefix.strip_prefix("film").and_then(|k| k.parse::<usize>().ok());
                let of_film = number.and_then(|k| film.get_mut(k)).ok_or_else(unknown)?;
                (&mut of_film.images, name)
            }
        };
        match name {
            "rgb" => images.rgb = Some(bytes.to_vec()),
            "depth_m" => {
                let (numbers, _) = bytes.as_chunks::<4>();
                images.depth_m = Some(numbers.iter().map(|b| f32::from_le_bytes(*b)).collect());
            }
            "ids" => {
                let (numbers, _) = bytes.as_chunks::<2>();
                images.ids = Some(numbers.iter().map(|b| u16::from_le_bytes(*b)).collect());
            }
            _ => return Err(unknown()),
        }
    }
    let Seen { frame, own, camera, granted, .. } = seen;
    Ok(Observation { frame, own, camera, images, film, granted })
}
