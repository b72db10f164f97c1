//! Helper side of the protocol: serves any agent as a helper process.

use std::io::{self, Read, Write};

use chaic_core::Agent;

use crate::frame::{MAX_BODY, MessageFrame};
use crate::message::{PROTOCOL, RequestMessage, ResponseMessage, message, observation, plain};

/// Serves an agent on a pipe until `bye` arrives or the pipe is closed.
///
/// # Errors
/// If a pipe breaks or the input violates the protocol.
pub fn serve(
    name: &str,
    agent: &mut dyn Agent,
    input: &mut dyn Read,
    output: &mut dyn Write,
) -> io::Result<()> {
    let invalid = |text: String| io::Error::new(io::ErrorKind::InvalidData, text);
    while let Some(frame) = MessageFrame::read(input, MAX_BODY)? {
        let answer = match message(&frame).map_err(invalid)? {
            RequestMessage::Hello { .. } => {
                ResponseMessage::Hello { protocol: PROTOCOL, name: name.to_owned() }
            }
            RequestMessage::Reset { briefing } => {
                agent.reset(&briefing);
                ResponseMessage::Ready { sensors: agent.sensors().into() }
            }
            RequestMessage::Observe(request) => {
                let observation = observation(*request, &frame.body).map_err(invalid)?;
                match agent.act(&observation) {
                    Ok(action) => ResponseMessage::Act { action, thought: Some(agent.thought()) },
                    Err(problem) => ResponseMessage::Failed { problem: problem.to_string() },
                }
            }
            RequestMessage::Bye => return Ok(()),
        };
        plain(&answer).write(output)?;
    }
    Ok(())
}
