//! Helper side of the protocol: serves any agent as a helper process.

use std::io::{self, Read, Write};

use chaic_core::Agent;
use chaic_core::observation::Grants;

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
    serve_with_grants(name, agent, Grants::NONE, input, output)
}

/// Serves an agent that needs grants, as [`serve`] does. A briefing without them is answered with
/// `failed`.
///
/// # Errors
/// As [`serve`].
pub fn serve_with_grants(
    name: &str,
    agent: &mut dyn Agent,
    needed: Grants,
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
                let missing = needed.names_beyond(briefing.grants);
                if missing.is_empty() {
                    agent.reset(&briefing);
                    ResponseMessage::Ready { sensors: agent.sensors().into() }
                } else {
                    ResponseMessage::Failed { problem: without_grants(needed, &missing) }
                }
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

/// Returns the problem of a briefing without some of the needed grants.
fn without_grants(needed: Grants, missing: &[&str]) -> String {
    let needed = needed.names_beyond(Grants::NONE).join(",");
    let missing = missing.join(",");
    format!("the briefing lacks the grants {missing}; give --exec-grants {needed}")
}
