//! Equal figures, of which each has a lane.

use super::{assert_same_bits, assert_same_bits_of_threads};

/// The particles of a figure of size 1, and its constraints.
const CORNERS: [[f64; 3]; 6] = [
    [0.0, 0.0, 0.0],
    [0.1, 0.0, 0.0],
    [0.1, 0.1, 0.02],
    [0.0, 0.1, 0.0],
    [0.05, 0.05, 0.1],
    [0.05, 0.3, 0.05],
];
const PAIRS: [[usize; 2]; 10] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [4, 1], [2, 4], [3, 4], [0, 2], [5, 4]];

/// Returns equal figures, which hang or fall onto colliders. Every figure has lengths of its own.
fn figures(count: usize, solver: &str, rest: &str) -> String {
    let mut text = format!(
        "version = 1\n[solver]\nrate_hz = 120\n{solver}\n\
         [[collider]]\nshape = \"plane\"\nnormal = [0.1, 1, 0]\noffset = -0.4\nfriction = 0.4\nrestitution = 0.3\n\
         [[collider]]\nshape = \"sphere\"\ncenter = [0.9, -0.1, 0.5]\nradius = 0.4\n"
    );
    for figure in 0..count {
        let (x, z) = (0.3 * (figure % 7) as f64, 0.3 * (figure / 7 % 9) as f64);
        let size = 1.0 + 0.01 * (figure % 13) as f64;
        for (corner, [dx, y, dz]) in CORNERS.iter().enumerate() {
            let position = [x + size * dx, size * y, z + size * dz];
            let (mass, is_pinned) = (0.01 + 0.001 * corner as f64, corner == 5 && figure % 3 == 0);
            text += &format!(
                "[[particle]]\nposition = {position:?}\nmass = {mass}\npinned = {is_pinned}\n"
            );
        }
    }
    for figure in 0..count {
        for [a, b] in PAIRS.map(|pair| pair.map(|corner| 6 * figure + corner)) {
            text += &format!("[[constraint]]\nparticles = [{a}, {b}]\n{rest}");
        }
    }
    text
}

/// Settings of a scene and of its constraints.
const FIGURE_VARIANTS: [(&str, &str, &str); 8] = [
    ("rigid", "substeps = 3", ""),
    ("passes", "substeps = 2\niterations = 3\nrelaxation = 1.2", ""),
    ("soft", "substeps = 2\niterations = 2", "compliance = 1e-4\n"),
    ("pbd", "substeps = 2\niterations = 3\nmethod = \"pbd\"", "stiffness = 0.4\n"),
    ("limited", "substeps = 1\nmax_stretch = 1.02", "compliance = 1e-2\n"),
    ("torn", "substeps = 2\ntear_stretch = 1.05\ntear_force = 9", "compliance = 1e-4\n"),
    ("tethers", "substeps = 2\ntethers = 2", "kind = \"tether\"\nrest_length = 0.11\n"),
    (
        "touching",
        "substeps = 2\n[contact]\nmode = \"particles\"\nthickness = 0.05\nfriction = 0.3",
        "",
    ),
];

#[test]
fn kernels_agree_on_equal_figures_of_every_number_around_a_vector() {
    for (name, solver, rest) in FIGURE_VARIANTS {
        let mut tear_count = 0;
        for count in [7, 8, 9, 15, 16, 17, 33, 137] {
            let name = format!("{name}, {count} figures");
            let scene = assert_same_bits(&figures(count, solver, rest), &name, 60);
            tear_count += scene.torn().iter().filter(|one| **one >= 50).count();
        }
        assert_eq!(tear_count > 0, name == "torn", "{name}");
    }
}

/// Figures of several forms, single particles, and particles whose figures lie in each other, beside a sheet and a
/// rope.
#[test]
fn kernels_agree_on_crowds_beside_everything_else() {
    let mut text = figures(9, "substeps = 2\niterations = 2", "");
    let generated = "[[generate]]\nshape = \"cloth\"\ncolumns = 12\nrows = 9\nspacing = 0.1\norigin = [0, 1, 0]\n\
        [[generate]]\nshape = \"rope\"\ncount = 20\nfrom = [0, 0.5, 0]\nto = [1, 0.5, 0]\nbending = 0.01\n";
    text += generated;
    for figure in 0..10 {
        text += &format!(
            "[[generate]]\nshape = \"ragdoll\"\norigin = [{}, 1, 2]\nheight = 0.5\nmass = 4\n",
            0.4 * f64::from(figure)
        );
    }
    let first = 54;
    for particle in 0..40 {
        text += &format!(
            "[[particle]]\nposition = [{}, 0.2, -1]\nmass = 0.02\n",
            0.05 * f64::from(particle)
        );
    }
    // 0 with 10, 1 with 11, and so on: they form no crowd, but the last 20 do.
    for particle in 0..10 {
        text += &format!(
            "[[constraint]]\nparticles = [{}, {}]\n",
            first + particle,
            first + particle + 10
        );
    }
    assert_same_bits(&text, "crowds", 120);
    assert_same_bits_of_threads(&text, "crowds", 20);
}

#[test]
fn threads_give_the_same_bits_on_large_crowds() {
    for (name, solver, rest) in FIGURE_VARIANTS {
        assert_same_bits_of_threads(&figures(1100, solver, rest), name, 10);
    }
}
