//! Memory to read a scene: no text of the largest size takes more than a fixed amount beyond the scene
//! itself. And memory to measure forces: none for what is not in contact. A counting allocator measures the peak.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use sim_solver::{Scene, SceneError, Solver};
use sim_types::SCENE_SIZE_BYTES_MAX;

/// Most memory that reading may take beyond the scene, in bytes.
const MEMORY_MAX: usize = 256 << 20;

struct Counting;

thread_local! {
    /// Bytes that this thread has allocated and not freed. Reading a scene uses one thread.
    static LIVE: Cell<usize> = const { Cell::new(0) };
    /// Largest value of `LIVE` since the last reset.
    static PEAK: Cell<usize> = const { Cell::new(0) };
}

fn add(size: usize) {
    let live = LIVE.get().wrapping_add(size);
    LIVE.set(live);
    PEAK.set(PEAK.get().max(live));
}

fn subtract(size: usize) {
    LIVE.set(LIVE.get().wrapping_sub(size));
}

// SAFETY: every call is forwarded to the system's allocator unchanged. Counting touches none of its memory.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        add(layout.size());
        // SAFETY: the caller upholds the contract of `alloc`, which is the system's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        subtract(layout.size());
        // SAFETY: the pointer came from `System.alloc` with this layout.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        subtract(layout.size());
        add(size);
        // SAFETY: the pointer came from `System.alloc` with this layout, and the caller upholds the
        // contract of `realloc`, which is the system's.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Reads a text. Checks the most memory that this takes beyond the scene.
fn read(text: &str) -> Result<Scene, SceneError> {
    let before = LIVE.get();
    PEAK.set(before);
    let result = Scene::from_toml(text, "f");
    let scene = if result.is_ok() { LIVE.get() - before } else { 0 };
    let memory = PEAK.get() - before - scene;
    let start = &text[..text.floor_char_boundary(200)];
    assert!(memory <= MEMORY_MAX, "{} MiB: {result:.200?}: {start}", memory >> 20);
    result
}

/// Returns the problem of a text that is refused.
fn problem(text: &str) -> String {
    read(text).unwrap_err().first().problem.clone()
}

/// Replaces the `@` of a text by as many copies of a part as the largest text allows. The `#` of a copy
/// becomes its number from 1 on.
fn longest(text: &str, part: &str) -> String {
    let copy = |number: usize| part.replace('#', &number.to_string());
    let count = (SCENE_SIZE_BYTES_MAX - text.len()) / copy(9_999_999).len();
    text.replacen('@', &(1..=count).map(copy).collect::<String>(), 1)
}

const PAIR: &str =
    "version = 1\n[[particle]]\nposition = [0, 0, 0]\n[[particle]]\nposition = [1, 0, 0]\n@";
const ROPE: &str = "version = 1\n[[generate]]\nshape = \"rope\"\ncount = 1_000_000\n\
    from = [0, 0, 0]\nto = [1, 0, 0]\n@";
const ANCHOR: &str = "[[anchor]]\nparticles = [0]\n@";
const MESH: &str =
    "version = 1\n[[generate]]\nshape = \"obj\"\nvertices = [VERTICES]\nfaces = [@]\n";

/// Part of the problem of a text whose parts are counted.
const COMPLETE_TEXT: &str = "bytes of text with every default and mesh written out";
const TOO_MUCH: &str = "MiB to parse";

