//! A line to a page with a limit on its bytes per second.

use std::io::{self, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::thread;
use std::time::Duration;

/// Parts per second in which bytes pass.
const PARTS_PER_S: u32 = 20;

/// Starts a line to a server. Returns the address at which pages reach it, until the process ends.
pub(super) fn start(server: String, bytes_per_s: u32) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = listener.local_addr().expect("its address");
    thread::spawn(move || {
        for page in listener.incoming().flatten() {
            let server = TcpStream::connect(&server).expect("a server that listens");
            let (page_reader, server_writer) = (clone(&page), clone(&server));
            thread::spawn(move || pass(page_reader, server_writer, None));
            thread::spawn(move || pass(server, page, Some(bytes_per_s / PARTS_PER_S)));
        }
    });
    address
}

fn clone(stream: &TcpStream) -> TcpStream {
    stream.try_clone().expect("another handle")
}

/// Passes bytes on until one of the ends closes. With a limit, passes at most that number of bytes in a part.
fn pass(mut from: TcpStream, mut to: TcpStream, part_bytes: Option<u32>) {
    let mut buffer = vec![0; part_bytes.map_or(1 << 16, |bytes| bytes as usize)];
    let passed: io::Result<()> = loop {
        match from.read(&mut buffer) {
            Ok(0) => break Ok(()),
            Ok(count) => {
                if let Err(error) = to.write_all(&buffer[..count]) {
                    break Err(error);
                }
                if part_bytes.is_some() {
                    thread::sleep(Duration::from_secs(1) / PARTS_PER_S);
                }
            }
            Err(error) => break Err(error),
        }
    };
    // The other end may be gone already.
    drop(passed);
    _ = to.shutdown(Shutdown::Write);
}
