//! A file of VTK's XML format for PolyData: arrays are described in XML, and their bytes follow at the end.

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