#[test]
fn the_largest_complete_texts_with_many_tables_are_read() {
    let particle = "[[particle]]\nposition = [0.0, 0.0, 0.0]\nmass = 1.0\npinned = false\n\
        velocity = [0.0, 0.0, 0.0]\n\n";
    let constraint = "[[constraint]]\nparticles = [0, 1]\nrest_length = 1.0\nkind = \"structural\"\n\
        compliance = 0.0\n\n";
    let ragdoll = "[[generate]]\nshape = \"ragdoll\"\norigin = [0.0, 0.0, 0.0]\nheight = 1.0\n\
        mass = 1.0\npinned = \"none\"\n\n[generate.compliance]\nstructural = 0.0\nshear = 0.0\n\
        bend = 0.0\n\n";
    let anchor =
        "[[anchor]]\nparticles = [#]\norigin = [0.0, 0.0, 0.0]\nrepeat = false\npath = []\n";
    let point = "[[anchor.path]]\ntime = #.0\ntranslation = [0.0, 0.0, 0.0]\n\
        rotation = [0.0, 0.0, 0.0, 1.0]\n\n";
    let path = ROPE.replace('@', ANCHOR);
    for (text, part) in
        [(PAIR, particle), (PAIR, constraint), (PAIR, ragdoll), (ROPE, anchor), (&path, point)]
    {
        // Room for the defaults of the scene in the complete text.
        let text = longest(&format!("#{}\n{text}", "-".repeat(1000)), part);
        let size_bytes = read(&text).unwrap().to_toml().len();
        assert!(size_bytes > SCENE_SIZE_BYTES_MAX * 8 / 10, "{size_bytes}: {part}");
    }
}

#[test]
fn the_largest_complete_texts_with_long_lists_are_read() {
    let pinned = ROPE.replace("1_000_000", "10_000_000").replace('@', "pinned = [@]\n");
    assert!(read(&longest(&pinned, "#, ")).is_ok());
    let vertices = "[0.0, 0.0, 0.0], ".repeat(400_000);
    let mesh = format!("#{}\n{}", "-".repeat(1000), MESH.replace("VERTICES", &vertices));
    let faces = (1..480_000).map(|corner| format!("[0, {}, 399999], ", corner % 399_998 + 1));
    let mesh = mesh.replace('@', &faces.collect::<String>());
    let counts = read(&mesh).unwrap().counts();
    assert_eq!((counts.particles, counts.triangles), (400_000, 479_999));
}

#[test]
fn the_most_particles_are_read_beside_the_longest_complete_text() {
    let sheet = "version = 1\n[solver]\nsubsteps = 1\n[[generate]]\nshape = \"cloth\"\n\
        columns = 4096\nrows = 4096\nspacing = 1e-3\nlinks = []\n@";
    let sheet = format!("#{}\n{sheet}", "-".repeat(1000));
    let constraint = "[[constraint]]\nparticles = [0, 1]\nrest_length = 0.0\nkind = \"bend\"\n\
        compliance = 0.0\n\n";
    assert_eq!(read(&longest(&sheet, constraint)).err(), None);
    let problem = problem(&longest(&sheet, "[[constraint]]\nparticles=[0,1]\n"));
    assert!(problem.contains(COMPLETE_TEXT), "{problem}");
}

/// Many edges between few vertices: each has two faces, and so two bends.
#[test]
fn a_dense_mesh_is_read() {
    let vertices = "[0, 0, 0], ".repeat(1999);
    let faces = (0..850_000).map(|face| {
        let (corner, distance) = (face % 1999, face / 1999 + 1);
        format!("[{corner}, {}, {}], ", (corner + distance) % 1999, (corner + 2 * distance) % 1999)
    });
    let mesh = MESH.replace("VERTICES", &vertices).replace('@', &faces.collect::<String>());
    assert!(read(&mesh).is_ok());
}

/// Checks that the estimate of a scene is at least the memory of its solver, and that without its margin it is at most
/// 1.6 times as much.
fn check_estimate(kind: &str, text: &str) {
    let scene = Scene::from_toml(&format!("version = 1\n{text}"), kind).unwrap();
    let before = LIVE.get();
    PEAK.set(before);
    let mut solver = Solver::new(&scene);
    solver.step();
    solver.compute_forces(true);
    solver.finish_boundary();
    solver.step();
    let needed_bytes = (PEAK.get() - before) as u64;
    let estimate_bytes = scene.memory_bytes();
    let count = solver.particle_count();
    let numbers = format!("{kind} of {count} particles: {needed_bytes}, {estimate_bytes} bytes");
    assert!(estimate_bytes >= needed_bytes, "{numbers}");
    let without_margin_bytes = (estimate_bytes - (8 << 20)) / 9 * 8;
    assert!(without_margin_bytes <= needed_bytes * 8 / 5, "{numbers}");
}

