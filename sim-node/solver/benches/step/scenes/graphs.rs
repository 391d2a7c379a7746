//! Scenes whose links form an arbitrary graph: figures, webs, meshes, ropes, and the built-in scenes.

use sim_solver::{Scene, builtin};

use crate::scenes::mesh::{self, Numbering};

/// Figures in the crowd, and its rows.
const FIGURES: u32 = 1000;
const FIGURES_PER_ROW: u32 = 40;
/// Spokes and rings of a web with 10,001 particles. Its hub has more links than there are groups.
const SPOKES: u32 = 100;
/// A plane that no particle reaches in two seconds.
const FAR_PLANE: &str = "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = -50\n";

/// A scene, built on demand.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Graph {
    /// Figures that fall onto a plane, each as in the built-in scene.
    Ragdolls,
    /// A web of 10,000 particles.
    Web,
    /// An imported mesh of 10,000 vertices.
    Mesh(Numbering),
    /// A rope of `count` particles.
    Rope(u32),
    /// A built-in scene.
    BuiltIn(&'static str),
}

impl Graph {
    /// Returns all graphs, including the built-in scenes that have links.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        let big = [Self::Ragdolls, Self::Web]
            .into_iter()
            .chain([Numbering::AsBuilt, Numbering::Shuffled].map(Self::Mesh));
        let small = [20, 50].map(Self::Rope);
        let built_in = builtin::names().filter(|name| *name != "free-fall").map(Self::BuiltIn);
        big.chain(small).chain(built_in)
    }

    /// Returns the name of the case.
    pub(crate) fn name(self) -> String {
        match self {
            Self::Ragdolls => format!("ragdolls-{FIGURES}"),
            Self::Web => "web-large".to_owned(),
            Self::Mesh(Numbering::AsBuilt) => "mesh".to_owned(),
            Self::Mesh(Numbering::Shuffled) => "mesh-shuffled".to_owned(),
            Self::Rope(count) => format!("rope-{count}"),
            Self::BuiltIn(name) => name.to_owned(),
        }
    }

    pub(crate) fn scene(self) -> Scene {
        match self {
            Self::Ragdolls => from_toml(&ragdolls()),
            Self::Web => from_toml(&web()),
            Self::Mesh(numbering) => imported(numbering),
            Self::Rope(count) => from_toml(&rope(count)),
            Self::BuiltIn(name) => from_toml(builtin::text(name).unwrap()),
        }
    }
}

fn from_toml(text: &str) -> Scene {
    Scene::from_toml(text, "benchmark").unwrap()
}

/// Returns the crowd. Settings, floor and mass are those of the built-in scene.
fn ragdolls() -> String {
    let mut text =
        "version = 1\n[solver]\nrate_hz = 60\nsubsteps = 4\niterations = 6\ndamping = 0.1\n\
         [[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\nfriction = 0.6\n\
         restitution = 0.1\n"
            .to_owned();
    for figure in 0..FIGURES {
        let (row, column) = (figure / FIGURES_PER_ROW, figure % FIGURES_PER_ROW);
        let (x, z) = (2.0 * f64::from(column), 2.0 * f64::from(row));
        text += &format!(
            "[[generate]]\nshape = \"ragdoll\"\norigin = [{x}, 0.9, {z}]\nheight = 1.7\nmass = 4\n"
        );
    }
    text
}

/// Returns a level web that sags.
fn web() -> String {
    format!(
        "version = 1\n[solver]\nrate_hz = 60\nsubsteps = 8\n{FAR_PLANE}\
         [[generate]]\nshape = \"web\"\nradius = 2\nspokes = {SPOKES}\nrings = {SPOKES}\n\
         normal = [0, 1, 0]\nmass = 0.002\n"
    )
}

/// Returns an imported mesh as `sim-node import` writes it, pinned at its top.
fn imported(numbering: Numbering) -> Scene {
    let text = format!(
        "version = 1\n[solver]\nsubsteps = 8\n{FAR_PLANE}\
         [[generate]]\nshape = \"obj\"\npath = \"mesh.obj\"\ndensity = 0.2\npinned = \"y > 1.35\"\n\
         compliance = {{ bend = 0.01 }}\n"
    );
    let obj = mesh::torus(numbering);
    Scene::from_toml_with_files(&text, "mesh", &|_| Ok(obj.clone())).unwrap()
}

/// Returns a rope with the default substeps. The cost of a step beside its substeps shows most here.
fn rope(count: u32) -> String {
    format!(
        "version = 1\n{FAR_PLANE}[[generate]]\nshape = \"rope\"\ncount = {count}\nfrom = [0, 0, 0]\n\
         to = [1, 0, 0]\n"
    )
}
