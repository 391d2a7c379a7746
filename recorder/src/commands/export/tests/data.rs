//! Numbers and meshes: every particle keeps its bits, every mesh its faces, torn constraints are left out,
//! frames are evenly spaced, and nothing is left after an error.

use std::io::Cursor;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

use recording::{AnchorForceRow, ContentSelection, ForcesRow, FrameReader, OutcomeRow};
use sim_contract::{Action, Command, Outcome, PlainF32, RestoreContents};
use sim_solver::scene::{Mesh, Shape};
use zip::ZipArchive;

use super::super::data;
use super::*;
use crate::commands::export::{foxglove, npz, tables, usda};

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
fn arrays_of_forces_with_another_number_of_rows_are_refused() {
    let forces = |step: u64, count: usize| {
        let anchor =
            AnchorForceRow { impulse: [PlainF32(1.0); 3], angular_impulse: [PlainF32(0.0); 3] };
        let anchors = vec![anchor; count];
        Message::Forces(ForcesRow { step, anchors, ..ForcesRow::default() })
    };
    let file = record(ROPE, 3);
    let written = |counts: [usize; 2]| {
        let file = with_messages(&file, |step| {
            let count =
                usize::try_from(step).ok().and_then(|step| counts.get(step.checked_sub(1)?));
            count.map(|count| forces(step, *count))
        });
        with_snapshots(&file, None, |snapshots| npz::write(snapshots, &mut Vec::new()))
    };
    written([2, 2]).unwrap();
    let error = written([1, 2]).unwrap_err().to_string();
    assert_eq!(error, "step 1: anchor_impulses has 1 row, but 2 in other steps");
}

