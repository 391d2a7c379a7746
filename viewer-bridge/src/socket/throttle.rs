//! Limits the rate at which a connection is read.
//!
//! A client can send any number of frames that complete no message, and the library shows only
//! messages. Therefore the bytes are limited below it, where every frame costs at least a few.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use sim_contract::clock::monotonic_ns;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Sleep, sleep};

use super::rate_limit::{Rate, RateLimit};
use crate::limits::{BYTES_BURST_MAX, BYTES_PER_SECOND_MAX};

/// Limit on every connection.
pub(super) const BYTES: Rate = Rate { per_second: BYTES_PER_SECOND_MAX, burst: BYTES_BURST_MAX };

/// A connection that is read at a limited rate. The client's network waits for the rest.
#[derive(Debug)]
pub(super) struct Throttled {
    stream: TcpStream,
    rate: RateLimit,
    /// The wait after the limit was exceeded.
    pause: Option<Pin<Box<Sleep>>>,
}

impl Throttled {
    pub(super) fn new(stream: TcpStream, rate: Rate) -> Self {
        Self { stream, rate: RateLimit::new(rate, monotonic_ns()), pause: None }
    }
}

impl AsyncRead for Throttled {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let this = &mut *self;
        if let Some(pause) = &mut this.pause {
            ready!(pause.as_mut().poll(context));
            this.pause = None;
        }
        let before = buffer.filled().len();
        ready!(Pin::new(&mut this.stream).poll_read(context, buffer))?;
        let count = buffer.filled().len() - before;
        let wait = this.rate.count(count, monotonic_ns());
        this.pause = (!wait.is_zero()).then(|| Box::pin(sleep(wait)));
        Poll::Ready(Ok(()))
    }
}

impl AsyncWrite for Throttled {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        slices: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write_vectored(context, slices)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }
}

#[cfg(test)]
mod tests {
    use futures_util::FutureExt;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio::net::TcpListener;

    use super::*;

    #[tokio::test]
    async fn a_connection_over_the_limit_is_not_read_although_bytes_have_arrived() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let mut client = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
        let (stream, _) = listener.accept().await.unwrap();
        // The excess of 500 bytes takes 500 s.
        let mut server = Throttled::new(stream, Rate { per_second: 1, burst: 1000 });
        client.write_all(&[0; 2000]).await.unwrap();
        let mut bytes = [0; 500];
        for _ in 0..3 {
            server.read_exact(&mut bytes).await.unwrap();
        }
        assert_eq!(server.stream.peek(&mut bytes).await.unwrap(), 500);
        assert!(server.read(&mut bytes).now_or_never().is_none());
    }
}
