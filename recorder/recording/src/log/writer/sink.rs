//! The sink of a recording: passes on complete chunks only, and does not copy the particles in them.

use std::io::{self, IoSlice, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::log::encoding::ParticleBuffer;

/// The part of a [`ChunkSink`] that the writer of a recording sees.
#[derive(Debug, Default)]
pub(super) struct SinkState {
    /// The message that is being written.
    offered: Option<Arc<ParticleBuffer>>,
    /// The buffers of written messages.
    spare: Vec<ParticleBuffer>,
    /// Size of the file with the open chunk.
    size_bytes: u64,
    /// An attachment is written, which may be larger than the memory.
    is_attaching: bool,
}

/// A handle on the state of a [`ChunkSink`].
#[derive(Debug, Clone, Default)]
pub(super) struct SinkHandle(Arc<Mutex<SinkState>>);

impl SinkHandle {
    /// Writes the message of a buffer with `write`. If its bytes reach the sink as they are, the sink keeps
    /// the buffer instead of a copy of them.
    pub(super) fn write_message<T>(
        &self,
        buffer: ParticleBuffer,
        write: impl FnOnce(&[u8]) -> T,
    ) -> T {
        let buffer = Arc::new(buffer);
        self.lock().offered = Some(Arc::clone(&buffer));
        let result = write(buffer.message());
        let mut state = self.lock();
        state.offered = None;
        state.add_spare(buffer);
        result
    }

    /// Lets bytes pass as they come, up to [`SinkHandle::end_attachment`].
    pub(super) fn begin_attachment(&self) {
        self.lock().is_attaching = true;
    }

    pub(super) fn end_attachment(&self) {
        self.lock().is_attaching = false;
    }

    /// Returns a buffer whose message is written.
    pub(super) fn take_spare(&self) -> Option<ParticleBuffer> {
        self.lock().spare.pop()
    }

    /// Returns the size of the file with its open chunk, in bytes.
    pub(super) fn size_bytes(&self) -> u64 {
        self.lock().size_bytes
    }

    /// Locks the state. A panic cannot leave it inconsistent.
    fn lock(&self) -> MutexGuard<'_, SinkState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl SinkState {
    /// Keeps a buffer, unless it is part of a chunk.
    fn add_spare(&mut self, buffer: Arc<ParticleBuffer>) {
        self.spare.extend(Arc::into_inner(buffer));
    }
}

/// Bytes of a chunk.
#[derive(Debug)]
enum ChunkBytes {
    Bytes(Vec<u8>),
    Message(Arc<ParticleBuffer>),
}

impl ChunkBytes {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Bytes(bytes) => bytes,
            Self::Message(buffer) => buffer.message(),
        }
    }
}

/// Keeps the bytes of a chunk until it is complete: mcap then goes back to complete its header, and from there
/// to the end. So the output has whole chunks only, and every reader understands it.
#[derive(Debug)]
pub(super) struct ChunkSink<W> {
    out: W,
    state: SinkHandle,
    /// The bytes after those in the output.
    parts: Vec<ChunkBytes>,
    /// Position in the file of the first part.
    begin: u64,
    /// Place within the first part to write to; `None` at the end.
    place: Option<usize>,
}

impl<W: Write> ChunkSink<W> {
    pub(super) fn new(out: W) -> Self {
        let state = SinkHandle::default();
        Self { out, state, parts: Vec::new(), begin: 0, place: None }
    }

    pub(super) fn handle(&self) -> SinkHandle {
        self.state.clone()
    }

    /// Returns the output. The bytes of an incomplete chunk are dropped.
    pub(super) fn into_inner(self) -> W {
        self.out
    }

    /// Passes everything to the output.
    fn pass_on(&mut self) -> io::Result<()> {
        let mut slices: Vec<_> = self.parts.iter().map(|part| IoSlice::new(part.bytes())).collect();
        let mut left = slices.as_mut_slice();
        // An empty slice at the start would look like a full disk.
        IoSlice::advance_slices(&mut left, 0);
        while !left.is_empty() {
            match self.out.write_vectored(left) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(count) => {
                    self.begin += count as u64;
                    IoSlice::advance_slices(&mut left, count);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        let mut state = self.state.lock();
        for part in self.parts.drain(..) {
            if let ChunkBytes::Message(buffer) = part {
                state.add_spare(buffer);
            }
        }
        Ok(())
    }

    fn append(&mut self, bytes: &[u8]) {
        let mut state = self.state.lock();
        state.size_bytes += bytes.len() as u64;
        if let Some(buffer) = state.offered.take_if(|buffer| std::ptr::eq(buffer.message(), bytes))
        {
            self.parts.push(ChunkBytes::Message(buffer));
        } else if let Some(ChunkBytes::Bytes(last)) = self.parts.last_mut() {
            last.extend_from_slice(bytes);
        } else {
            self.parts.push(ChunkBytes::Bytes(bytes.to_vec()));
        }
    }

    fn end(&self) -> u64 {
        let size_bytes: usize = self.parts.iter().map(|part| part.bytes().len()).sum();
        self.begin + size_bytes as u64
    }
}

impl<W: Write> Write for ChunkSink<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match (&mut self.place, self.parts.first_mut()) {
            (Some(place), Some(ChunkBytes::Bytes(first))) => {
                let target = first.get_mut(*place..*place + bytes.len());
                target.ok_or(io::ErrorKind::InvalidInput)?.copy_from_slice(bytes);
                *place += bytes.len();
            }
            _ => self.append(bytes),
        }
        if self.state.lock().is_attaching && self.place.is_none() {
            self.pass_on()?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.pass_on()?;
        self.out.flush()
    }
}

impl<W: Write> Seek for ChunkSink<W> {
    /// Goes to a byte of the first part, which has the header of the chunk, or to the end of the complete chunk.
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match to {
            SeekFrom::Start(position) => {
                let place = position.checked_sub(self.begin).ok_or(io::ErrorKind::InvalidInput)?;
                self.place = usize::try_from(place).ok();
                Ok(position)
            }
            SeekFrom::End(0) => {
                self.place = None;
                self.pass_on()?;
                Ok(self.begin)
            }
            _ => Err(io::ErrorKind::Unsupported.into()),
        }
    }

