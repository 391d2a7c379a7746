//! Independent readers: the stock MCAP readers of Python and JavaScript find what was published in recordings,
//! and the iceoryx2 package of Python reads a running node. These tests need what `.ci/run` installs.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use integration_tests::{DEADLINE, Process, Program, Sandbox, ctl, record, wait_for};
use serde_json::{Value, json};
use sim_contract::{CONTRACT_VERSION, Client, Parameter, TearCause};
use sim_solver::{Bend, Scene, Solver, builtin};

/// Runs a script of `tests/python`, and returns its report.
fn python(sandbox: &Sandbox, script: &str, args: &[&str]) -> Value {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let script: PathBuf = folder.join("python").join(script);
    let args: Vec<_> = [script.to_str().unwrap()].into_iter().chain(args.iter().copied()).collect();
    Process::run(Program::Python, sandbox, &args).json()
}

#[test]
#[ignore = "needs Python"]
fn the_stock_python_reader_finds_the_published_bits() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain", "--paused"]);
    let recording = record(&sandbox, &file);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let mut published = String::new();
    ctl(&sandbox, &["grab", "90", "0.5", "0.2", "0.3"]);
    ctl(&sandbox, &["cut", "40"]);
    ctl(&sandbox, &["set", "gravity", "0", "-1.5", "0"]);
    ctl(&sandbox, &["step", "60"]);
    while let Some(snapshot) = client.next_snapshot(DEADLINE).unwrap() {
        let step = snapshot.header().step;
        write!(published, "{step} ").unwrap();
        for byte in bytemuck::cast_slice::<_, u8>(snapshot.particles()) {
            write!(published, "{byte:02x}").unwrap();
        }
        published.push('\n');
        if step == 60 {
            break;
        }
    }
    assert_eq!(recording.interrupt().code, Some(0));
    let published = sandbox.write("published.txt", &published);
    let result = python(&sandbox, "read_recording.py", &[&file, &published]);
    assert_eq!(result["counts"]["/particles"], 61);
    let tears = json!([{ "step": 1, "constraints": [40], "causes": ["cut"] }]);
    assert_eq!(result["/tears"], tears);
    let rows = result["/parameters"].as_array().unwrap();
    let gravity: Vec<_> = rows.iter().map(|row| (&row["step"], &row["gravity"])).collect();
    assert_eq!(
        gravity,
        [(&json!(0), &json!([0.0, -9.81, 0.0])), (&json!(1), &json!([0.0, -1.5, 0.0]))]
    );
}

/// Counts the messages of a recording with `@mcap/core`.
fn javascript_counts(sandbox: &Sandbox, file: &str) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("node/count_messages.js");
    Process::run(Program::Node, sandbox, &[script.to_str().unwrap(), file]).json()
}

/// Damages a recording and repairs it. Returns the repaired file, and the report.
fn repaired_recording(sandbox: &Sandbox) -> (String, Value) {
    let (whole, damaged) = (sandbox.path("whole.mcap"), sandbox.path("damaged.mcap"));
    let args = ["simulate", "curtain", "--steps", "2400", "-o", &whole];
    Process::run(Program::Recorder, sandbox, &args).success();
    let mut bytes = std::fs::read(&whole).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle..middle + 5000].fill(0);
    bytes.truncate(bytes.len() - 100);
    std::fs::write(&damaged, bytes).unwrap();
    let repaired = sandbox.path("repaired.mcap");
    let args = ["repair", &damaged, &repaired, "--json"];
    let report = Process::run(Program::Recorder, sandbox, &args);
    let report = serde_json::from_str(&report.stdout).unwrap();
    (repaired, report)
}

#[test]
#[ignore = "needs Python"]
fn the_stock_python_reader_opens_a_repaired_recording() {
    let sandbox = Sandbox::new();
    let (repaired, report) = repaired_recording(&sandbox);
    let read = python(&sandbox, "count_messages.py", &[&repaired]);
    assert_eq!(read["counts"]["/particles"], report["snapshot_count"]);
    assert_eq!(read["repair"]["lost_steps"], report["lost_steps"][0]);
}

