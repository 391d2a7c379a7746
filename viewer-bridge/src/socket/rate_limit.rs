//! Limits on the rate of messages, and on the rate at which a connection is read.
//!
//! A client can send any number of frames that complete no message, and the library shows only
//! messages. Therefore the bytes are limited below it, where every frame costs at least a few.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use sim_host::clock::{SECOND_NS, monotonic_ns};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Sleep, sleep};

use crate::limits::{BYTES_BURST_MAX, BYTES_PER_SECOND_MAX};

/// A burst, then a steady rate (token bucket).
#[derive(Debug, Clone, Copy)]
pub(super) struct Rate {
    pub(super) per_second: u32,
    pub(super) burst: u32,
}

/// Counts what one client sends.
#[derive(Debug)]
pub(super) struct RateLimit {
    rate: Rate,
    /// Amount that the client can send now. Negative after more than that.
    allowance: f64,
    last_ns: u64,
}

impl RateLimit {
    pub(super) fn new(rate: Rate, now_ns: u64) -> Self {
        Self { rate, allowance: f64::from(rate.burst), last_ns: now_ns }
    }

    /// Counts an amount. Returns the time until the client is within the limit again: 0 if it is now.
    pub(super) fn count(&mut self, amount: usize, now_ns: u64) -> Duration {
        let per_second = f64::from(self.rate.per_second);
        let elapsed_s = now_ns.saturating_sub(self.last_ns) as f64 / SECOND_NS as f64;
        self.last_ns = now_ns;
        self.allowance = (self.allowance + elapsed_s * per_second).min(f64::from(self.rate.burst));
        self.allowance -= amount as f64;
        Duration::from_secs_f64((-self.allowance).max(0.0) / per_second)
    }
}

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

    const RATE: Rate = Rate { per_second: 240, burst: 480 };

    #[test]
    fn a_burst_passes_and_then_the_steady_rate() {
        let mut limit = RateLimit::new(RATE, 0);
        assert!((0..RATE.burst).all(|_| limit.count(1, 0).is_zero()));
        assert!(!limit.count(1, 0).is_zero());
        let mut limit = RateLimit::new(RATE, 0);
        let period_ns = SECOND_NS / u64::from(RATE.per_second) + 1;
        assert!((1..5000).all(|number| limit.count(1, number * period_ns).is_zero()));
    }

    #[test]
    fn the_wait_is_as_long_as_the_rate_takes_for_the_excess() {
        let mut limit = RateLimit::new(RATE, 0);
        assert_eq!(limit.count(960, 0), Duration::from_secs(2));
        assert_eq!(limit.count(0, SECOND_NS), Duration::from_secs(1));
        assert_eq!(limit.count(0, 2 * SECOND_NS), Duration::ZERO);
    }

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
