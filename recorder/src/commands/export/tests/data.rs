//! Numbers and meshes: every particle keeps its bits, torn constraints are left out, and nothing is left
//! after an error.

use std::io::Cursor;
use std::path::PathBuf;

use recorder::FrameReader;
use zip::ZipArchive;

use super::super::data;
use super::*;
use crate::export::data::{csv, foxglove, npz, usda};

/// A rope of three particles that are connected, and one that is not.
const ROPE: &str = r#"
    version = 1
    name = "line"
    [[particle]]
    position = [0.1, 0.0, 0.0]
    pinned = true
    [[particle]]
    position = [1.1, 0.0, 0.0]
    [[particle]]
    position = [2.1, 0.0, 0.0]
    [[particle]]
    position = [0.0, 5.0, 0.0]
    velocity = [1e-30, -0.3, 1e6]
    [[constraint]]
    particles = [0, 1]
    rest_length = 2.0
    [[constraint]]
    particles = [1, 2]
"#;

/// Returns all particles of a recording, read without the export.
fn recorded(file: &[u8]) -> Vec<ParticleState> {
    let mut frames = FrameReader::new(LogReader::new(file).unwrap());
    let mut particles = Vec::new();
    while let Some(frame) = frames.next_frame().unwrap() {
        particles.extend_from_slice(frame.payload());
    }
    particles
}

fn bits<const N: usize>(numbers: [f32; N]) -> [u32; N] {
    numbers.map(f32::to_bits)
}

fn written(
    file: &[u8],
    write: fn(&Snapshots<'_>, &mut dyn std::io::Write) -> anyhow::Result<()>,
) -> Vec<u8> {
    let mut bytes = Vec::new();
    with_snapshots(file, None, |snapshots| write(snapshots, &mut bytes)).unwrap();
    bytes
}

#[test]
fn arrays_have_the_bits_of_the_recording() {
    let file = record(TINY, 30);
    let particles = recorded(&file);
    let mut archive = ZipArchive::new(Cursor::new(written(&file, npz::write))).unwrap();
    let mut array = |name: &str| {
        let mut bytes = Vec::new();
        archive.by_name(name).unwrap().read_to_end(&mut bytes).unwrap();
        let header_size_bytes = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let text = String::from_utf8(bytes[10..header_size_bytes].to_vec()).unwrap();
        (text, bytes.split_off(header_size_bytes))
    };
    let (text, positions) = array("positions.npy");
    let expected = "{'descr': '<f4', 'fortran_order': False, 'shape': (31,5,3,), }";
    assert_eq!(text.trim_end(), expected);
    let expected: Vec<_> = particles.iter().map(|one| one.position).collect();
    assert_eq!(positions, bytemuck::cast_slice::<_, u8>(&expected));
    let expected: Vec<_> = particles.iter().map(|one| one.velocity).collect();
    assert_eq!(array("velocities.npy").1, bytemuck::cast_slice::<_, u8>(&expected));
    let expected: Vec<_> = particles.iter().map(|one| one.flags).collect();
    assert_eq!(array("flags.npy").1, bytemuck::cast_slice::<_, u8>(&expected));
    let steps: Vec<u64> = (0..=30).collect();
    assert_eq!(array("steps.npy").1, bytemuck::cast_slice::<_, u8>(&steps));
}

#[test]
fn the_digits_of_a_table_give_the_bits_of_the_recording() {
    let file = record(ROPE, 5);
    let table = String::from_utf8(written(&file, csv::write)).unwrap();
    let rows = table.lines().skip(1).map(|line| {
        let cells: Vec<_> = line.split(',').collect();
        let number = |column: usize| cells[column].parse::<f32>().unwrap();
        ParticleState {
            position: [number(3), number(4), number(5)],
            velocity: [number(6), number(7), number(8)],
            inverse_mass: number(9),
            flags: cells[10].parse().unwrap(),
        }
    });
    let (rows, recorded) = (rows.collect::<Vec<_>>(), recorded(&file));
    assert_eq!(rows.len(), 6 * 4);
    for (row, expected) in rows.iter().zip(&recorded) {
        assert_eq!(bits(row.position), bits(expected.position));
        assert_eq!(bits(row.velocity), bits(expected.velocity));
        assert_eq!(bits([row.inverse_mass]), bits([expected.inverse_mass]));
        assert_eq!(row.flags, expected.flags);
    }
}

/// A folder that is removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = format!("recorder-data-{name}-{}", std::process::id());
        let folder = std::env::temp_dir().join(folder);
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        fs::remove_dir_all(&self.0).unwrap();
    }
}

