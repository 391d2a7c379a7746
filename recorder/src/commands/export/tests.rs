//! From a recording to pictures: the drawn shapes, equal output for equal input, and incomplete
//! recordings.

mod data;

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Parser;
use recording::pictures::{
    Basis, Camera, ExtentTracker, Picture, Renderer, Shape, encode_png, encode_svg,
};
use recording::simulation::{Job, States, simulate};
use recording::{
    Closing, Existing, LogOptions, LogWriter, Message, RecordedState, RunDescription, StepRow, Up,
};
use sim_contract::{ConstraintState, ParticleFlags, ParticleState, TornConstraint, Triangle};
use sim_solver::{Scene, Solver};

use super::*;

/// A square of cloth in front of a sphere and above a floor, with a pinned particle at its side.
const TINY: &str = r#"
    version = 1
    name = "tiny"
    [[collider]]
    shape = "sphere"
    center = [0.5, -0.5, 0.0]
    radius = 0.5
    [[collider]]
    shape = "plane"
    normal = [0, 1, 0]
    offset = -1.05
    [[particle]]
    position = [2.0, 0.0, 0.0]
    pinned = true
    [[constraint]]
    particles = [0, 2]
    [[constraint]]
    particles = [0, 4]
    kind = "tether"
    [[generate]]
    shape = "cloth"
    columns = 2
    rows = 2
    spacing = 1.0
    origin = [0.0, 0.0, 0.0]
    links = ["structural", "shear", "bend"]
"#;

fn run_at(rate_hz: u32) -> RunDescription {
    RunDescription {
        run_id: 1,
        scene_name: "tiny".to_owned(),
        rate_hz,
        ..RunDescription::default()
    }
}

fn record(scene: &str, steps: u64) -> Vec<u8> {
    let text = Scene::from_toml(scene, "test").unwrap().to_toml();
    record_with_text(scene, steps, &text)
}

/// Records a scene, with another text in its place.
fn record_with_text(scene: &str, steps: u64, text: &str) -> Vec<u8> {
    let job = Job::new(Scene::from_toml(scene, "test").unwrap(), Vec::new(), steps);
    let solver = Solver::new(&job.scene);
    let run = job.description(&solver);
    let options = LogOptions { chunk_size_bytes: 2000, ..LogOptions::default() };
    let mut log = LogWriter::create(Vec::new(), options, &run, text.as_bytes(), 0).unwrap();
    simulate(&job, States::first(solver), Some(&mut log), &AtomicBool::new(false), |_| {}).unwrap();
    log.finish(&Closing::default()).unwrap()
}

/// Records a scene with commands from a file.
fn record_commands(scene: &str, commands: &str, steps: u64) -> Vec<u8> {
    let scene = Scene::from_toml(scene, "test").unwrap();
    let commands = recording::parse_commands(commands, "test").unwrap();
    let job = Job::new(scene, commands, steps);
    let solver = Solver::new(&job.scene);
    let (run, toml) = (job.description(&solver), job.scene.to_toml());
    let options = LogOptions::default();
    let mut log = LogWriter::create(Vec::new(), options, &run, toml.as_bytes(), 0).unwrap();
    simulate(&job, States::first(solver), Some(&mut log), &AtomicBool::new(false), |_| {}).unwrap();
    log.finish(&Closing::default()).unwrap()
}

const OPTIONS: PictureOptions = PictureOptions {
    size: Size { width: 160, height: 120 },
    view: Some(View::Front),
    style: Style::Wires(Bend::Draw),
};