#[test]
fn the_digits_of_a_table_give_the_bits_of_the_recording() {
    let file = record(ROPE, 5);
    let table = String::from_utf8(written(&file, tables::write_particles)).unwrap();
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
        // Tests that run at the same time can give the same name.
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let folder = format!("recorder-data-{name}-{}-{count}", std::process::id());
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

/// Two quads and a triangle in a row, with seams of texture coordinates, beside a rope that comes first.
const FACES: &str = "v 0 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv 2 0 0\nv 2 1 0\nv 3 0 0\nvt 0 0\nvt 0 1\nvt 1 0\nvt 1 1\n\
    g front side\nusemtl cotton\nf 1/1 3/3 4/4 2/2\nf 3/1 5/3 6/4 4/2\ng 2nd\nusemtl \u{e9}tamine\nf 5/1 7/3 6/2\n";

/// Returns the complete text of a scene with the faces.
fn faces_scene(tables: &str) -> String {
    let text = format!(
        "version = 1\nname = \"faces\"\n{tables}\n[[generate]]\nshape = \"rope\"\ncount = 3\nfrom = [0, 5, 0]\n\
         to = [1, 5, 0]\n[[generate]]\nshape = \"obj\"\npath = \"a.obj\"\npinned = \"y > 0.5\"\n[[generate]]\n\
         shape = \"cloth\"\ncolumns = 2\nrows = 2\nspacing = 1\norigin = [0, 9, 0]\n"
    );
    Scene::from_toml_with_files(&text, "a", &|_| Ok(FACES.to_owned())).unwrap().to_toml()
}

/// Returns the texts of the files that an export writes into a folder, by their names.
fn texts(file: &[u8], format: DataFormat, frames_per_s: Option<u16>) -> BTreeMap<String, String> {
    let folder = Folder::new(&format!("texts-{format:?}-{frames_per_s:?}"));
    with_snapshots(file, None, |snapshots| {
        let snapshots = Snapshots { frames_per_s, ..*snapshots };
        data::write(&snapshots, format, &folder.0, Existing::Refuse).unwrap();
    });
    let text = |name: &String| {
        String::from_utf8_lossy(&fs::read(folder.0.join(name)).unwrap()).into_owned()
    };
    folder.names().into_iter().map(|name| (name.clone(), text(&name))).collect()
}

fn stage(file: &[u8], frames_per_s: Option<u16>) -> String {
    let mut bytes = Vec::new();
    with_snapshots(file, None, |snapshots| {
        usda::write(&Snapshots { frames_per_s, ..*snapshots }, &mut bytes).unwrap();
    });
    String::from_utf8(bytes).unwrap()
}

#[test]
fn an_imported_mesh_keeps_its_faces_texture_coordinates_groups_and_materials() {
    let text = faces_scene("");
    let file = record(&text, 0);
    let (_, obj) = texts(&file, DataFormat::Obj, None).into_iter().next().unwrap();
    // The rope has no faces, and its particles come first.
    let exported = Mesh::from_obj(&obj).unwrap().mesh;
    let original = Mesh::from_obj(FACES).unwrap().mesh;
    assert_eq!(exported.faces[..3], original.faces);
    assert_eq!(exported.faces.len(), 3 + 2, "and the triangles of the sheet");
    assert_eq!(exported.vertices[..7], original.vertices);
    assert_eq!(exported.details.uvs, original.details.uvs);
    assert_eq!(exported.details.face_uvs[..3], original.details.face_uvs);
    let scene = Scene::from_toml(&text, "a").unwrap();
    let Shape::Obj(mesh) = &scene.generators[1].shape else { panic!("not a mesh") };
    assert_eq!(exported.details.groups[..2], mesh.details.groups);
    assert_eq!(exported.details.materials[..2], mesh.details.materials);
    assert!(obj.contains("\nf 4/1 6/3 7/4 5/2\n"), "{obj}");
    let stage = stage(&file, None);
    for line in [
        "int[] faceVertexCounts = [4, 4, 3, 3, 3]",
        "int[] primvars:st:indices = [0, 2, 3, 1, 0, 2, 3, 1, 0, 2, 1, 4, 4, 4, 4, 4, 4]",
        "texCoord2f[] primvars:st = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0), (0.0, 0.0)]",
        "def GeomSubset \"group_front_side\"",
        "def GeomSubset \"group__2nd\"",
        "rel material:binding = </scene/materials/_tamine>",
        "int[] indices = [0, 1]",
        "int[] indices = [2]",
    ] {
        assert!(stage.contains(line), "{line}: {stage}");
    }
    let vtp = texts(&file, DataFormat::Vtk, None).into_values().nth(1).unwrap();
    assert!(vtp.contains("NumberOfPolys=\"5\"") && vtp.contains("Name=\"group\""), "{vtp}");
    let bytes = "50 110 100 0";
    assert!(vtp.contains(bytes), "the name 2nd: {vtp}");
}

#[test]
fn a_face_with_a_torn_side_disappears_and_comes_back_with_a_reset() {
    let text = faces_scene("");
    let solver = Solver::new(&Scene::from_toml(&text, "a").unwrap());
    // The side of the first quad that no other face has: vertices 0 and 1 of the mesh.
    let side = solver.constraints().position(|one| [one.a, one.b] == [3, 4]).unwrap();
    let commands = format!(
        "{{\"step\":2,\"kind\":\"cut\",\"constraint\":{side}}}\n{{\"step\":4,\"kind\":\"reset\"}}\n"
    );
    let file = record_commands(&text, &commands, 4);
    let faces = |obj: &String| obj.lines().filter(|line| line.starts_with("f ")).count();
    let counts: Vec<_> = texts(&file, DataFormat::Obj, None).values().map(faces).collect();
    assert_eq!(counts, [5, 5, 4, 4, 5]);
    let stage = stage(&file, None);
    let samples = "int[] faceVertexCounts.timeSamples = {\n            0: [4, 4, 3, 3, 3],\n            \
                   2: [4, 3, 3, 3],\n            4: [4, 4, 3, 3, 3],\n        }";
    assert!(stage.contains(samples), "{stage}");
    let subset = "int[] indices.timeSamples = {\n            0: [0, 1],\n            2: [0],\n";
    assert!(stage.contains(subset), "{stage}");
    let polygons = texts(&file, DataFormat::Vtk, None);
    assert!(polygons["faces_00000002.vtp"].contains("NumberOfPolys=\"4\""));
}

/// A recording whose scene cannot be read, or has another mesh, has the triangles of `/surface`.
#[test]
fn without_its_scene_a_mesh_is_exported_as_triangles() {
    let text = faces_scene("");
    // The first face has the corners 0, 2, 3, 1 and becomes 0, 1, 3, 2; each number of the list takes a byte.
    let other = text.replace("\nfaces = \"BAACAwEE", "\nfaces = \"BAABAwIE");
    assert_ne!(other, text);
    for attachment in ["", other.as_str()] {
        let file = record_with_text(&text, 0, attachment);
        let (_, obj) = texts(&file, DataFormat::Obj, None).into_iter().next().unwrap();
        let faces: Vec<_> = obj.lines().filter(|line| line.starts_with("f ")).collect();
        assert_eq!(faces.len(), 7, "{obj}");
        assert_eq!(faces[..2], ["f 4 6 7", "f 4 7 5"]);
    }
}

#[test]
fn colliders_are_exported_behind_the_particles_in_their_poses() {
    let moving = "[[collider]]\nshape = \"sphere\"\ncenter = [0, -3, 0]\nradius = 0.5\nvelocity = [24, 0, 0]\n\
        [[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = -5\n";
    let text = faces_scene(moving);
    let file = record(&text, 10);
    let count = Solver::new(&Scene::from_toml(&text, "a").unwrap()).particle_count();
    let objs = texts(&file, DataFormat::Obj, None);
    let obj = &objs["faces_00000010.obj"];
    let (cloth, colliders) =
        obj.split_once("o collider_0\ng collider_0\nusemtl collider\n").unwrap();
    let (sphere, plane) = colliders.split_once("o collider_1\n").unwrap();
    let vertices = |text: &str| -> Vec<glam::Vec3> {
        let lines = text.lines().filter_map(|line| line.strip_prefix("v "));
        let axes = |line: &str| line.split(' ').map(|one| one.parse().unwrap()).collect::<Vec<_>>();
        lines.map(|line| glam::Vec3::from_slice(&axes(line))).collect()
    };
    assert_eq!(vertices(cloth).len(), count);
    // It has moved by 0.1 m in each step.
    let center = glam::Vec3::new(1.0, -3.0, 0.0);
    let distances = vertices(sphere).into_iter().map(|vertex| vertex.distance(center));
    assert!(distances.fold(0.0, |most: f32, one| most.max((one - 0.5).abs())) < 1e-4);
    assert!(vertices(plane).iter().all(|vertex| (vertex.y + 5.0).abs() < 1e-4));
    let last = count + vertices(sphere).len() + vertices(plane).len();
    assert!(plane.ends_with(&format!(" {last}\n")), "{plane}");

    let stage = stage(&file, None);
    let (_, sphere) = stage.split_once("def Mesh \"collider_0\"").unwrap();
    let (sphere, plane) = sphere.split_once("def Mesh \"collider_1\"").unwrap();
    let (_, samples) = sphere.split_once("xformOp:transform.timeSamples = {").unwrap();
    let xs: Vec<f64> = samples
        .lines()
        .skip(1)
        .map_while(|line| line.split_once(": "))
        .map(|(_, matrix)| {
            let row = matrix.rsplit('(').next().unwrap();
            row.split(',').next().unwrap().parse().unwrap()
        })
        .collect();
    assert_eq!(xs.len(), 11);
    assert!(xs.iter().enumerate().all(|(step, x)| (x - 0.1 * step as f64).abs() < 1e-5), "{xs:?}");
    assert!(plane.contains("matrix4d xformOp:transform = ("), "{plane}");

    let vtk = texts(&file, DataFormat::Vtk, None);
    assert_eq!(vtk.len(), 2 * 11 + 1);
    let pvd = &vtk["faces.pvd"];
    assert!(pvd.contains("part=\"1\" file=\"faces_colliders_00000010.vtp\""), "{pvd}");
    assert!(vtk["faces_colliders_00000010.vtp"].contains("Name=\"collider\""));
    // The mesh of a cache has the vertices of the cache.
    let folder = Folder::new("cache-colliders");
    with_snapshots(&file, None, |snapshots| {
        let target = folder.0.join("a.pc2");
        data::write(snapshots, DataFormat::Pc2, &target, Existing::Refuse).unwrap();
    });
    let mesh = fs::read_to_string(folder.0.join("a.obj")).unwrap();
    assert_eq!(vertices(&mesh).len(), count);
}

/// The lines of a mesh that begin with a word, as numbers.
fn positions(obj: &str) -> Vec<[f32; 3]> {
    let lines = obj.lines().filter_map(|line| line.strip_prefix("v "));
    let axes = |line: &str| line.split(' ').map(|one| one.parse().unwrap()).collect::<Vec<f32>>();
    lines.map(|line| axes(line).try_into().unwrap()).collect()
}

#[test]
fn frames_are_evenly_spaced_and_interpolated_between_snapshots() {
    // 240 Hz: frames of 100 per second lie at steps 0, 2.4, 4.8, 7.2, 9.6 and 12.
    let file = record(ROPE, 13);
    let particles = recorded(&file);
    let at = |step: usize, one: usize| particles[step * 4 + one].position.map(f64::from);
    let objs = texts(&file, DataFormat::Obj, Some(100));
    assert_eq!(objs.len(), 6);
    for (frame, obj) in objs.values().enumerate() {
        let (step, share) = (12 * frame / 5, (12 * frame % 5) as f64 / 5.0);
        for (one, found) in positions(obj).into_iter().enumerate() {
            let [from, to] = [at(step, one), at(step + 1, one)];
            let expected = [0, 1, 2].map(|axis| from[axis] + (to[axis] - from[axis]) * share);
            let is_near = |axis: usize| {
                (f64::from(found[axis]) - expected[axis]).abs()
                    < 1e-3 * expected[axis].abs().max(1e-3)
            };
            assert!((0..3).all(is_near), "frame {frame}: {found:?} {expected:?}");
        }
    }
    assert!(
        objs["line_00000001.obj"]
            .starts_with("# frame 1 at 0.010000 s: interpolated between snapshots\n")
    );
    assert!(objs["line_00000005.obj"].starts_with("# frame 5 at 0.050000 s: step 12\n"));
    let exact = positions(&objs["line_00000005.obj"]);
    let expected: Vec<_> = particles[12 * 4..13 * 4].iter().map(|one| one.position).collect();
    assert!(exact.into_iter().map(bits).eq(expected.into_iter().map(bits)));

    let stage = stage(&file, Some(100));
    for line in [
        "timeCodesPerSecond = 100",
        "startTimeCode = 0\n    endTimeCode = 5\n",
        "4 of 6 frames are interpolated between snapshots",
        "\n            5: [(",
    ] {
        assert!(stage.contains(line), "{line}: {stage}");
    }
    let vtk = texts(&file, DataFormat::Vtk, Some(100));
    assert!(vtk["line.pvd"].contains("timestep=\"0.03\" part=\"0\" file=\"line_00000003.vtp\""));
}

#[test]
fn velocities_and_colliders_are_interpolated_as_positions_are() {
    // The collider moves by 0.1 m in each step. Frame 1 lies at step 2.4, and frame 5 at step 12.
    let collider = "[[collider]]\nshape = \"sphere\"\ncenter = [0, -30, 0]\nradius = 0.5\nvelocity = [24, 0, 0]\n";
    let file = record(&format!("{ROPE}\n{collider}"), 12);
    let particles = recorded(&file);
    let stage = stage(&file, Some(100));
    let samples = |attribute: &str| {
        let (_, samples) = stage.split_once(&format!("{attribute}.timeSamples = {{\n")).unwrap();
        let lines = samples.lines().take(6).map(str::trim).map(str::to_owned);
        lines.collect::<Vec<_>>()
    };
    let numbers = |line: &str| -> Vec<f32> {
        let parts = line.split(|letter| "()[], :".contains(letter)).filter(|part| !part.is_empty());
        parts.map(|part| part.parse().unwrap()).collect()
    };
    let velocities = numbers(&samples("vector3f[] velocities")[1]);
    for particle in 0..4 {
        let at = |step: usize| particles[step * 4 + particle].velocity;
        let ([from, to], found) = ([at(2), at(3)], &velocities[1 + 3 * particle..]);
        for axis in 0..3 {
            let expected = from[axis] + (to[axis] - from[axis]) * 0.4;
            let error = (found[axis] - expected).abs();
            assert!(error <= 1e-4 * expected.abs().max(1e-3), "{found:?} {from:?} {to:?}");
        }
    }
    for (frame, pose) in samples("matrix4d xformOp:transform").iter().enumerate() {
        let pose = numbers(pose);
        assert!((pose[13] - 0.24 * frame as f32).abs() < 1e-5, "{frame}: {pose:?}");
    }
}

/// Copies a recording, with further messages before the snapshots of their steps.
fn with_messages(file: &[u8], further: impl Fn(u64) -> Option<Message>) -> Vec<u8> {
    let mut log = LogReader::new(file).unwrap();
    let (run, scene) = (log.run().clone(), log.scene().to_vec());
    let selection = ContentSelection { has_forces: true, ..ContentSelection::default() };
    let options = LogOptions { selection, ..LogOptions::default() };
    let mut copy = LogWriter::create(Vec::new(), options, &run, &scene, 0).unwrap();
    while let Some(logged) = log.next_message().unwrap() {
        if let Message::Step(row) = &logged.message
            && let Some(message) = further(row.step)
        {
            copy.write(&message, 0).unwrap();
        }
        copy.write(&logged.message, 0).unwrap();
    }
    copy.finish(&Closing::default()).unwrap()
}

#[test]
fn frames_before_a_state_that_was_put_in_place_show_the_snapshot_before_it() {
    let reset = record_commands(ROPE, r#"{"step":7,"kind":"reset"}"#, 12);
    let contents = RestoreContents::Motion;
    let restore = Action::Restore { contents, state_hash: 0 };
    let outcome = Outcome::new(0, 7, Command::new(0, 1, restore), Ok(()));
    let outcome = |step| (step == 7).then(|| Message::Outcome(OutcomeRow::from(&outcome)));
    for file in [reset, with_messages(&record(ROPE, 12), outcome)] {
        let particles = recorded(&file);
        // Frame 1 lies at step 6.86.
        let objs = texts(&file, DataFormat::Obj, Some(35));
        let obj = &objs["line_00000001.obj"];
        let expected: Vec<_> = particles[6 * 4..7 * 4].iter().map(|one| one.position).collect();
        assert_eq!(positions(obj), expected);
        assert!(obj.starts_with("# frame 1 at 0.028571 s: step 6\n"), "{obj}");
        let stage = stage(&file, Some(35));
        assert!(stage.contains("0 of 2 frames are interpolated"), "{stage}");
    }
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
        tables::write_particles(&snapshots, &mut Vec::new()).unwrap_err()
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
            let checked = recording::check_file(Cursor::new(&copy), None, &mut |_, _| {}).unwrap();
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

#[test]
fn a_copy_of_a_damaged_recording_has_what_is_intact_and_declares_the_rest() {
    let mut file = record(TINY, 200);
    let snapshot_count = recorded(&file).len();
    // At least one of them lies in a chunk, and not in the index behind it.
    for tenth in [3, 5, 7] {
        let at = tenth * file.len() / 10;
        file[at] ^= 1;
    }
    let folder = Folder::new("damaged");
    let path = folder.0.join("a.mcap");
    fs::write(&path, file).unwrap();
    let parts = IntactParts::find(&path, &Stop::install().unwrap()).unwrap();
    let mut repaired = Vec::new();
    parts.bytes().unwrap().read_to_end(&mut repaired).unwrap();
    let copy = written(&repaired, foxglove::write);
    assert_eq!(recorded(&copy), recorded(&repaired));
    assert!(
        (1..snapshot_count).contains(&recorded(&copy).len()),
        "{} of {snapshot_count}",
        recorded(&copy).len()
    );
    let checked = recording::check_file(Cursor::new(&copy), None, &mut |_, _| {}).unwrap();
    assert_eq!(checked.findings.list(), []);
    let closing = |file: &[u8]| {
        let mut log = LogReader::new(file).unwrap();
        while log.next_message().unwrap().is_some() {}
        log.closing().unwrap().missing()
    };
    assert!(closing(&copy)["/particles"] > 0);
    assert_eq!(closing(&copy), closing(&repaired));
}
