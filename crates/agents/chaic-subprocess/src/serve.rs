//! The other side: any mind of ours as a process of the protocol.

use std::io::{self, Read, Write};

use chaic_core::Agent;

use crate::frame::{Frame, MAX_BODY};
use crate::message::{PROTOCOL, ToEnv, ToMind, message, observation, plain};

/// Lets a mind answer on a pipe until it is told to end, or the pipe is closed.
///
/// # Errors
/// If a pipe breaks, or something else than the protocol comes over it.
pub fn serve(
    name: &str,
    mind: &mut dyn Agent,
    input: &mut dyn Read,
    output: &mut dyn Write,
) -> io::Result<()> {
    let wrong = |text: String| io::Error::new(io::ErrorKind::InvalidData, text);
    while let Some(frame) = Frame::read(input, MAX_BODY)? {
        let answer = match message(&frame).map_err(wrong)? {
            ToMind::Hello { .. } => ToEnv::Hello { protocol: PROTOCOL, name: name.to_owned() },
            ToMind::Reset { briefing } => {
                mind.reset(&briefing);
                ToEnv::Ready { senses: mind.senses() }
            }
            ToMind::Observe(seen) => {
                let observation = observation(*seen, &frame.body).map_err(wrong)?;
                match mind.act(&observation) {
                    Ok(action) => ToEnv::Act { action, thought: Some(mind.thought()) },
                    Err(problem) => ToEnv::Failed { problem: problem.to_string() },
                }
            }
            ToMind::Bye => return Ok(()),
        };
        plain(&answer).write(output)?;
    }
    Ok(())
}
