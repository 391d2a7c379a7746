//! USD as text: one mesh or set of points whose positions and velocities are sampled at each snapshot.
//!
//! Time codes are steps, so every sample has an exact time. USD knows y up and z up. A scene with -y up
//! gets half a turn about x instead, which leaves its coordinates unchanged.

use std::fmt::{self, Display};
use std::io::Write;

use sim_contract::ParticleState;
use sim_solver::scene::Up;

use crate::export::snapshots::Snapshots;

/// Writes the stage. An attribute lists all its samples, so each of them reads the recording once.
pub(crate) fn write(snapshots: &Snapshots<'_>, out: &mut dyn Write) -> anyhow::Result<()> {
    write_header(snapshots, out)?;
    let is_mesh = !snapshots.first()?.triangles.is_empty();
    writeln!(out, "    def {} \"particles\"\n    {{", if is_mesh { "Mesh" } else { "Points" })?;
    write_samples(snapshots, out, "point3f[] points", |particle| particle.position)?;
    write_samples(snapshots, out, "vector3f[] velocities", |particle| particle.velocity)?;
    if is_mesh {
        // The triangles are the surface, not the cage of a smooth one.
        writeln!(out, "        uniform token subdivisionScheme = \"none\"")?;
        writeln!(out, "        uniform bool doubleSided = 1")?;
        let corner_counts = |triangles: &[[u32; 3]]| vec![3; triangles.len()];
        write_triangles(snapshots, out, "int[] faceVertexCounts", corner_counts)?;
        let corners = |triangles: &[[u32; 3]]| triangles.as_flattened().to_vec();
        write_triangles(snapshots, out, "int[] faceVertexIndices", corners)?;
    }
    writeln!(out, "    }}\n}}")?;
    Ok(())
}

fn write_header(snapshots: &Snapshots<'_>, out: &mut dyn Write) -> anyhow::Result<()> {
    let (up_axis, turn) = match snapshots.up {
        Up::Y => ("Y", ""),
        Up::MinusY => (
            "Y",
            "    double xformOp:rotateX = 180\n    uniform token[] xformOpOrder = [\"xformOp:rotateX\"]\n",
        ),
        Up::Z => ("Z", ""),
    };
    let rate_hz = snapshots.run.rate_hz;
    let (first, last) = (snapshots.steps[0], snapshots.steps[snapshots.steps.len() - 1]);
    write!(
        out,
        "#usda 1.0\n(\n    defaultPrim = \"scene\"\n    upAxis = \"{up_axis}\"\n    metersPerUnit = 1\n    \
         timeCodesPerSecond = {rate_hz}\n    framesPerSecond = {rate_hz}\n    startTimeCode = {first}\n    \
         endTimeCode = {last}\n)\n\ndef Xform \"scene\"\n{{\n{turn}"
    )?;
    Ok(())
}

/// Writes the samples of an attribute with three numbers per particle.
fn write_samples(
    snapshots: &Snapshots<'_>,
    out: &mut dyn Write,
    attribute: &str,
    value: impl Fn(&ParticleState) -> [f32; 3],
) -> anyhow::Result<()> {
    writeln!(out, "        {attribute}.timeSamples = {{")?;
    snapshots.for_each(|state| {
        write!(out, "            {}: ", state.row.step)?;
        Ok(write_list(out, state.particles.iter().map(|one| Tuple(value(one))))?)
    })?;
    writeln!(out, "        }}")?;
    Ok(())
}

/// Writes an attribute of the intact triangles, with a sample for each change of them.
fn write_triangles<T: Display>(
    snapshots: &Snapshots<'_>,
    out: &mut dyn Write,
    attribute: &str,
    values: impl Fn(&[[u32; 3]]) -> Vec<T>,
) -> anyhow::Result<()> {
    writeln!(out, "        {attribute}.timeSamples = {{")?;
    let mut known = None;
    snapshots.for_each(|state| {
        let triangles: Vec<_> = state.intact_triangles().map(|(_, corners)| corners).collect();
        if known.as_ref() != Some(&triangles) {
            write!(out, "            {}: ", state.row.step)?;
            write_list(out, values(&triangles).into_iter())?;
            known = Some(triangles);
        }
        Ok(())
    })?;
    writeln!(out, "        }}")?;
    Ok(())
}

/// Writes a value in brackets, and the comma that ends a sample.
fn write_list<T: Display>(
    out: &mut dyn Write,
    values: impl Iterator<Item = T>,
) -> std::io::Result<()> {
    write!(out, "[")?;
    for (index, value) in values.enumerate() {
        let comma = if index == 0 { "" } else { ", " };
        write!(out, "{comma}{value}")?;
    }
    writeln!(out, "],")
}

/// A vector in the syntax of USD.
struct Tuple([f32; 3]);

impl Display for Tuple {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.0;
        write!(f, "({x:?}, {y:?}, {z:?})")
    }
}
