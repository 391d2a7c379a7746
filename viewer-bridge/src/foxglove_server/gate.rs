//! The door in front of the Foxglove server.
//!
//! The library takes any connection, from any web page, and messages of any size and number. So it
//! listens at an address of the loopback network that no web page can know, and the public
//! address is this door's: it reads the head of the request, refuses hosts and origins that have no
//! business here, and then passes bytes on in both directions, counting what clients send.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use axum::http::{HeaderMap, HeaderName, HeaderValue};
use sim_contract::clock::monotonic_ns;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::tcp::OwnedReadHalf;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

use super::client_frames::ClientFrames;
use crate::limits::{ACCEPT_PAUSE, CLIENTS_MAX, HELLO_TIMEOUT, SILENCE_MAX};
use crate::socket::guard::{Admission, Guard};

/// Longest head of a request; those of browsers have about 1 KiB.
const HEAD_SIZE_BYTES_MAX: usize = 8 << 10;
/// Most bytes that are passed on at a time.
const PASS_SIZE_BYTES: usize = 64 << 10;

/// The public address.
#[derive(Debug)]
pub(super) struct Gate {
    pub(super) listener: TcpListener,
    pub(super) guard: Guard,
    /// Where the library listens.
    pub(super) inner: SocketAddr,
}

impl Gate {
    /// Lets clients in as long as it is polled.
    #[allow(clippy::infinite_loop, reason = "the type that says so is no async result yet")]
    pub(super) async fn run(self) {
        let Self { listener, guard, inner } = self;
        let (guard, places) = (Arc::new(guard), Arc::new(Semaphore::new(CLIENTS_MAX)));
        loop {
            let Ok((stream, _)) = listener.accept().await else {
                // A connection that broke before it was taken, or no file handle is left.
                sleep(ACCEPT_PAUSE).await;
                continue;
            };
            let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
                // Dropping it closes it: an answer would need a task for everyone who knocks.
                continue;
            };
            let guard = Arc::clone(&guard);
            tokio::spawn(async move {
                // Whoever breaks off in the middle is gone; nobody is left to be told.
                let _ended = converse(stream, &guard, inner).await;
                drop(place);
            });
        }
    }
}

/// Serves one connection.
async fn converse(mut stream: TcpStream, guard: &Guard, inner: SocketAddr) -> io::Result<()> {
    let head = timeout(HELLO_TIMEOUT, read_head(&mut stream)).await??;
    if let Err(why) = admit(&head, guard) {
        return refuse(&mut stream, why).await;
    }
    let mut server = TcpStream::connect(inner).await?;
    server.set_nodelay(true)?;
    stream.set_nodelay(true)?;
    server.write_all(&head).await?;
    let (from_client, to_client) = stream.into_split();
    let (from_server, to_server) = server.into_split();
    tokio::select! {
        ended = pass_checked(from_client, to_server) => ended,
        ended = pass(from_server, to_client) => ended,
    }
}

/// Reads up to the empty line that ends the head. A client sends nothing behind it before it is
/// answered.
async fn read_head(stream: &mut TcpStream) -> io::Result<Vec<u8>> {
    let mut head = Vec::with_capacity(1 << 10);
    while !head.ends_with(b"\r\n\r\n") {
        if head.len() >= HEAD_SIZE_BYTES_MAX {
            return Err(io::ErrorKind::InvalidData.into());
        }
        if stream.read_buf(&mut head).await? == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
    }
    Ok(head)
}

/// Whether a request may pass. `Err`: what to answer.
fn admit(head: &[u8], guard: &Guard) -> Result<(), String> {
    let headers = headers(head).ok_or_else(|| "this is no request\n".to_owned())?;
    match guard.admission(&headers) {
        Admission::Granted => Ok(()),
        Admission::ForeignHost => Err("this host is not allowed here\n".to_owned()),
        Admission::ForeignOrigin => {
            let origin = headers.get("origin").and_then(|one| one.to_str().ok()).unwrap_or("?");
            Err(format!("the origin {origin} is not allowed here; see --foxglove-origin\n"))
        }
    }
}