#[test]
fn the_estimated_memory_of_a_scene_is_at_least_that_of_its_solver_and_not_much_more() {
    let sheet = |shape: &str, columns: u32, rows: u32| {
        format!(
            "[[generate]]\nshape = \"{shape}\"\ncolumns = {columns}\nrows = {rows}\nspacing = 0.01\n"
        )
    };
    let contact = |mode: &str| format!("[contact]\nmode = \"{mode}\"\nthickness = 0.006\n");
    let rope = |count: u32| {
        format!(
            "[[generate]]\nshape = \"rope\"\ncount = {count}\nfrom = [0, 0, 0]\nto = [1, 0, 0]\n"
        )
    };
    let dolls = |count: u32| {
        let doll = |at: u32| {
            format!("[[generate]]\nshape = \"ragdoll\"\nheight = 1\norigin = [{at}, 0, 0]\n")
        };
        (0..count).map(doll).collect::<String>()
    };
    let [particles, surfaces] = ["particles", "surfaces"].map(contact);
    for size in [3, 20, 130, 400] {
        check_estimate("a cloth", &sheet("cloth", size, size));
        check_estimate("a mesh", &sheet("mesh", size, size));
        check_estimate("a touching cloth", &format!("{particles}{}", sheet("cloth", size, size)));
        check_estimate("a cloth of surfaces", &format!("{surfaces}{}", sheet("cloth", size, size)));
        check_estimate("a bent cloth", &format!("{}bending = 1e-4\n", sheet("cloth", size, size)));
        check_estimate("a rope", &rope(size * size));
        check_estimate("a touching rope", &format!("{particles}{}", rope(size * size)));
        check_estimate("ragdolls", &dolls(size * 5));
        check_estimate("touching ragdolls", &format!("{particles}{}", dolls(size * 5)));
    }
    for columns in [2, 3, 9, 17] {
        check_estimate("a ribbon", &sheet("cloth", columns, 20_000 / columns));
        let ribbon = sheet("cloth", columns, 20_000 / columns);
        check_estimate("a touching ribbon", &format!("{particles}{ribbon}"));
        check_estimate("a ribbon of surfaces", &format!("{surfaces}{ribbon}"));
    }
    let cloth = sheet("cloth", 200, 200);
    for solver in ["tethers = true", "order = \"listed\"", "iterations = 3"] {
        check_estimate(solver, &format!("[solver]\n{solver}\n{cloth}"));
    }
    check_estimate("wind", &format!("[wind]\nvelocity = [1, 0, 0]\ndrag = 1\n{cloth}"));
    let collider = "[[collider]]\nshape = \"box\"\ncenter = [0, -5, 0]\nhalf_extents = [1, 1, 1]\n";
    check_estimate(
        "a body",
        &format!("{cloth}{collider}body = {{ mass = 1, inertia = [1, 1, 1] }}\n"),
    );
    check_estimate("short ropes", &rope(10).repeat(1000));
}

/// The cloth has 2,000 rows of three groups of particles, above 500 colliders.
#[test]
fn forces_take_no_memory_for_rows_and_colliders_that_do_not_touch() {
    let ball =
        |at| format!("[[collider]]\nshape = \"sphere\"\ncenter = [{at}, -9, 0]\nradius = 0.4\n");
    let text =
        "version = 1\n[solver]\nsubsteps = 2\n[[generate]]\nshape = \"cloth\"\ncolumns = 24\n\
        rows = 2000\nspacing = 0.01\nright = [0, 0, 1]\ndown = [1, 0, 0]\n"
            .to_owned();
    let text = (0..500).fold(text, |text, at| text + &ball(at));
    let mut solver = Solver::new(&Scene::from_toml(&text, "f").unwrap());
    solver.step();
    let before = LIVE.get();
    PEAK.set(before);
    solver.compute_forces(true);
    solver.finish_boundary();
    solver.step();
    let memory = PEAK.get() - before;
    assert!(memory < 4 << 20, "{} KiB", memory >> 10);
}