    fn stream_position(&mut self) -> io::Result<u64> {
        Ok(self.place.map_or_else(|| self.end(), |place| self.begin + place as u64))
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::collections::BTreeMap;
    use std::io::Cursor;
    use std::rc::Rc;

    use mcap::records::{MessageHeader, Metadata};
    use mcap::{Compression, WriteOptions, Writer};
    use sim_messages::ParticleState;

    use super::*;

    /// Accepts a few bytes at a time.
    #[derive(Default)]
    struct SlowOutput(Vec<u8>);

    impl Write for SlowOutput {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let count = bytes.len().min(1000);
            self.0.extend_from_slice(&bytes[..count]);
            Ok(count)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn buffer(count: u32) -> ParticleBuffer {
        let state = |flags| ParticleState { flags, ..ParticleState::default() };
        let mut buffer = ParticleBuffer::from((0..count).map(state).collect::<Vec<_>>().as_slice());
        buffer.encode_head(count.into());
        buffer
    }

    fn write_all<W: Write + Seek>(
        out: W,
        compression: Option<Compression>,
        mut write: impl FnMut(&mut Writer<W>, &MessageHeader, ParticleBuffer),
    ) -> W {
        let options = WriteOptions::new().compression(compression).chunk_size(Some(50_000));
        let mut file = options.compression_threads(0).create(out).unwrap();
        let channel_id = file.add_channel(0, "/particles", "protobuf", &BTreeMap::new()).unwrap();
        for step in 0..20 {
            let header = MessageHeader { channel_id, sequence: step, log_time: 1, publish_time: 2 };
            write(&mut file, &header, buffer(step * 100));
            if step % 7 == 0 {
                let name = step.to_string();
                file.write_metadata(&Metadata { name, metadata: BTreeMap::new() }).unwrap();
            }
        }
        file.finish().unwrap();
        file.into_inner()
    }

    #[test]
    fn a_file_equals_one_whose_writer_goes_back_in_it() {
        for compression in [None, Some(Compression::Lz4), Some(Compression::Zstd)] {
            let expected = write_all(Cursor::new(Vec::new()), compression, |file, header, one| {
                file.write_to_known_channel(header, one.message()).unwrap();
            });
            let sink = ChunkSink::new(SlowOutput::default());
            let handle = sink.handle();
            let mut kept_count = 0;
            let sink = write_all(sink, compression, |file, header, one| {
                handle
                    .write_message(one, |message| file.write_to_known_channel(header, message))
                    .unwrap();
                kept_count += usize::from(handle.take_spare().is_none());
            });
            assert_eq!(kept_count > 0, compression.is_none(), "only a chunk without compression");
            assert_eq!(handle.size_bytes(), expected.get_ref().len() as u64);
            assert!(sink.into_inner().0 == *expected.get_ref());
        }
    }

    /// Counts the bytes that it accepts, and drops them.
    #[derive(Clone, Default)]
    struct CountingOutput(Rc<Cell<u64>>);

    impl Write for CountingOutput {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.set(self.0.get() + bytes.len() as u64);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn the_output_has_no_part_of_an_open_chunk_but_the_size_does() {
        let output = CountingOutput::default();
        let accepted = Rc::clone(&output.0);
        let sink = ChunkSink::new(output);
        let handle = sink.handle();
        let (mut accepted_sizes, mut messages_size) = (Vec::new(), 0);
        write_all(sink, None, |file, header, one| {
            messages_size += one.message().len() as u64;
            handle
                .write_message(one, |message| file.write_to_known_channel(header, message))
                .unwrap();
            accepted_sizes.push(accepted.get());
            assert!(handle.size_bytes() > messages_size.max(accepted.get()));
            if header.sequence % 5 == 4 {
                file.flush().unwrap();
                assert!(accepted.get() > *accepted_sizes.last().unwrap(), "the chunk was open");
                assert_eq!(handle.size_bytes(), accepted.get());
            }
        });
        accepted_sizes.dedup();
        // 20 messages in chunks of 50,000 bytes, ended by four flushes and three metadata.
        assert!(accepted_sizes.len() < 16, "{accepted_sizes:?}");
    }

    #[test]
    fn written_buffers_return_with_their_chunk() {
        let mut sink = ChunkSink::new(Vec::new());
        let handle = sink.handle();
        for _ in 0..3 {
            let written = handle.write_message(buffer(10), |message| sink.write(message));
            assert_eq!(written.unwrap(), buffer(10).message().len());
            assert_eq!((handle.take_spare(), sink.out.len()), (None, 0));
        }
        sink.flush().unwrap();
        assert_eq!(std::iter::from_fn(|| handle.take_spare()).count(), 3);
        assert_eq!(sink.into_inner(), [buffer(10).message(); 3].concat());
    }
}