/// The headers of a request that is a plain GET.
fn headers(head: &[u8]) -> Option<HeaderMap> {
    let text = std::str::from_utf8(head).ok()?.strip_suffix("\r\n\r\n")?;
    let mut lines = text.split("\r\n");
    let request = lines.next()?;
    if !(request.starts_with("GET /") && request.ends_with(" HTTP/1.1")) {
        return None;
    }
    let mut headers = HeaderMap::new();
    for line in lines {
        let (name, value) = line.split_once(':')?;
        let name = HeaderName::from_bytes(name.as_bytes()).ok()?;
        headers.append(name, HeaderValue::from_str(value.trim_matches([' ', '\t'])).ok()?);
    }
    Some(headers)
}

async fn refuse(stream: &mut TcpStream, why: String) -> io::Result<()> {
    let head = format!(
        "HTTP/1.1 403 Forbidden\r\ncontent-type: text/plain; charset=utf-8\r\n\
         content-length: {}\r\nconnection: close\r\n\r\n",
        why.len()
    );
    stream.write_all(head.as_bytes()).await?;
    stream.write_all(why.as_bytes()).await?;
    stream.shutdown().await
}

/// Passes on what a client sends, until it breaks the rules.
async fn pass_checked(mut from: OwnedReadHalf, mut to: impl AsyncWrite + Unpin) -> io::Result<()> {
    let mut frames = ClientFrames::new(monotonic_ns());
    let mut bytes = vec![0; PASS_SIZE_BYTES];
    loop {
        let count = from.read(&mut bytes).await?;
        if count == 0 {
            return Ok(());
        }
        if !frames.allow(&bytes[..count], monotonic_ns()) {
            return Err(io::ErrorKind::InvalidData.into());
        }
        timeout(SILENCE_MAX, to.write_all(&bytes[..count])).await??;
    }
}

/// Passes on what the server sends. A client that takes nothing of it for so long is given up, as a
/// page is: what it holds would never be let go.
async fn pass(mut from: impl AsyncRead + Unpin, mut to: impl AsyncWrite + Unpin) -> io::Result<()> {
    let mut bytes = vec![0; PASS_SIZE_BYTES];
    loop {
        let count = from.read(&mut bytes).await?;
        if count == 0 {
            return Ok(());
        }
        timeout(SILENCE_MAX, to.write_all(&bytes[..count])).await??;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard() -> Guard {
        let address = "127.0.0.1:8765".parse().unwrap();
        Guard::for_origins(address, vec!["https://viewer.example".to_owned()])
    }

    fn request(host: &str, origin: Option<&str>) -> Vec<u8> {
        let origin = origin.map(|origin| format!("Origin: {origin}\r\n")).unwrap_or_default();
        format!("GET / HTTP/1.1\r\nHost: {host}\r\n{origin}Upgrade: websocket\r\n\r\n").into_bytes()
    }

    #[test]
    fn programs_and_named_origins_are_let_in() {
        assert_eq!(admit(&request("127.0.0.1:8765", None), &guard()), Ok(()));
        assert_eq!(admit(&request("localhost:8765", None), &guard()), Ok(()));
        let origin = Some("https://viewer.example");
        assert_eq!(admit(&request("localhost:8765", origin), &guard()), Ok(()));
    }

    #[test]
    fn other_pages_and_other_hosts_are_refused_with_the_reason() {
        for origin in
            ["null", "http://evil.example", "http://127.0.0.1:8765", "http://viewer.example"]
        {
            let error = admit(&request("127.0.0.1:8765", Some(origin)), &guard()).unwrap_err();
            assert!(error.contains(origin) && error.contains("--foxglove-origin"), "{error}");
        }
        for host in ["evil.example:8765", "127.0.0.1", "127.0.0.1:80", ""] {
            assert!(admit(&request(host, None), &guard()).is_err(), "{host}");
        }
    }

    #[test]
    fn what_is_no_request_for_a_socket_is_refused() {
        for head in [
            "POST / HTTP/1.1\r\nHost: localhost:8765\r\n\r\n",
            "GET / HTTP/1.0\r\nHost: localhost:8765\r\n\r\n",
            "GET / HTTP/1.1\r\n\r\n",
            "GET / HTTP/1.1\r\nHost\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: localhost:8765\r\nHost: localhost:8765\r\n\r\n",
            "\r\n\r\n",
        ] {
            assert!(admit(head.as_bytes(), &guard()).is_err(), "{head}");
        }
    }
}
