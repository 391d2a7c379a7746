//! PC2, a cache of vertex positions, and the mesh that it moves: Blender's Mesh Cache reads both.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::faces::Faces;
use super::obj;
use super::written_files::{WrittenFiles, is_stdout};
use crate::export::snapshots::Snapshots;

const MAGIC: &[u8; 12] = b"POINTCACHE2\0";
const VERSION: i32 = 1;
/// The number of the first frame in the animation, and the frames of the animation from one to the next.
const FIRST_FRAME: f32 = 0.0;
const FRAMES_PER_SAMPLE: f32 = 1.0;

/// Writes the cache, and the mesh of the first snapshot beside it. Both have the particles in their order.
pub(crate) fn write(
    snapshots: &Snapshots<'_>,
    path: &Path,
    files: &mut WrittenFiles,
) -> anyhow::Result<()> {
    let mesh_path = mesh_path(path)?;
    files.existing().check(&mesh_path)?;
    files.add_streamed(path, |out| write_cache(snapshots, out))?;
    files.add_whole(&mesh_path, obj::mesh(&snapshots.first()?, &Faces::of(snapshots)?)?.as_bytes())
}

/// Returns the path of the mesh: that of the cache with the extension `obj`.
fn mesh_path(path: &Path) -> anyhow::Result<PathBuf> {
    let mesh_path = path.with_extension("obj");
    if mesh_path == path {
        bail!("{}: the mesh gets this name; name the cache FILE.pc2", path.display());
    }
    if is_stdout(path) {
        bail!(
            "a cache and its mesh are two files, which stdout cannot take; name the cache FILE.pc2"
        );
    }
    Ok(mesh_path)
}

fn write_cache(snapshots: &Snapshots<'_>, out: &mut dyn Write) -> anyhow::Result<()> {
    let count = |count: usize| i32::try_from(count).context("the format counts up to 2^31 - 1");
    out.write_all(MAGIC)?;
    out.write_all(&VERSION.to_le_bytes())?;
    out.write_all(&count(snapshots.particle_count)?.to_le_bytes())?;
    out.write_all(&FIRST_FRAME.to_le_bytes())?;
    out.write_all(&FRAMES_PER_SAMPLE.to_le_bytes())?;
    out.write_all(&count(snapshots.frame_numbers().len())?.to_le_bytes())?;
    snapshots.for_each_frame(|frame| {
        for particle in &frame.state.particles {
            out.write_all(bytemuck::bytes_of(&particle.position))?;
        }
        Ok(())
    })
}
