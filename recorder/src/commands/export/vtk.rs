//! VTK: a VTP file (PolyData) per frame, another one for the colliders, and a PVD file that gives their times.

use std::path::Path;

use recording::SceneState;
use sim_contract::ParticleState;

use super::files::{FrameNames, WrittenFiles};
use super::shapes::{Colliders, Faces};
use super::snapshots::Snapshots;

/// The number of cells without a group or material.
const NO_NAME: i64 = -1;

/// Writes the files into `folder`.
pub(crate) fn write(
    snapshots: &Snapshots<'_>,
    folder: &Path,
    files: &mut WrittenFiles,
) -> anyhow::Result<()> {
    let scene_name = &snapshots.run.scene_name;
    let names = FrameNames::new(folder, scene_name, "vtp");
    let collider_names = FrameNames::new(folder, &format!("{scene_name}_colliders"), "vtp");
    let colliders = Colliders::of(snapshots)?;
    let parts: Vec<_> =
        [Some(&names), colliders.as_ref().map(|_| &collider_names)].into_iter().flatten().collect();
    let collection = names.index_path("pvd");
    files.existing().check(&collection)?;
    for part in &parts {
        part.prepare(&snapshots.frame_numbers(), files.existing())?;
        part.remove_older(files.existing())?;
    }
    let faces = Faces::of(snapshots)?;
    snapshots.for_each_frame(|frame| {
        let (state, time_s) = (frame.state, frame.time_s);
        files.add_whole(&names.path(frame.number), &polydata(state, &faces, time_s))?;
        let Some(colliders) = &colliders else { return Ok(()) };
        let content = collider_polydata(state, colliders, time_s);
        files.add_whole(&collider_names.path(frame.number), &content)
    })?;
    files.add_whole(&collection, pvd(snapshots, &parts).as_bytes())
}

/// Returns the collection of all files. Names of files have no character that XML reserves.
fn pvd(snapshots: &Snapshots<'_>, parts: &[&FrameNames<'_>]) -> String {
    let mut entries = String::new();
    for number in snapshots.frame_numbers() {
        let time_s = snapshots.frame_time_s(number);
        for (part, names) in parts.iter().enumerate() {
            let name = names.name(number);
            entries +=
                &format!("<DataSet timestep=\"{time_s:?}\" part=\"{part}\" file=\"{name}\"/>\n");
        }
    }
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n<Collection>\n\
         {entries}</Collection>\n</VTKFile>\n"
    )
}

/// Returns the file of a state: a vertex for each particle that nothing connects, a line for each untorn
/// constraint, and a polygon for each intact face.
fn polydata(state: &SceneState, faces: &Faces, time_s: f64) -> Vec<u8> {
    let is_connected = state.connected();
    let vertices = (0_u32..).zip(&is_connected).filter(|(_, is_connected)| !**is_connected);
    let vertices: Vec<_> = vertices.map(|(particle, _)| [particle]).collect();
    let lines: Vec<_> = state.untorn_constraints().map(|one| [one.a, one.b]).collect();
    let polygons: Vec<_> =
        faces.intact(state).into_iter().map(|index| &faces.all[index as usize]).collect();
    // Cell data has the order of the cells: vertices, lines, polygons.
    let stretches: Vec<f32> = std::iter::repeat_n(f32::NAN, vertices.len())
        .chain(stretches(state))
        .chain(std::iter::repeat_n(f32::NAN, polygons.len()))
        .collect();
    let others = vertices.len() + lines.len();
    let numbers = |of_faces: Vec<Option<u32>>| -> Vec<i64> {
        let numbers = of_faces.into_iter().map(|one| one.map_or(NO_NAME, i64::from));
        std::iter::repeat_n(NO_NAME, others).chain(numbers).collect()
    };
    let groups = numbers(polygons.iter().map(|face| face.group).collect());
    let materials = numbers(polygons.iter().map(|face| face.material).collect());

    let counts = PolyDataCounts {
        points: state.particles.len(),
        vertices: vertices.len(),
        lines: lines.len(),
        polygons: polygons.len(),
    };
    let names: [(&str, &[String]); 2] =
        [("group_names", &faces.groups), ("material_names", &faces.materials)];
    let mut file = PolyData::new(counts, time_s, &names);
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
    if !faces.groups.is_empty() {
        file.add_array("group", NumberType::Int64, 1, bytemuck::cast_slice(&groups));
    }
    if !faces.materials.is_empty() {
        file.add_array("material", NumberType::Int64, 1, bytemuck::cast_slice(&materials));
    }
    file.end("CellData");
    file.add_cells("Verts", vertices.iter().map(<[u32; 1]>::as_slice));
    file.add_cells("Lines", lines.iter().map(<[u32; 2]>::as_slice));
    file.add_cells("Polys", polygons.iter().map(|face| face.corners.as_slice()));
    file.finish()
}