/// Calls `work` with the snapshots of `steps` of a recording, or with all of them.
fn with_snapshots<T>(
    file: &[u8],
    steps: Option<&[u64]>,
    work: impl FnOnce(&Snapshots<'_>) -> T,
) -> T {
    let survey = survey_of(file, "test.mcap");
    let steps = steps.unwrap_or(&survey.steps);
    let visit = |visitor: &mut dyn FnMut(&SceneState) -> anyhow::Result<ControlFlow<()>>| {
        let mut states = SceneStates::new(LogReader::new(file)?);
        for step in steps {
            let Some(state) = states.next_from(*step)? else { break };
            if visitor(state)?.is_break() {
                break;
            }
        }
        Ok(())
    };
    let bytes = file.to_vec();
    let open_bytes = || Ok(Box::new(Cursor::new(bytes.clone())) as Box<dyn Read>);
    work(&survey.snapshots(steps, &visit, &open_bytes))
}

fn survey_of(file: &[u8], path: &str) -> Survey {
    Survey::read(LogReader::new(file).unwrap(), path, |_| {}).unwrap()
}

fn pictures(file: &[u8], steps: &[u64], options: PictureOptions) -> Vec<Picture> {
    with_snapshots(file, Some(steps), |snapshots| {
        let renderer = pictures::renderer(snapshots, options).unwrap();
        let mut pictures = Vec::new();
        snapshots
            .for_each(|state| {
                pictures.push(renderer.draw(state, snapshots.time_s(state.row.step)));
                Ok(())
            })
            .unwrap();
        pictures
    })
}

#[test]
fn a_tiny_scene_is_drawn_from_back_to_front() {
    let picture = &pictures(&record(TINY, 0), &[0], OPTIONS)[0];
    insta::assert_snapshot!(encode_svg(picture));
}

#[test]
fn the_same_recording_gives_the_same_bytes() {
    let file = record(TINY, 40);
    let draw = |view| {
        let options = PictureOptions { view, ..OPTIONS };
        let pictures = pictures(&file, &[0, 20, 40], options);
        let pngs: Vec<_> = pictures.iter().map(|picture| encode_png(picture).unwrap()).collect();
        (pictures.iter().map(encode_svg).collect::<Vec<_>>(), pngs)
    };
    let (svgs, pngs) = draw(None);
    assert_eq!(draw(None), (svgs.clone(), pngs.clone()));
    assert!(svgs[0] != svgs[2] && pngs[0] != pngs[2], "nothing moves");
}

#[test]
fn a_png_has_the_size_that_was_asked_for_and_several_colors() {
    let bytes = encode_png(&pictures(&record(TINY, 0), &[0], OPTIONS)[0]).unwrap();
    let mut reader = ::png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((frame.width, frame.height), (160, 120));
    let mut counts = BTreeMap::new();
    for pixel in pixels[..frame.buffer_size()].chunks_exact(4) {
        *counts.entry(pixel).or_insert(0) += 1;
    }
    assert!(counts.len() > 10, "{} colors", counts.len());
    assert!(counts.values().all(|count| *count < 160 * 120 * 9 / 10));
}

#[test]
fn the_frames_of_an_animation_are_the_pictures() {
    let file = record(TINY, 40);
    let path = std::env::temp_dir().join(format!("recorder-apng-{}.png", std::process::id()));
    // Half as fast as the run.
    let frame_time = Duration::from_millis(20);
    let pace = FramePace { frame_time, period: Some(frame_time / 2) };
    let rate_hz = with_snapshots(&file, Some(&[0, 20, 23]), |snapshots| {
        pictures::animate(snapshots, OPTIONS, pace, &path, Existing::Refuse).unwrap();
        f64::from(snapshots.run.rate_hz)
    });
    let bytes = fs::read(&path).unwrap();
    fs::remove_file(&path).unwrap();
    let mut reader = ::png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
    let control = *reader.info().animation_control().unwrap();
    assert_eq!((control.num_frames, control.num_plays), (3, 0));
    let expected_ms =
        [20.0, 3.0].map(|steps| 2.0 * 1000.0 * steps / rate_hz).into_iter().chain([20.0]);
    let mut shown = vec![0; reader.output_buffer_size().unwrap()];
    let mut stored_sizes = Vec::new();
    for (picture, expected_ms) in
        pictures(&file, &[0, 20, 23], OPTIONS).into_iter().zip(expected_ms)
    {
        let mut part = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut part).unwrap();
        let delay = reader.info().frame_control().unwrap();
        let (row_bytes, part_bytes) = (3 * OPTIONS.size.width as usize, 3 * delay.width as usize);
        stored_sizes.push(delay.width * delay.height);
        let first = delay.y_offset as usize * row_bytes + delay.x_offset as usize * 3;
        for (row, pixels) in part.chunks_exact(part_bytes).take(delay.height as usize).enumerate() {
            shown[first + row * row_bytes..][..part_bytes].copy_from_slice(pixels);
        }
        let delay_ms = 1000.0 * f64::from(delay.delay_num) / f64::from(delay.delay_den);
        assert!((delay_ms - expected_ms).abs() <= 1.0, "{delay_ms} {expected_ms}");
        let single = encode_png(&picture).unwrap();
        let mut single = ::png::Decoder::new(Cursor::new(single)).read_info().unwrap();
        let mut pixels = vec![0; single.output_buffer_size().unwrap()];
        single.next_frame(&mut pixels).unwrap();
        let rgb: Vec<u8> =
            pixels.chunks_exact(4).flat_map(|pixel| pixel[..3].iter().copied()).collect();
        let is_near = |(shown, exact): (&u8, &u8)| shown.abs_diff(*exact) <= 7;
        assert!(shown.len() == rgb.len() && shown.iter().zip(&rgb).all(is_near));
    }
    let [first, later @ ..] = stored_sizes.as_slice() else { panic!("no frame") };
    assert!(later.iter().all(|size| size < first), "{stored_sizes:?}: only what changes is stored");
}

