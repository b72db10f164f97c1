//! Minimal HTTP/1.1 for a test server; `httparse` parses the heads.

use std::io::{self, Read as _, Write as _};
use std::net::TcpStream;

/// Maximum length of a request head, bytes.
const MAX_HEAD: usize = 64 << 10;
/// Maximum length of a request body, bytes: more than ten images.
const MAX_BODY: usize = 64 << 20;

/// An HTTP request.
pub struct Request {
    /// Path with its query.
    pub path: String,
    headers: Vec<(String, String)>,
    /// Request body.
    pub body: Vec<u8>,
}

impl Request {
    fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(n, _)| n == name).map(|(_, v)| v.as_str())
    }

    /// Returns the API key of the request.
    pub fn key(&self) -> Option<&str> {
        let bearer = self.header("authorization").and_then(|v| v.strip_prefix("Bearer "));
        bearer.or_else(|| self.header("api-key"))
    }
}

fn invalid(problem: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, problem)
}

/// Reads the next request; `None` if the client closed the connection.
pub fn read_request(stream: &mut TcpStream) -> io::Result<Option<Request>> {
    let mut bytes = Vec::new();
    let mut chunk = [0; 8192];
    loop {
        if let Some((mut request, head)) = parse(&bytes)? {
            let length = request.header("content-length").map_or(Ok(0), str::parse);
            let length: usize = length.map_err(|_| invalid("content-length is not a number"))?;
            if length > MAX_BODY {
                return Err(invalid("the body is too long"));
            }
            request.body = bytes.split_off(head);
            while request.body.len() < length {
                let n = stream.read(&mut chunk)?;
                if n == 0 {
                    return Ok(None);
                }
                request.body.extend_from_slice(&chunk[..n]);
            }
            return Ok(Some(request));
        }
        if bytes.len() > MAX_HEAD {
            return Err(invalid("the head is too long"));
        }
        let n = stream.read(&mut chunk)?;
        if n == 0 {
            return Ok(None);
        }
        bytes.extend_from_slice(&chunk[..n]);
    }
}

/// Parses a request head; returns it with its length in bytes, or `None` if it is incomplete.
fn parse(bytes: &[u8]) -> io::Result<Option<(Request, usize)>> {
    let mut headers = [httparse::EMPTY_HEADER; 64];
    let mut head = httparse::Request::new(&mut headers);
    match head.parse(bytes).map_err(|_| invalid("not HTTP"))? {
        httparse::Status::Partial => Ok(None),
        httparse::Status::Complete(end) => {
            let text = |v: &[u8]| String::from_utf8_lossy(v).into_owned();
            let headers =
                head.headers.iter().map(|h| (h.name.to_ascii_lowercase(), text(h.value))).collect();
            let path = head.path.unwrap_or_default().to_owned();
            Ok(Some((Request { path, headers, body: Vec::new() }, end)))
        }
    }
}

/// Writes a response; the connection stays open.
pub fn write_response(
    stream: &mut TcpStream,
    status: u16,
    headers: &[(&str, &str)],
    body: &[u8],
) -> io::Result<bool> {
    stream.write_all(head(status, headers, body.len()).as_bytes())?;
    stream.write_all(body)?;
    stream.flush()?;
    Ok(true)
}

/// Returns the head of a response.
pub fn head(status: u16, headers: &[(&str, &str)], length: usize) -> String {
    let reason = match status {
        200 => "OK",
        307 => "Temporary Redirect",
        400 => "Bad Request",
        401 => "Unauthorized",
        404 => "Not Found",
        429 => "Too Many Requests",
        500 => "Internal Server Error",
        503 => "Service Unavailable",
        _ => "Status",
    };
    let more: String = headers.iter().map(|(n, v)| format!("{n}: {v}\r\n")).collect();
    format!(
        "HTTP/1.1 {status} {reason}\r\ncontent-type: application/json\r\n\
         content-length: {length}\r\n{more}\r\n"
    )
}