#[test]
#[ignore = "needs Node"]
fn the_stock_javascript_reader_opens_simulated_and_repaired_recordings() {
    let sandbox = Sandbox::new();
    let (repaired, report) = repaired_recording(&sandbox);
    let counts = javascript_counts(&sandbox, &repaired);
    assert_eq!(counts["/particles"], report["snapshot_count"]);
    let args = ["simulate", "rope", "--steps", "240"];
    for compression in ["none", "lz4", "zstd"] {
        let file = sandbox.path(&format!("{compression}.mcap"));
        let args = [&args[..], &["--compression", compression, "-o", &file]].concat();
        Process::run(Program::Recorder, &sandbox, &args).success();
        let counts = javascript_counts(&sandbox, &file);
        assert_eq!((&counts["/particles"], &counts["/keyframe"]), (&json!(241), &json!(2)));
    }
}

#[test]
#[ignore = "needs Python"]
fn the_iceoryx2_python_package_reads_particles_tears_and_parameters() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain", "--paused"]);
    ctl(&sandbox, &["cut", "40"]);
    ctl(&sandbox, &["set", "gravity", "0", "-1.5", "0"]);
    ctl(&sandbox, &["step"]);
    let prefix = format!("{}_", sandbox.domain());
    let root = format!("/tmp/catenary-{}-{}", rustix::process::getuid().as_raw(), sandbox.domain());
    let read = python(&sandbox, "read_live.py", &[&prefix, &root]);
    assert_eq!(read["contract_version"], CONTRACT_VERSION);
    assert_eq!((&read["step"], &read["particle_count"]), (&1.into(), &168.into()));
    assert_eq!(read["torn"], json!([[40, TearCause::Cut as u32]]));
    assert_eq!(read["new_tears"], 1);
    // Gravity is the first parameter, and a vector has form 2.
    assert_eq!(read["parameters"][0], json!([0, 0, -1, 2, [0.0, -1.5, 0.0]]));
    // 16 parameters have one value, and two have one for each of the four constraint kinds.
    assert_eq!(read["parameters"].as_array().map(Vec::len), Some(16 + 2 * 4));
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let snapshot = client.next_snapshot(DEADLINE).unwrap().unwrap();
    for (index, position) in read["first"].as_array().unwrap().iter().enumerate() {
        let position: Vec<f64> = serde_json::from_value(position.clone()).unwrap();
        let expected = snapshot.particles()[index].position.map(f64::from);
        assert_eq!(position, expected);
    }
}

/// The second flag is stiffer than the first.
#[test]
#[ignore = "needs Python"]
fn the_iceoryx2_python_package_reads_bends_and_the_bending_of_a_block() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "two-flags", "--paused"]);
    ctl(&sandbox, &["set", "bending", "0.25", "--block", "1"]);
    ctl(&sandbox, &["step"]);
    let prefix = format!("{}_", sandbox.domain());
    let root = format!("/tmp/catenary-{}-{}", rustix::process::getuid().as_raw(), sandbox.domain());
    let read = python(&sandbox, "read_live.py", &[&prefix, &root]);
    let last = read["parameters"].as_array().and_then(|all| all.last());
    assert_eq!(last, Some(&json!([Parameter::Bending as u32, 0, 1, 1, [0.25, 0.0, 0.0]])));
    let bends = read["bends"].as_array().unwrap();
    let scene = Scene::from_toml(builtin::text("two-flags").unwrap(), "two-flags").unwrap();
    let expected: Vec<_> = Solver::new(&scene).bends().collect();
    assert_eq!(bends.len(), expected.len());
    for (bend, expected) in bends.iter().zip(expected) {
        let Bend { particles, coefficients, rigidity, shape, block, .. } = expected;
        let fields = json!([particles, coefficients, rigidity, shape.number(), block.unwrap()]);
        assert_eq!(*bend, fields);
    }
}