/// Four particles in a square, two triangles with the edges 0-1, 1-2, 2-0 and 1-3, 3-2, and a
/// diagonal of another kind across.
fn square() -> SceneState {
    let places = [[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
    let constraint =
        |(a, b, kind)| ConstraintState { a, b, rest_length: 1.0, compliance: 0.0, kind };
    let edges = [(0, 1, 0), (0, 2, 0), (1, 3, 0), (2, 3, 0), (1, 2, 1)];
    let particles =
        places.map(|position| ParticleState { position, ..ParticleState::default() }).to_vec();
    SceneState {
        recorded: RecordedState { particles: particles.into(), ..RecordedState::default() },
        constraints: edges.map(constraint).to_vec(),
        is_torn: vec![false; edges.len()],
        triangles: [[0, 1, 2], [1, 3, 2]].map(|corners| Triangle { corners }).to_vec(),
        ..SceneState::default()
    }
}

fn particles(state: &mut SceneState) -> &mut Vec<ParticleState> {
    Arc::make_mut(&mut state.particles)
}

fn draw(state: &SceneState) -> Picture {
    draw_in(Style::Wires(Bend::Draw), state)
}

fn draw_in(style: Style, state: &SceneState) -> Picture {
    let mut tracker = ExtentTracker::default();
    tracker.add(state);
    let (extent, size) = (tracker.extent(), OPTIONS.size);
    let camera = Camera::fit(Basis::new(View::Front, Up::Y), &extent, size);
    let scene_name = "square".to_owned();
    Renderer { camera, extent, size, style, scene_name }.draw(state, 0.0)
}

/// Returns the numbers of polygons, lines and dots.
fn counts(picture: &Picture) -> [usize; 3] {
    let count = |is: fn(&Shape) -> bool| picture.shapes.iter().filter(|shape| is(shape)).count();
    [
        count(|shape| matches!(shape, Shape::Polygon { .. })),
        count(|shape| matches!(shape, Shape::Segment { .. })),
        count(|shape| matches!(shape, Shape::Circle { .. })),
    ]
}

#[test]
fn torn_constraints_and_triangles_with_a_torn_side_are_left_out() {
    let mut state = square();
    // A second constraint along the edge from 1 to 3.
    state.constraints.push(ConstraintState { a: 3, b: 1, ..state.constraints[0] });
    for (torn, expected) in [
        (&[][..], [2, 6, 4]),
        (&[2], [2, 5, 4]),
        (&[2, 5], [1, 4, 4]),
        (&[2, 5, 0], [0, 3, 4]),
        (&[4], [0, 5, 4]),
        (&[5], [2, 5, 4]),
    ] {
        state.torn = torn.iter().map(|index| TornConstraint::new(*index, None)).collect();
        state.update_torn().unwrap();
        assert_eq!(counts(&draw(&state)), expected, "{torn:?}");
    }
}

/// The square stands at an angle to the light, and a rope and a loose particle beside it.
#[test]
fn a_shaded_surface_has_neither_wires_nor_dots_and_a_rope_keeps_its_line() {
    let mut state = square();
    particles(&mut state)[0].flags = ParticleFlags::PINNED;
    let picture = draw_in(Style::Shaded, &state);
    assert_eq!(counts(&picture), [2, 0, 0]);
    assert!(!picture.shapes.iter().any(|one| matches!(one, Shape::Text(_))), "it has a caption");
    for x in [2.0, 3.0, 4.0] {
        particles(&mut state)
            .push(ParticleState { position: [x, 0.0, 0.0], ..ParticleState::default() });
    }
    state.constraints.push(ConstraintState { a: 3, b: 4, ..state.constraints[0] });
    state.constraints.push(ConstraintState { a: 4, b: 5, ..state.constraints[0] });
    state.is_torn.extend([false, false]);
    assert_eq!(counts(&draw_in(Style::Shaded, &state)), [2, 2, 1]);
    assert_eq!(counts(&draw(&state)), [3, 7, 6]);
    // The two triangles are bent against each other, and share the brightness of their corners.
    particles(&mut state)[3].position[2] = 1.0;
    let fills = |picture: &Picture| {
        let fill = |shape: &Shape| match shape {
            Shape::Polygon { fill, .. } => Some(*fill),
            _ => None,
        };
        picture.shapes.iter().filter_map(fill).take(2).collect::<Vec<_>>()
    };
    let [flat, smooth] = [Style::Wires(Bend::Draw), Style::Shaded]
        .map(|style| fills(&draw_in(style, &state)))
        .map(|fills| fills[0].0[0].abs_diff(fills[1].0[0]));
    assert!(smooth < flat, "{smooth} {flat}");
}

#[test]
fn pinned_particles_are_squares_and_non_finite_ones_are_left_out() {
    let mut state = square();
    particles(&mut state)[0].flags = ParticleFlags::PINNED;
    assert_eq!(counts(&draw(&state)), [3, 5, 3]);
    particles(&mut state)[3].position = [f32::NAN, f32::INFINITY, 1e30];
    assert_eq!(counts(&draw(&state)), [2, 3, 2]);
    assert!(encode_png(&draw(&state)).is_ok());
}

#[test]
fn lines_behind_a_triangle_are_hidden_and_lines_on_it_are_not() {
    let mut state = square();
    // A second square behind the first one.
    let mut behind = square();
    for (index, particle) in particles(&mut behind).iter_mut().enumerate() {
        particle.position[2] = if index == 0 { -1.0 } else { -2.0 };
    }
    particles(&mut state).extend(behind.particles.iter());
    state.constraints.push(ConstraintState { a: 5, b: 6, ..state.constraints[0] });
    state.is_torn.push(false);
    state.triangles.push(Triangle { corners: [4, 5, 6] });
    let picture = draw(&state);
    let places = |is: fn(&Shape) -> bool| -> Vec<usize> {
        let shapes = picture.shapes.iter().enumerate();
        shapes.filter(|(_, shape)| is(shape)).map(|(place, _)| place).collect()
    };
    let triangles = places(|shape| matches!(shape, Shape::Polygon { .. }));
    let lines = places(|shape| matches!(shape, Shape::Segment { .. }));
    assert_eq!(triangles[0], 0);
    assert!(lines[0] < triangles[1], "the line behind comes before the nearer triangles");
    // Line 0-1 touches both triangles and comes after the second one.
    assert!(lines[1] > triangles[1]);
}

#[test]
fn a_reset_restores_torn_constraints() {
    let reset = r#"{"step":10,"kind":"cut","constraint":0}
        {"step":20,"kind":"reset"}"#;
    let file = record_commands(TINY, reset, 30);
    let lines: Vec<_> =
        pictures(&file, &[9, 10, 19, 20], OPTIONS).iter().map(|one| counts(one)[1]).collect();
    assert_eq!(lines, [8, 7, 7, 8]);
}

/// Without a scene, y is up.
#[test]
fn a_recording_without_a_scene_is_drawn() {
    let mut log =
        LogWriter::create(Vec::new(), LogOptions::default(), &run_at(100), b"", 0).unwrap();
    let row = StepRow { step: 3, ..StepRow::default() };
    let particles = square().particles.to_vec();
    log.write(&Message::Step(row), 0).unwrap();
    log.write(&Message::Particles { step: 3, particles }, 0).unwrap();
    let file = log.finish(&Closing::default()).unwrap();
    let survey = survey_of(&file, "a.mcap");
    assert_eq!(survey.scene.unwrap_err(), "a.mcap: has no scene (attachment scene.toml)");
    assert_eq!(survey.steps, [3]);
    assert_eq!(counts(&pictures(&file, &[3], OPTIONS)[0]), [0, 0, 4]);
}

#[test]
fn a_truncated_recording_is_drawn_as_far_as_it_goes() {
    let file = record(TINY, 200);
    let cut = &file[..file.len() / 2];
    let survey = survey_of(cut, "test");
    assert!(matches!(survey.end, LogEnd::Truncated { .. }), "{}", survey.end);
    let last = *survey.steps.last().unwrap();
    assert!(last > 10 && last < 190, "{last}");
    assert_eq!(pictures(cut, &[last], OPTIONS), pictures(&file, &[last], OPTIONS));
}

#[test]
fn indices_of_missing_particles_are_an_error() {
    let refused = |change: fn(&mut SceneState)| {
        let mut state = square();
        change(&mut state);
        state.check_indices().unwrap_err().to_string()
    };
    let expected =
        "the snapshot of step 0 has 4 particles, but /topology or /surface refers to particle 9";
    assert_eq!(refused(|state| state.constraints[0].b = 9), expected);
    assert_eq!(refused(|state| state.triangles[1].corners[2] = 9), expected);
}

#[derive(Debug, Parser)]
struct Line {
    #[command(flatten)]
    args: ExportArgs,
}

fn parse(line: &str) -> Result<ExportArgs, String> {
    let words = ["export"].into_iter().chain(line.split(' '));
    Line::try_parse_from(words).map(|line| line.args).map_err(|error| error.to_string())
}

#[test]
fn the_error_names_a_wrong_option() {
    for (line, word) in [
        ("a.mcap", "--png"),
        ("a.mcap --png d --svg d", "cannot be used with"),
        ("a.mcap --png d --every 1s --frames 3", "cannot be used with"),
        ("a.mcap --png d --every 0s", "it must be a time longer than 0s"),
        ("a.mcap --png d --frames 0", "--frames"),
        ("a.mcap --png d --size 960", "it must be WIDTHxHEIGHT with sides from 16 to 8192"),
        ("a.mcap --png d --size 960x9000", "it must be WIDTHxHEIGHT"),
        ("a.mcap --png d --from soon", "it must be a step, such as 480, or a time with its unit"),
        ("a.mcap --png d --at 1s --from 2s", "cannot be used with"),
        ("a.mcap --png d --npz f", "cannot be used with"),
        ("a.mcap --foxglove b.mcap --from 1s", "cannot be used with"),
        ("a.mcap --foxglove b.mcap --to 480", "cannot be used with"),
        ("a.mcap --foxglove b.mcap --frames 3", "cannot be used with"),
        ("a.mcap --foxglove b.mcap --at 1s", "cannot be used with"),
        ("a.mcap --apng f --fps 0", "it must be a whole number from 1 to 100"),
        ("a.mcap --png d --view below", "front, side, top, iso"),
    ] {
        let error = parse(line).unwrap_err();
        assert!(error.contains(word), "{line}: {error}");
    }
}

#[test]
fn an_option_that_the_format_ignores_is_refused() {
    for (line, refused) in [
        ("a.mcap --png d --fps 30", Some("--fps has an effect only on --apng, --obj, --vtk")),
        ("a.mcap --npz f --fps 30", Some("--fps")),
        ("a.mcap --usda f --fps 30", None),
        ("a.mcap --usda f --fps 30 --every 1s", Some("remove --every, --frames and --at")),
        ("a.mcap --obj f --fps 30 --at 1s", Some("--fps selects the frames")),
        ("a.mcap --npz f --size 20x30", Some("--size has an effect only on pictures")),
        ("a.mcap --obj d --view top", Some("--view")),
        ("a.mcap --obj d --no-bend", Some("--no-bend")),
        ("a.mcap --apng f --fps 30 --size 20x30 --view top --no-bend", None),
        ("a.mcap --svg d --size 20x30", None),
        ("a.mcap --npz f", None),
    ] {
        let error = parse(line).unwrap().check().err().map(|error| error.to_string());
        match (&error, refused) {
            (Some(error), Some(word)) => assert!(error.contains(word), "{line}: {error}"),
            (found, refused) => assert_eq!(found.is_some(), refused.is_some(), "{line}"),
        }
    }
}

#[test]
fn an_animation_keeps_the_pace_of_a_sparse_recording() {
    let pace = |line| parse(line).unwrap().pace();
    let delays_ms = |pace: FramePace| {
        let delays = pace.delays(&[0.0, 0.1, 0.5, 0.54]);
        delays.iter().map(|delay| (delay.as_secs_f64() * 1000.0).round()).collect::<Vec<_>>()
    };
    assert_eq!(delays_ms(pace("a.mcap --apng f")), [100.0, 400.0, 40.0, 40.0]);
    assert_eq!(delays_ms(pace("a.mcap --apng f --fps 10")), [100.0, 400.0, 40.0, 100.0]);
    let twice_as_fast = pace("a.mcap --apng f --fps 50 --every 40ms");
    assert_eq!(delays_ms(twice_as_fast), [50.0, 200.0, 20.0, 20.0]);
    assert_eq!(delays_ms(pace("a.mcap --apng f --frames 4 --fps 20")), [50.0; 4]);
}

#[test]
fn options_select_the_snapshots_and_the_style() {
    let selection = |line| {
        let args = parse(line).unwrap();
        args.selection(&args.format.format().unwrap())
    };
    assert_eq!(selection("a.mcap --svg d").choice, Choice::Spread(8));
    assert_eq!(selection("a.mcap --npz d").choice, Choice::All);
    let period = Choice::Every(Duration::from_millis(20));
    assert_eq!(selection("a.mcap --foxglove b.mcap").choice, Choice::Every(SCENE_PERIOD));
    assert_eq!(selection("a.mcap --foxglove b.mcap --every 20ms").choice, period);
    assert_eq!(selection("a.mcap --apng f --fps 50").choice, period);
    assert_eq!(selection("a.mcap --svg d --frames 3").choice, Choice::Spread(3));
    let times = [1000, 500].map(Duration::from_millis).to_vec();
    assert_eq!(selection("a.mcap --svg d --at 1s --at 500ms").choice, Choice::At(times));
    let range = selection("a.mcap --csv d --from 480 --to 2s").range;
    let to = Moment::Time(Duration::from_secs(2));
    assert_eq!(range, SnapshotRange { from: Some(Moment::Step(480)), to: Some(to) });
    let args = parse("a.mcap --svg d --size 20x30 --no-bend --view top").unwrap();
    let options = args.picture_options();
    assert_eq!((options.size, options.view), (Size { width: 20, height: 30 }, Some(View::Top)));
    assert_eq!(options.style, Style::Wires(Bend::Hide));
    let shaded = parse("a.mcap --svg d --style shaded").unwrap();
    assert_eq!(shaded.picture_options().style, Style::Shaded);
}

#[test]
fn a_warning_about_the_scene_names_the_meshes_that_are_in_it_alone() {
    let mesh = "version = 1\n[[collider]]\nshape = \"mesh\"\nfaces = [[0, 1, 2]]\n\
         vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\n[[particle]]\nposition = [0, 0, 1]\n";
    let warning = |file: &[u8]| survey_of(file, "test.mcap").warning();
    assert_eq!(warning(&record(mesh, 0)), None);
    let reason = "warning: test.mcap: has no scene (attachment scene.toml); exported with y up";
    assert_eq!(warning(&record_with_text(TINY, 0, "")).unwrap(), reason);
    let expected = format!("{reason}, and without the colliders that are meshes");
    assert_eq!(warning(&record_with_text(mesh, 0, "")).unwrap(), expected);
}

#[test]
fn files_without_a_snapshot_are_an_error() {
    let folder = std::env::temp_dir().join(format!("recorder-export-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let (path, pictures) = (folder.join("a.mcap"), folder.join("pictures"));
    let error_for = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        let line = format!("{} --png {}", path.display(), pictures.display());
        let error = run(&parse(&line).unwrap()).unwrap_err();
        assert!(!pictures.exists());
        format!("{error:#}").replace(&path.display().to_string(), "a.mcap")
    };
    let empty = LogWriter::create(Vec::new(), LogOptions::default(), &run_at(100), b"", 0);
    let empty = empty.unwrap().finish(&Closing::default()).unwrap();
    assert_eq!(error_for(&empty), "a.mcap: has no snapshot to export");
    assert_eq!(
        error_for(b"a text of some length, and no recording"),
        "a.mcap: is not an MCAP file"
    );
    let whole = record(TINY, 0);
    assert!(
        error_for(&whole[..whole.len() / 8]).starts_with("a.mcap: has no"),
        "no head, or no step"
    );
    fs::remove_dir_all(&folder).unwrap();
}
