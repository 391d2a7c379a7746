//! The options that select the format of an export.

use std::path::{Path, PathBuf};

use super::data::DataFormat;
use super::files::{PictureFormat, is_stdout};

/// The formats. One of them is required.
#[derive(Debug, clap::Args)]
#[group(required = true, multiple = false)]
pub(super) struct FormatArgs {
    /// Draw PNG files named `NAME_STEP.png` into this folder. Creates the folder
    #[arg(long, value_name = "DIR")]
    png: Option<PathBuf>,
    /// Draw SVG files named `NAME_STEP.svg` into this folder. Creates the folder
    #[arg(long, value_name = "DIR")]
    svg: Option<PathBuf>,
    /// Draw an animated PNG file, in real time [default: a frame for each 1/FPS of simulated time]
    #[arg(long, value_name = "FILE")]
    apng: Option<PathBuf>,
    /// Write arrays for NumPy: steps, times, positions, velocities, inverse masses and flags; commands as JSON with
    /// their steps; and recorded forces, as impulses in N s
    #[arg(long, value_name = "FILE")]
    npz: Option<PathBuf>,
    /// Write a table with a row for each particle of each snapshot
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write a table with the energy of each snapshot: kinetic, potential, elastic and their sum, in J if the scene is in
    /// metres
    #[arg(long, value_name = "FILE")]
    energy: Option<PathBuf>,
    /// Write VTP files and a PVD file with their times into this folder, for ParaView: velocity,
    /// inverse mass and flags of particles, stretch of untorn constraints, intact faces, colliders
    #[arg(long, value_name = "DIR")]
    vtk: Option<PathBuf>,
    /// Write OBJ files named `NAME_STEP.obj` into this folder: intact faces as the mesh had them, or else
    /// untorn constraints as lines, and colliders
    #[arg(long, value_name = "DIR")]
    obj: Option<PathBuf>,
    /// Write a cache of positions for Blender's Mesh Cache, and FILE.obj, the mesh that it moves
    #[arg(long, value_name = "FILE.pc2")]
    pc2: Option<PathBuf>,
    /// Write a USD stage whose time codes are steps, or frames of --fps. Its `upAxis` is the scene's; a scene with -y up is
    /// turned by its transform
    #[arg(long, value_name = "FILE")]
    usda: Option<PathBuf>,
    /// Write a copy of the recording with /scene, which Foxglove viewers draw: constraints, triangles and
    /// colliders, 30 times per second of simulated time, or with --every
    #[arg(long, value_name = "FILE.mcap", conflicts_with_all = ["from", "to", "frames", "at"])]
    foxglove: Option<PathBuf>,
    /// Write a bag of ROS 2 into this folder: `PointCloud2` on `/particles`, commands and recorded forces as JSON on
    /// `/outcomes` and `/forces`, and on `/tf_static` the turn of the scene's up axis to z
    #[arg(long, value_name = "DIR")]
    ros2: Option<PathBuf>,
}

/// The format of an export and its target.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Format<'a> {
    Pictures(PictureFormat, &'a Path),
    Animation(&'a Path),
    Data(DataFormat, &'a Path),
}

impl Format<'_> {
    /// Returns the format of data, or `None` for pictures.
    pub(super) fn data(&self) -> Option<DataFormat> {
        match self {
            Self::Pictures(..) | Self::Animation(_) => None,
            Self::Data(format, _) => Some(*format),
        }
    }

    /// Returns the extensions of the file; none for a folder.
    pub(super) fn extensions(&self) -> &'static [&'static str] {
        match self {
            // An animation is a PNG file, which has either extension.
            Self::Animation(_) => &["png", "apng"],
            Self::Data(format, _) => format.extensions(),
            Self::Pictures(..) => &[],
        }
    }

    /// Returns `true` if the file is written to stdout. A folder may have the name `-`.
    pub(super) fn is_stdout(&self) -> bool {
        !self.extensions().is_empty() && is_stdout(self.target())
    }

    /// Returns the file or the folder to write.
    pub(super) fn target(&self) -> &Path {
        match self {
            Self::Pictures(_, target) | Self::Animation(target) | Self::Data(_, target) => target,
        }
    }
}

impl FormatArgs {
    /// Returns the selected format.
    pub(super) fn format(&self) -> Option<Format<'_>> {
        let pictures = [(&self.png, PictureFormat::Png), (&self.svg, PictureFormat::Svg)];
        let data = [
            (&self.npz, DataFormat::Npz),
            (&self.csv, DataFormat::Csv),
            (&self.energy, DataFormat::Energy),
            (&self.vtk, DataFormat::Vtk),
            (&self.obj, DataFormat::Obj),
            (&self.pc2, DataFormat::Pc2),
            (&self.usda, DataFormat::Usda),
            (&self.foxglove, DataFormat::Foxglove),
            (&self.ros2, DataFormat::Ros2),
        ];
        let pictures = pictures
            .into_iter()
            .filter_map(|(path, format)| Some(Format::Pictures(format, path.as_deref()?)));
        let data = data
            .into_iter()
            .filter_map(|(path, format)| Some(Format::Data(format, path.as_deref()?)));
        let animation = self.apng.as_deref().map(Format::Animation);
        pictures.chain(animation).chain(data).next()
    }
}