/// A simulated recording, a live one and its completion attach the mesh of the bust, named by the hash of its content.
#[test]
#[ignore = "needs Python"]
fn the_stock_python_reader_finds_the_mesh_of_a_collider() {
    let sandbox = Sandbox::new();
    let [simulated, live, completed] =
        ["simulated", "live", "completed"].map(|name| sandbox.path(&format!("{name}.mcap")));
    let args = ["simulate", "covered-bust", "--steps", "1", "-o", &simulated];
    Process::run(Program::Recorder, &sandbox, &args).success();
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", "covered-bust"]);
    let recording = record(&sandbox, &live);
    recording.interrupt();
    node.interrupt();
    let scene = Scene::from_toml(builtin::text("covered-bust").unwrap(), "covered-bust").unwrap();
    let meshes = scene.collider_meshes();
    let mesh = meshes.values().next().unwrap();
    Process::run(Program::Recorder, &sandbox, &["simulate", &live, "-o", &completed]).success();
    for file in [simulated, live, completed] {
        let read = python(&sandbox, "read_attachments.py", &[&file]);
        let attachments = read["attachments"].as_object().unwrap();
        assert_eq!(attachments.len(), 1 + meshes.len(), "{:?}", attachments.keys());
        let (name, obj) = attachments.iter().find(|(name, _)| *name != "scene.toml").unwrap();
        assert_eq!(*name, format!("{}.obj", obj["hash"].as_str().unwrap()));
        let lists = read["colliders"].as_array().unwrap();
        let meshes = lists.iter().flat_map(|list| list.as_array().unwrap());
        let meshes: Vec<_> = meshes.filter(|one| one["shape"] == "mesh").collect();
        assert!(!meshes.is_empty());
        for one in meshes {
            assert_eq!((one["path"].as_str(), &one["solid"]), (Some(name.as_str()), &json!(false)));
        }
        let vertices: Vec<[f32; 3]> = serde_json::from_value(obj["vertices"].clone()).unwrap();
        assert_eq!(vertices, mesh.vertices);
        let faces: Vec<[u32; 3]> = serde_json::from_value(obj["faces"].clone()).unwrap();
        let corners: Vec<_> =
            mesh.triangles.iter().map(|one| one.map(|corner| corner + 1)).collect();
        assert_eq!(faces, corners);
        let verified = Process::run(Program::Recorder, &sandbox, &["verify", &file]).success();
        assert!(!verified.contains("attachment"), "{verified}");
    }
}

#[test]
#[ignore = "needs Python"]
fn a_client_that_knows_only_the_services_page_commands_a_node() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let recording = record(&sandbox, &file);
    let prefix = format!("{}_", sandbox.domain());
    let root = sandbox.root();
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sim-node/contract/SERVICES.md");
    let args = [&prefix, root.to_str().unwrap(), page.to_str().unwrap()];
    let outcomes = python(&sandbox, "foreign_client.py", &args);
    let expected = json!([
        ["grab", 0, "none"],
        ["pin", 1, "unknown_particle"],
        ["cut", 0, "none"],
        ["cut", 1, "already_torn"],
        ["pin", 0, "none"],
        ["pin", 1, "out_of_range"],
        ["load", 1, "out_of_range"],
    ]);
    assert_eq!(outcomes, expected);
    // The grab has ended with the client.
    let releases = || {
        let status = ctl(&sandbox, &["status"]);
        (status["outcomes"].as_u64() == Some(8)).then_some(())
    };
    wait_for("the release of the lost grab", releases);
    // The rejections are in the log, and the re-simulation rejects the same commands.
    assert_eq!(recording.interrupt().code, Some(0));
    let verified = Process::run(Program::Recorder, &sandbox, &["verify", &file]).success();
    assert!(verified.contains("steps bit-identical"), "{verified}");
}

#[test]
#[ignore = "needs Python"]
fn a_foreign_process_that_floods_ready_and_restore_changes_nothing() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    // A recording in the lockstep would be a member, too.
    let mut recording = Process::start(Program::Recorder, &sandbox, &["record", "-o", &file]);
    recording.wait_for_line("recording from step ");
    let prefix = format!("{}_", sandbox.domain());
    let root = format!("/tmp/catenary-{}-{}", rustix::process::getuid().as_raw(), sandbox.domain());
    let before = ctl(&sandbox, &["status"]);
    let flood = python(&sandbox, "flood.py", &[&prefix, &root, "10"]);
    assert!(flood["messages"].as_u64() > Some(1000), "{flood}");
    let after = ctl(&sandbox, &["status"]);
    assert!(after["step"].as_u64() > before["step"].as_u64(), "{after}");
    assert!(after["rejected_commands"].as_u64() > Some(100), "{after}");
    assert_eq!(after["lockstep"].as_array().map(Vec::len), Some(0), "{after}");
    // Every state is the one that the scene computes without the flood.
    ctl(&sandbox, &["pause"]);
    let finished = recording.interrupt();
    assert!(matches!(finished.code, Some(0 | 3)), "{}", finished.stderr);
    let verified = Process::run(Program::Recorder, &sandbox, &["verify", &file]).success();
    assert!(verified.contains("steps bit-identical"), "{verified}");
    assert!(!verified.contains("taken from the file"), "{verified}");
    assert_eq!(node.interrupt().code, Some(0));
}