#[test]
fn short_texts_of_long_complete_texts_are_refused() {
    let path = ROPE.replace('@', "[[anchor]]\nparticles=[0]\npath=[@]\n");
    let vertices = "version=1\n[[generate]]\nshape=\"obj\"\nvertices=[@]\nfaces=[[0,1,2]]\n";
    let faces = MESH.replace("VERTICES", "[0,0,0],[1,0,0],[0,1,0]");
    for (text, part, expected) in [
        (PAIR, "[[particle]]\nposition=[0,0,0]\n", COMPLETE_TEXT),
        (vertices, "[0,0,0],", TOO_MUCH),
        (&faces, "[0,1,2],", TOO_MUCH),
        (PAIR, "[[generate]]\nshape=\"ragdoll\"\nheight=1\n", COMPLETE_TEXT),
        (&path, "{time=#},", TOO_MUCH),
    ] {
        let problem = problem(&longest(text, part));
        assert!(problem.contains(expected), "{part}: {problem}");
    }
}

#[test]
fn empty_tables_and_elements_are_refused() {
    let path = ROPE.replace('@', ANCHOR);
    let particles = ROPE.replace('@', "[[anchor]]\nparticles = [@]\n");
    let faces = MESH.replace("VERTICES", "[0,0,0],[1,0,0],[0,1,0]");
    for (text, part, expected) in [
        ("@", "[[particle]]\n", "is missing"),
        ("@", "[[generate]]\n", "is missing"),
        (&path, "[[anchor.path]]\n", "is missing"),
        (&faces, "[],", TOO_MUCH),
        ("[[generate]]\nlinks=[@]", "\"\",", TOO_MUCH),
        ("generate=[@]\n", "{},", TOO_MUCH),
        ("particle=[@]\n", "{position=[0,0,0]},", TOO_MUCH),
        (&particles, "0,", TOO_MUCH),
    ] {
        let problem = problem(&longest(text, part));
        assert!(problem.contains(expected), "{part}: {problem}");
    }
}

#[test]
fn texts_that_are_not_scenes_are_refused() {
    for (text, part, expected) in [
        ("@", "a.b.c.d.e=1\n", "occurs twice"),
        ("[[generate]]\n@", "a.a.", TOO_MUCH),
        ("@", "[a.b.c.d]\n", "occurs twice"),
        ("a=[@]", "[],", TOO_MUCH),
        ("a=[@]", "[[[[1]]]],", TOO_MUCH),
        ("x = 1 [\n@", "[[generate]]\n", TOO_MUCH),
        ("[a\n@", "[[generate]]\n", TOO_MUCH),
        ("[[anchor]]\n[[particle]]\n@", "[[anchor.path]]\n", "is missing"),
        ("a=@", "[", TOO_MUCH),
        ("a=@", "{a=", TOO_MUCH),
        ("@", "=", TOO_MUCH),
        ("@", "\n", "is missing"),
        ("@", "[[a]]\n", TOO_MUCH),
        ("[[generate]]\n@", "pinned=[0,0]\n", "occurs twice"),
        ("[[generate]]\nvertices=[@", "0,", TOO_MUCH),
        ("[[generate]]\nvertices=[@]", "[[[[0]]]],", TOO_MUCH),
        ("@", " ", "is missing"),
        ("@", "\"", "keys cannot be multi-line"),
        ("x=\"@\"", "\\n", "is missing"),
    ] {
        let problem = problem(&longest(text, part));
        assert!(problem.contains(expected), "{part}: {problem}");
    }
    assert_eq!(problem(&"#".repeat(SCENE_SIZE_BYTES_MAX)), "is missing (allowed: 1)");
}