#[test]
fn a_scene_without_triangles_is_exported_as_lines_and_loose_vertices() {
    let file = record(ROPE, 1);
    let folder = Folder::new("rope");
    with_snapshots(&file, Some(&[0]), |snapshots| {
        for format in [DataFormat::Obj, DataFormat::Vtk] {
            data::write(snapshots, format, &folder.0, Existing::Refuse).unwrap();
        }
    });
    assert_eq!(folder.names(), ["line.pvd", "line_00000000.obj", "line_00000000.vtp"]);
    let mesh = fs::read_to_string(folder.0.join("line_00000000.obj")).unwrap();
    let expected =
        "# step 0\nv 0.1 0.0 0.0\nv 1.1 0.0 0.0\nv 2.1 0.0 0.0\nv 0.0 5.0 0.0\nl 1 2\nl 2 3\n";
    assert_eq!(mesh, expected);
    let polydata = fs::read(folder.0.join("line_00000000.vtp")).unwrap();
    let polydata = String::from_utf8_lossy(&polydata);
    let cells = "NumberOfPoints=\"4\" NumberOfVerts=\"1\" NumberOfLines=\"2\" NumberOfStrips=\"0\" \
                 NumberOfPolys=\"0\"";
    assert!(polydata.contains(cells), "{polydata}");
}

#[test]
fn a_stage_has_the_up_axis_of_the_scene() {
    for (up, expected, is_turned) in [
        ("y", "upAxis = \"Y\"", false),
        ("z", "upAxis = \"Z\"", false),
        ("-y", "upAxis = \"Y\"", true),
    ] {
        let scene = ROPE.replace("name = ", &format!("up = \"{up}\"\n    name = "));
        let stage = String::from_utf8(written(&record(&scene, 0), usda::write)).unwrap();
        assert!(stage.contains(expected), "{up}: {stage}");
        assert_eq!(stage.contains("rotateX = 180"), is_turned, "{up}");
        assert!(stage.contains("def Points \"particles\""), "{up}: {stage}");
    }
}

#[test]
fn an_export_that_fails_leaves_no_file() {
    let file = record(ROPE, 3);
    let folder = Folder::new("fails");
    let fails = |format, target: PathBuf| {
        with_snapshots(&file, None, |snapshots| {
            // The file has lost its last snapshot since it was surveyed.
            let steps = [0, 1, 2, 3, 4];
            let snapshots = Snapshots { steps: &steps, ..*snapshots };
            data::write(&snapshots, format, &target, Existing::Refuse).unwrap_err().to_string()
        })
    };
    let expected = "the file has changed: 4 of 5 snapshots are left";
    for (format, name) in [
        (DataFormat::Npz, "a.npz"),
        (DataFormat::Csv, "a.csv"),
        (DataFormat::Pc2, "a.pc2"),
        (DataFormat::Usda, "a.usda"),
        (DataFormat::Foxglove, "a.mcap"),
        (DataFormat::Vtk, ""),
        (DataFormat::Ros2, ""),
        (DataFormat::Obj, ""),
    ] {
        assert_eq!(fails(format, folder.0.join(name)), expected, "{format:?}");
        assert!(folder.names().is_empty(), "{format:?}: {:?}", folder.names());
    }
}

#[test]
fn a_cache_needs_another_name_than_its_mesh() {
    let file = record(ROPE, 0);
    let error = with_snapshots(&file, None, |snapshots| {
        let path = std::path::Path::new("/nonexistent/a.obj");
        data::write(snapshots, DataFormat::Pc2, path, Existing::Refuse).unwrap_err()
    });
    let expected = "/nonexistent/a.obj: the mesh gets this name; name the cache FILE.pc2";
    assert_eq!(error.to_string(), expected);
}

#[test]
fn a_changing_number_of_particles_is_refused() {
    let file = record(ROPE, 1);
    let error = with_snapshots(&file, None, |snapshots| {
        let snapshots = Snapshots { particle_count: 3, ..*snapshots };
        csv::write(&snapshots, &mut Vec::new()).unwrap_err()
    });
    let expected = "the snapshot of step 0 has 4 particles, but the first one 3";
    assert_eq!(error.to_string(), expected);
}

/// The proof reads the copy as it reads the original, and the cut file ends where it ended.
#[test]
fn a_copy_for_viewers_is_a_recording_with_the_same_content() {
    let file = record(TINY, 200);
    // Some of the cuts lie between a row in /steps and its snapshot, and all before the end of the recording.
    let cuts = (1..=40).map(|part| &file[..file.len() * part / 80]);
    let has_snapshot = |cut: &&[u8]| LogReader::new(*cut).is_ok() && !recorded(cut).is_empty();
    for original in cuts.filter(has_snapshot).chain([&file[..]]) {
        let expected = survey_of(original, "a");
        let intact = &original[..usize::try_from(expected.intact_count).unwrap()];
        let copy = written(intact, foxglove::write);
        assert_eq!(recorded(&copy), recorded(original));
        if original.len() < file.len() {
            let checked = recorder::check_file(Cursor::new(&copy), None, &mut |_, _| {}).unwrap();
            assert_eq!(checked.findings.list(), [], "it declares that it had no end");
        }
        let read = survey_of(&copy, "a");
        assert_eq!(read.end, LogEnd::Complete);
        assert_eq!((read.steps, read.run), (expected.steps, expected.run));
    }
    let twice = with_snapshots(&written(&file, foxglove::write), None, |snapshots| {
        foxglove::write(snapshots, &mut Vec::new()).unwrap_err().to_string()
    });
    assert_eq!(twice, "has /scene already; export the recording that it is a copy of");
}