/// Records a curtain that is cut, with its forces, exports it in a format, and requires that the reader of another project
/// finds `snapshot_count` snapshots with the recorded bits.
fn assert_export_is_read(format: &str, target: &str, snapshot_count: u64) {
    let lines = concat!(
        r#"{"step":20,"kind":"cut_radius","center":[0,1,0],"radius":0.15}"#,
        "\n",
        r#"{"step":30,"kind":"pin","particle":90}"#,
        "\n",
        r#"{"step":40,"kind":"mark","text":"gepinnt – ✓"}"#
    );
    assert_scene_is_read(&Sandbox::new(), ["curtain", lines], [format, target], snapshot_count);
}

fn assert_scene_is_read(
    sandbox: &Sandbox,
    [scene, commands]: [&str; 2],
    [format, target]: [&str; 2],
    snapshot_count: u64,
) {
    let (file, target) = (sandbox.path("run.mcap"), sandbox.path(target));
    let commands = sandbox.write("cut.jsonl", commands);
    let args = ["simulate", scene, "--steps", "60", "--commands", &commands, "--forces", "-o"];
    let args = [&args[..], &[&file, "--overwrite"]].concat();
    Process::run(Program::Recorder, sandbox, &args).success();
    let option = format!("--{format}");
    Process::run(Program::Recorder, sandbox, &["export", &file, &option, &target]).success();
    let read = python(sandbox, "read_export.py", &[format, &file, &target]);
    assert!(read["torn"].as_u64() > Some(5), "{read}");
    assert_eq!((&read["snapshots"], &read["recorded"]), (&json!(snapshot_count), &json!(61)));
}

#[test]
#[ignore = "needs Python"]
fn vtk_and_usd_read_the_quads_texture_coordinates_groups_and_materials_of_the_shirt_and_its_colliders()
 {
    let sandbox = Sandbox::new();
    let mesh = sandbox.write("shirt.obj", include_str!("../../examples/shirt.obj"));
    let args = ["import", &mesh, "--pin", "y > 1.45", "--bending", "1e-5"];
    let scene = Process::run(Program::SimNode, &sandbox, &args).success();
    let colliders = "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\n[[collider]]\n\
        shape = \"capsule\"\na = [-1, 0.5, 0]\nb = [1, 0.6, 0]\nradius = 0.1\nvelocity = [0, 0, 1]\n";
    let scene = sandbox.write("shirt.toml", &format!("{scene}{colliders}"));
    let cut = r#"{"step":20,"kind":"cut_radius","center":[0,1.1,0.1],"radius":0.08}"#;
    for (format, target) in [("vtk", "vtk"), ("obj", "obj"), ("usda", "run.usda")] {
        assert_scene_is_read(&sandbox, [&scene, cut], [format, target], 61);
    }
}

#[test]
#[ignore = "needs Python"]
fn numpy_and_the_csv_module_read_the_recorded_bits() {
    assert_export_is_read("npz", "run.npz", 61);
    assert_export_is_read("csv", "run.csv", 61);
}

#[test]
#[ignore = "needs Python"]
fn vtk_reads_the_recorded_bits_without_torn_constraints() {
    assert_export_is_read("vtk", "vtk", 61);
    assert_export_is_read("obj", "obj", 61);
}

#[test]
#[ignore = "needs Python"]
fn a_parser_of_pc2_and_the_library_of_usd_read_the_recorded_bits() {
    assert_export_is_read("pc2", "run.pc2", 61);
    assert_export_is_read("usda", "run.usda", 61);
}

#[test]
#[ignore = "needs Python"]
fn the_stock_python_reader_finds_every_message_and_the_scene_in_a_copy_for_viewers() {
    // Steps 0 to 60 at 240 Hz, each eighth one.
    assert_export_is_read("foxglove", "scene.mcap", 8);
}

#[test]
#[ignore = "needs Python"]
fn the_decoders_of_ros_2_read_the_recorded_bits_upright() {
    assert_export_is_read("ros2", "bag", 61);
}