/// Returns the file of the colliders: their faces, each with the index of its collider.
fn collider_polydata(state: &SceneState, colliders: &Colliders, time_s: f64) -> Vec<u8> {
    let (mut points, mut cells, mut indices) = (Vec::new(), Vec::<Vec<u32>>::new(), Vec::new());
    for (index, solid, pose) in colliders.solids(state) {
        // Meshes have fewer than 2^32 vertices in all, because the text of a scene is limited.
        let first = u32::try_from(points.len()).unwrap_or(u32::MAX);
        points.extend(solid.vertices.iter().map(|one| pose.apply(*one).as_vec3().to_array()));
        indices.extend(std::iter::repeat_n(index as u64, solid.faces.len()));
        let moved = |face: &Vec<u32>| face.iter().map(|corner| first + corner).collect();
        cells.extend(solid.faces.iter().map(moved));
    }
    let counts =
        PolyDataCounts { points: points.len(), vertices: 0, lines: 0, polygons: cells.len() };
    let mut file = PolyData::new(counts, time_s, &[]);
    file.begin("Points");
    file.add_array("positions", NumberType::Float32, 3, bytemuck::cast_slice(&points));
    file.end("Points");
    file.begin("CellData");
    file.add_array("collider", NumberType::Int64, 1, bytemuck::cast_slice(&indices));
    file.end("CellData");
    file.add_cells("Polys", cells.iter().map(Vec::as_slice));
    file.finish()
}

/// Returns the bytes of one column of the particles.
fn column<T: bytemuck::NoUninit>(
    state: &SceneState,
    value: impl Fn(&ParticleState) -> T,
) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(state.particles.len() * size_of::<T>());
    for particle in state.particles.iter() {
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

/// The bytes of an array are preceded by their count in this many bytes.
const LENGTH_SIZE_BYTES: usize = 8;

/// The type of the numbers in an array.
#[derive(Debug, Clone, Copy)]
pub(super) enum NumberType {
    Float32,
    Int64,
    UInt32,
}

impl NumberType {
    fn name(self) -> &'static str {
        match self {
            Self::Float32 => "Float32",
            Self::Int64 => "Int64",
            Self::UInt32 => "UInt32",
        }
    }
}

/// The numbers of points and cells of a file.
#[derive(Debug, Clone, Copy)]
pub(super) struct PolyDataCounts {
    pub(super) points: usize,
    pub(super) vertices: usize,
    pub(super) lines: usize,
    pub(super) polygons: usize,
}

/// A file that is being built.
pub(super) struct PolyData {
    xml: String,
    /// The arrays, each with its length before it.
    appended: Vec<u8>,
}

impl PolyData {
    /// Begins the file of a state at a time, in seconds. The lists of names belong to the whole file.
    pub(super) fn new(counts: PolyDataCounts, time_s: f64, names: &[(&str, &[String])]) -> Self {
        let PolyDataCounts { points, vertices, lines, polygons } = counts;
        let names: String = names.iter().map(|(list, names)| name_array(list, names)).collect();
        let xml = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" \
             byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n\
             <FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" \
             format=\"ascii\">{time_s:?}</DataArray>{names}</FieldData>\n\
             <Piece NumberOfPoints=\"{points}\" NumberOfVerts=\"{vertices}\" \
             NumberOfLines=\"{lines}\" NumberOfStrips=\"0\" NumberOfPolys=\"{polygons}\">\n"
        );
        Self { xml, appended: Vec::new() }
    }

    /// Begins a section of the piece.
    pub(super) fn begin(&mut self, section: &str) {
        self.xml.push_str(&format!("<{section}>\n"));
    }

    pub(super) fn end(&mut self, section: &str) {
        self.xml.push_str(&format!("</{section}>\n"));
    }

    /// Adds an array of little-endian numbers to the section.
    pub(super) fn add_array(
        &mut self,
        name: &str,
        number_type: NumberType,
        component_count: usize,
        bytes: &[u8],
    ) {
        let (number_type, offset) = (number_type.name(), self.appended.len());
        self.xml.push_str(&format!(
            "<DataArray type=\"{number_type}\" Name=\"{name}\" \
             NumberOfComponents=\"{component_count}\" format=\"appended\" offset=\"{offset}\"/>\n"
        ));
        let length: [u8; LENGTH_SIZE_BYTES] = (bytes.len() as u64).to_le_bytes();
        self.appended.extend_from_slice(&length);
        self.appended.extend_from_slice(bytes);
    }

    /// Adds a section with cells of any number of points.
    pub(super) fn add_cells<'a>(&mut self, section: &str, cells: impl Iterator<Item = &'a [u32]>) {
        let (mut points, mut ends) = (Vec::<i64>::new(), Vec::<u64>::new());
        for cell in cells {
            points.extend(cell.iter().copied().map(i64::from));
            // A cell ends at the number of points, which is below 2^63.
            ends.push(points.len() as u64);
        }
        self.begin(section);
        self.add_array("connectivity", NumberType::Int64, 1, bytemuck::cast_slice(&points));
        self.add_array("offsets", NumberType::Int64, 1, bytemuck::cast_slice(&ends));
        self.end(section);
    }

    /// Returns the bytes of the file.
    pub(super) fn finish(mut self) -> Vec<u8> {
        // The underscore marks the first byte of the arrays.
        self.xml.push_str("</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_");
        let mut file = self.xml.into_bytes();
        file.append(&mut self.appended);
        file.extend_from_slice(b"\n</AppendedData>\n</VTKFile>\n");
        file
    }
}

/// Returns a list of texts: the numbers of their bytes, with a zero behind each text.
fn name_array(list: &str, names: &[String]) -> String {
    if names.is_empty() {
        return String::new();
    }
    let bytes = names.iter().flat_map(|name| name.bytes().chain([0]));
    let bytes: Vec<_> = bytes.map(|byte| byte.to_string()).collect();
    format!(
        "<Array type=\"String\" Name=\"{list}\" NumberOfTuples=\"{}\" format=\"ascii\">{}</Array>",
        names.len(),
        bytes.join(" ")
    )
}
