//! OBJ: a mesh per snapshot, and caches of positions for Blender (PC2) beside one mesh.

use std::fmt::{self, Write};
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use recording::SceneState;

use super::files::{FrameNames, WrittenFiles, is_stdout};
use super::shapes::{Colliders, Face, Faces, Solid};
use super::snapshots::{Frame, Snapshots};

/// Writes a file per frame into `folder`.
pub(crate) fn write(
    snapshots: &Snapshots<'_>,
    folder: &Path,
    files: &mut WrittenFiles,
) -> anyhow::Result<()> {
    let names = FrameNames::new(folder, &snapshots.run.scene_name, "obj");
    names.prepare(&snapshots.frame_numbers(), files.existing())?;
    names.remove_older(files.existing())?;
    let (faces, colliders) = (Faces::of(snapshots)?, Colliders::of(snapshots)?);
    snapshots.for_each_frame(|frame| {
        let mut text = title(frame, snapshots.frames_per_s.is_some());
        write_mesh(&mut text, frame.state, &faces)?;
        if let Some(colliders) = &colliders {
            write_colliders(&mut text, frame.state, colliders)?;
        }
        files.add_whole(&names.path(frame.number), text.as_bytes())
    })
}

/// Returns the comment that says which moment a file shows.
fn title(frame: &Frame<'_>, is_grid: bool) -> String {
    let Frame { number, time_s, is_interpolated, state } = frame;
    let step = state.row.step;
    match (is_grid, is_interpolated) {
        (false, _) => format!("# step {step}\n"),
        (true, false) => format!("# frame {number} at {time_s:.6} s: step {step}\n"),
        (true, true) => {
            format!("# frame {number} at {time_s:.6} s: interpolated between snapshots\n")
        }
    }
}

/// Returns the file of a state without colliders.
pub(super) fn mesh(state: &SceneState, faces: &Faces) -> Result<String, fmt::Error> {
    let mut text = format!("# step {}\n", state.row.step);
    write_mesh(&mut text, state, faces)?;
    Ok(text)
}

/// Writes the particles and the intact faces. A scene without faces has a line for each untorn constraint.
/// Indices count from 1.
fn write_mesh(text: &mut String, state: &SceneState, faces: &Faces) -> fmt::Result {
    for particle in state.particles.iter() {
        let [x, y, z] = particle.position;
        writeln!(text, "v {x:?} {y:?} {z:?}")?;
    }
    for [u, v] in &faces.uvs {
        writeln!(text, "vt {u:?} {v:?}")?;
    }
    let (mut group, mut material) = (None, None);
    for index in faces.intact(state) {
        let face = &faces.all[index as usize];
        if face.group != group {
            let name = face.group.map_or("", |group| &faces.groups[group as usize]);
            writeln!(text, "{}", format!("g {name}").trim_end())?;
            group = face.group;
        }
        if face.material != material {
            let name = face.material.map_or("none", |one| &faces.materials[one as usize]);
            writeln!(text, "usemtl {name}")?;
            material = face.material;
        }
        write_face(text, face)?;
    }
    if faces.all.is_empty() {
        for constraint in state.untorn_constraints() {
            writeln!(text, "l {} {}", constraint.a + 1, constraint.b + 1)?;
        }
    }
    Ok(())
}

fn write_face(text: &mut String, face: &Face) -> fmt::Result {
    text.push('f');
    for (place, corner) in face.corners.iter().enumerate() {
        match face.uvs.get(place) {
            Some(uv) => write!(text, " {}/{}", corner + 1, uv + 1)?,
            None => write!(text, " {}", corner + 1)?,
        }
    }
    writeln!(text)
}

/// Writes each collider as an object, a group and a material, because the ones before would go on.
fn write_colliders(text: &mut String, state: &SceneState, colliders: &Colliders) -> fmt::Result {
    let mut vertex_count = state.particles.len();
    for (index, Solid { vertices, faces }, pose) in colliders.solids(state) {
        let name = Colliders::name(index);
        writeln!(text, "o {name}\ng {name}\nusemtl collider")?;
        for vertex in &vertices {
            let [x, y, z] = pose.apply(*vertex).as_vec3().to_array();
            writeln!(text, "v {x:?} {y:?} {z:?}")?;
        }
        for face in &faces {
            let corners: Vec<_> = face
                .iter()
                .map(|corner| (vertex_count + *corner as usize + 1).to_string())
                .collect();
            writeln!(text, "f {}", corners.join(" "))?;
        }
        vertex_count += vertices.len();
    }
    Ok(())
}

const MAGIC: &[u8; 12] = b"POINTCACHE2\0";
const VERSION: i32 = 1;
/// The number of the first frame in the animation, and the frames of the animation from one to the next.
const FIRST_FRAME: f32 = 0.0;
const FRAMES_PER_SAMPLE: f32 = 1.0;

/// Writes the cache, and the mesh of the first snapshot beside it. Both have the particles in their order.
pub(crate) fn write_cache(
    snapshots: &Snapshots<'_>,
    path: &Path,
    files: &mut WrittenFiles,
) -> anyhow::Result<()> {
    let mesh_path = mesh_path(path)?;
    files.existing().check(&mesh_path)?;
    files.add_streamed(path, |out| write_positions(snapshots, out))?;
    files.add_whole(&mesh_path, mesh(&snapshots.first()?, &Faces::of(snapshots)?)?.as_bytes())
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

fn write_positions(snapshots: &Snapshots<'_>, out: &mut dyn io::Write) -> anyhow::Result<()> {
    let count = |count: usize| i32::try_from(count).context("the format counts up to 2^31 - 1");
    out.write_all(MAGIC)?;
    out.write_all(&VERSION.to_le_bytes())?;
    out.write_all(&count(snapshots.particle_count)?.to_le_bytes())?;
    out.write_all(&FIRST_FRAME.to_le_bytes())?;
    out.write_all(&FRAMES_PER_SAMPLE.to_le_bytes())?;
    out.write_all(&count(snapshots.frame_numbers().len())?.to_le_bytes())?;
    snapshots.for_each_frame(|frame| {
        for particle in frame.state.particles.iter() {
            out.write_all(bytemuck::bytes_of(&particle.position))?;
        }
        Ok(())
    })
}
