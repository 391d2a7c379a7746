//! VTK: a VTP file (PolyData) per snapshot, and a PVD file that gives their times.

use std::path::Path;

use recorder::SceneState;
use sim_contract::ParticleState;

use super::polydata::{NumberType, PolyData, PolyDataCounts};
use super::written_files::WrittenFiles;
use crate::export::frame_names::FrameNames;
use crate::export::snapshots::Snapshots;

/// Writes the files into `folder`.
pub(crate) fn write(
    snapshots: &Snapshots<'_>,
    folder: &Path,
    files: &mut WrittenFiles,
) -> anyhow::Result<()> {
    let names = FrameNames::new(folder, &snapshots.run.scene_name, "vtp");
    let collection = names.index_path("pvd");
    files.existing().check(&collection)?;
    names.prepare(snapshots.steps, files.existing())?;
    names.remove_older(files.existing())?;
    snapshots.for_each(|state| {
        let step = state.row.step;
        files.add_whole(&names.path(step), &polydata(state, snapshots.run_time_s(step)))
    })?;
    files.add_whole(&collection, pvd(snapshots, &names).as_bytes())
}

/// Returns the collection of all files. Names of files have no character that XML reserves.
fn pvd(snapshots: &Snapshots<'_>, names: &FrameNames<'_>) -> String {
    let entries = snapshots.steps.iter().map(|step| {
        let (time_s, name) = (snapshots.run_time_s(*step), names.name(*step));
        format!("<DataSet timestep=\"{time_s:?}\" file=\"{name}\"/>\n")
    });
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n<Collection>\n\
         {}</Collection>\n</VTKFile>\n",
        entries.collect::<String>()
    )
}

/// Returns the file of a state: a vertex for each particle that nothing connects, a line for each untorn
/// constraint, and a polygon for each intact triangle.
fn polydata(state: &SceneState, time_s: f64) -> Vec<u8> {
    let is_connected = state.connected();
    let vertices = (0_u32..).zip(&is_connected).filter(|(_, is_connected)| !**is_connected);
    let vertices: Vec<_> = vertices.map(|(particle, _)| [particle]).collect();
    let lines: Vec<_> = state.untorn_constraints().map(|one| [one.a, one.b]).collect();
    let triangles: Vec<_> = state.intact_triangles().map(|(_, corners)| corners).collect();
    // Cell data has the order of the cells: vertices, lines, polygons.
    let stretches: Vec<f32> = std::iter::repeat_n(f32::NAN, vertices.len())
        .chain(stretches(state))
        .chain(std::iter::repeat_n(f32::NAN, triangles.len()))
        .collect();

    let counts = PolyDataCounts {
        points: state.particles.len(),
        vertices: vertices.len(),
        lines: lines.len(),
        polygons: triangles.len(),
    };
    let mut file = PolyData::new(counts, time_s);
    file.begin("Points");
    file.add_array("positions", NumberType::Float32, 3, &column(state, |one| one.position));
    file.end("Points");
    file.begin("PointData");
    file.add_array("velocity", NumberType::Float32, 3, &column(state, |one| one.velocity));
    file.add_array("inverse_mass", NumberType::Float32, 1, &column(state, |one| one.inverse_mass));
    file.add_array("flags", NumberType::UInt32, 1, &column(state, |one| one.flags));
    file.end("PointData");
    file.begin("CellData");
    file.add_array("stretch", NumberType::Float32, 1, bytemuck::cast_slice(&stretches));
    file.end("CellData");
    file.add_cells("Verts", &vertices);
    file.add_cells("Lines", &lines);
    file.add_cells("Polys", &triangles);
    file.finish()
}

/// Returns the bytes of one column of the particles.
fn column<T: bytemuck::NoUninit>(
    state: &SceneState,
    value: impl Fn(&ParticleState) -> T,
) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(state.particles.len() * size_of::<T>());
    for particle in &state.particles {
        bytes.extend_from_slice(bytemuck::bytes_of(&value(particle)));
    }
    bytes
}

/// Returns the length of each untorn constraint relative to its rest length. It is NaN for a rest length
/// of 0, which has no ratio.
fn stretches(state: &SceneState) -> impl Iterator<Item = f32> {
    state.untorn_constraints().map(|constraint| {
        let [a, b] = [constraint.a, constraint.b]
            .map(|end| glam::Vec3::from_array(state.particles[end as usize].position));
        match constraint.rest_length {
            0.0 => f32::NAN,
            rest_length => a.distance(b) / rest_length,
        }
    })
}
