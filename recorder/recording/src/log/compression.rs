//! The compressions of chunks: read and written by C libraries, or, without the feature `zstd`, only read, in Rust.

use std::io::{self, Read};

use mcap::WriteOptions;
use mcap::records::ChunkHeader;

/// Compression of the chunks of a file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Compression {
    /// No compression: 0.2 ms per 10,000 particles. The only one without the feature `zstd`.
    #[cfg_attr(not(feature = "zstd"), default)]
    None,
    /// LZ4: 0.9 ms per 10,000 particles.
    #[cfg(feature = "zstd")]
    Lz4,
    /// Zstandard level 1: 1.4 ms per 10,000 particles.
    #[cfg(feature = "zstd")]
    #[default]
    Zstd,
    /// Zstandard level 19: about 100 ms per 10,000 particles.
    #[cfg(feature = "zstd")]
    ZstdSmallest,
}

impl Compression {
    /// Returns the compression for a copy of a file, from the name in the chunks of that file.
    pub(super) fn as_in_chunks(name: Option<&str>) -> Self {
        match name {
            Some("") => Self::None,
            #[cfg(feature = "zstd")]
            Some("lz4") => Self::Lz4,
            _ => Self::default(),
        }
    }

    pub(super) fn add_to(self, options: WriteOptions) -> WriteOptions {
        // The cores belong to the solver.
        #[cfg(feature = "zstd")]
        let options = options.compression_threads(0);
        match self {
            Self::None => options.compression(None),
            #[cfg(feature = "zstd")]
            Self::Lz4 => options.compression(Some(mcap::Compression::Lz4)),
            #[cfg(feature = "zstd")]
            Self::Zstd => options.compression(Some(mcap::Compression::Zstd)).compression_level(1),
            #[cfg(feature = "zstd")]
            Self::ZstdSmallest => {
                options.compression(Some(mcap::Compression::Zstd)).compression_level(19)
            }
        }
    }
}

/// Decompresses the data of a chunk into an empty buffer, up to the size that the header claims. Keeps memory for the
/// next chunk.
pub(super) type Decompress =
    Box<dyn FnMut(&ChunkHeader, &[u8], &mut Vec<u8>) -> io::Result<()> + Send>;

#[cfg(feature = "zstd")]
pub(super) fn decompressor() -> Decompress {
    let mut zstd = None;
    Box::new(move |header, data, content| {
        if header.compression == "lz4" {
            return read_lz4(header, lz4::Decoder::new(data)?, content);
        }
        let zstd = match &mut zstd {
            Some(zstd) => zstd,
            none => none.insert(zstd::bulk::Decompressor::new()?),
        };
        content.reserve_exact(content_size(header));
        zstd.decompress_to_buffer(data, content).map(drop)
    })
}

#[cfg(not(feature = "zstd"))]
pub(super) use rust_decompressor as decompressor;

#[cfg(any(test, not(feature = "zstd")))]
pub(super) fn rust_decompressor() -> Decompress {
    let mut zstd = ruzstd::decoding::FrameDecoder::new();
    Box::new(move |header, data, content| {
        if header.compression == "lz4" {
            return read_lz4(header, lz4_flex::frame::FrameDecoder::new(data), content);
        }
        content.reserve_exact(content_size(header));
        zstd.decode_all_to_vec(data, content).map_err(io::Error::other)
    })
}

fn read_lz4(header: &ChunkHeader, data: impl Read, content: &mut Vec<u8>) -> io::Result<()> {
    data.take(header.uncompressed_size + 1).read_to_end(content).map(drop)
}

/// Returns the size that a header claims, which is within the limits of the scene.
fn content_size(header: &ChunkHeader) -> usize {
    usize::try_from(header.uncompressed_size).unwrap_or(usize::MAX)
}
