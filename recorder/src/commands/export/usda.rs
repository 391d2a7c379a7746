//! USD as text: one mesh or set of points whose positions and velocities are sampled at each frame, and a

use std::fmt::{self, Display};
use std::io::Write;

use sim_contract::ParticleState;
use sim_solver::scene::Up;

use super::shapes::{Colliders, Face, Faces, Pose};
use super::snapshots::Snapshots;

/// Writes the stage. The attributes of particles read the recording once each, because each lists all its samples.
pub(crate) fn write(snapshots: &Snapshots<'_>, out: &mut dyn Write) -> anyhow::Result<()> {
    let faces = Faces::of(snapshots)?;
    write_header(snapshots, out)?;
    let kind = if faces.all.is_empty() { "Points" } else { "Mesh" };
    writeln!(out, "    def {kind} \"particles\"\n    {{")?;
    write_samples(snapshots, out, "point3f[] points", |particle| particle.position)?;
    write_samples(snapshots, out, "vector3f[] velocities", |particle| particle.velocity)?;
    if !faces.all.is_empty() {
        write_faces(&FaceHistory::of(snapshots, &faces)?, out)?;
    }
    writeln!(out, "    }}")?;
    if !faces.materials.is_empty() {
        writeln!(out, "    def Scope \"materials\"\n    {{")?;
        for name in identifiers(&faces.materials) {
            writeln!(out, "        def Material \"{name}\"\n        {{\n        }}")?;
        }
        writeln!(out, "    }}")?;
    }
    if let Some(colliders) = Colliders::of(snapshots)? {
        write_colliders(snapshots, out, &colliders)?;
    }
    writeln!(out, "}}")?;
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
    let rate = snapshots.time_codes_per_s();
    let numbers = snapshots.frame_numbers();
    let (first, last) = (numbers[0], numbers[numbers.len() - 1]);
    writeln!(out, "#usda 1.0\n(\n    defaultPrim = \"scene\"")?;
    if snapshots.frames_per_s.is_some() {
        let (interpolated, count) = (snapshots.interpolated_count(), numbers.len());
        let start_s = snapshots.frame_time_s(first);
        writeln!(
            out,
            "    doc = \"Time code 0 is {start_s:.6} s of the run; {interpolated} of {count} frames are \
             interpolated between snapshots\""
        )?;
    }
    write!(
        out,
        "    upAxis = \"{up_axis}\"\n    metersPerUnit = 1\n    timeCodesPerSecond = {rate}\n    \
         framesPerSecond = {rate}\n    startTimeCode = {first}\n    endTimeCode = {last}\n)\n\n\
         def Xform \"scene\"\n{{\n{turn}"
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
    snapshots.for_each_frame(|frame| {
        write!(out, "            {}: ", frame.number)?;
        write_list(out, frame.state.particles.iter().map(|one| Tuple(value(one))))?;
        Ok(writeln!(out, ",")?)
    })?;
    writeln!(out, "        }}")?;
    Ok(())
}

/// The intact faces over time.
struct FaceHistory<'a> {
    faces: &'a Faces,
    /// By change: the number of its frame, and the faces that appear or disappear.
    changes: Vec<(u64, Vec<u32>)>,
}

impl<'a> FaceHistory<'a> {
    fn of(snapshots: &Snapshots<'_>, faces: &'a Faces) -> anyhow::Result<Self> {
        let mut is_intact = vec![false; faces.all.len()];
        let mut changes = Vec::new();
        snapshots.for_each_frame(|frame| {
            let mut now = vec![false; is_intact.len()];
            for index in faces.intact(frame.state) {
                now[index as usize] = true;
            }
            let changed = (0_u32..).zip(now.iter().zip(&is_intact));
            let changed: Vec<_> = changed
                .filter(|(_, (now, before))| now != before)
                .map(|(index, _)| index)
                .collect();
            if !changed.is_empty() || changes.is_empty() {
                changes.push((frame.number, changed));
            }
            is_intact = now;
            Ok(())
        })?;
        Ok(Self { faces, changes })
    }

    /// Writes an attribute, with a sample for each change, or one value without any.
    fn write<T: Display>(
        &self,
        out: &mut dyn Write,
        attribute: &str,
        values: impl Fn(&[&Face]) -> Vec<T>,
    ) -> std::io::Result<()> {
        let mut is_intact = vec![false; self.faces.all.len()];
        let is_static = self.changes.len() == 1;
        if !is_static {
            writeln!(out, "        {attribute}.timeSamples = {{")?;
        }
        for (number, changed) in &self.changes {
            for index in changed {
                is_intact[*index as usize] ^= true;
            }
            let faces = self.faces.all.iter().zip(&is_intact);
            let faces: Vec<_> = faces.filter(|(_, is)| **is).map(|(face, _)| face).collect();
            if is_static {
                write!(out, "        {attribute} = ")?;
            } else {
                write!(out, "            {number}: ")?;
            }
            write_list(out, values(&faces).into_iter())?;
            writeln!(out, "{}", if is_static { "" } else { "," })?;
        }
        if !is_static {
            writeln!(out, "        }}")?;
        }
        Ok(())
    }
}

/// Writes the faces, their texture coordinates, and the subsets of their groups and materials.
fn write_faces(history: &FaceHistory<'_>, out: &mut dyn Write) -> anyhow::Result<()> {
    let faces = history.faces;
    // The faces are the surface, not the cage of a smooth one.
    writeln!(out, "        uniform token subdivisionScheme = \"none\"")?;
    writeln!(out, "        uniform bool doubleSided = 1")?;
    let corner_counts = |faces: &[&Face]| faces.iter().map(|face| face.corners.len()).collect();
    history.write(out, "int[] faceVertexCounts", corner_counts)?;
    let corners =
        |faces: &[&Face]| faces.iter().flat_map(|face| face.corners.iter().copied()).collect();
    history.write(out, "int[] faceVertexIndices", corners)?;
    if !faces.uvs.is_empty() {
        // Every corner needs an index: the last pair is for the corners without texture coordinates.
        write!(out, "        texCoord2f[] primvars:st = ")?;
        write_list(out, faces.uvs.iter().chain([&[0.0; 2]]).map(|uv| Tuple(*uv)))?;
        writeln!(out, " (\n            interpolation = \"faceVarying\"\n        )")?;
        let none = u32::try_from(faces.uvs.len()).unwrap_or(u32::MAX);
        let of_face = |face: &&Face| match face.uvs.as_slice() {
            [] => vec![none; face.corners.len()],
            uvs => uvs.to_vec(),
        };
        let uvs = |faces: &[&Face]| faces.iter().flat_map(of_face).collect();
        history.write(out, "int[] primvars:st:indices", uvs)?;
    }
    if !faces.materials.is_empty() {
        let family = "subsetFamily:materialBind:familyType";
        writeln!(out, "        uniform token {family} = \"nonOverlapping\"")?;
    }
    for (number, name) in (0..).zip(identifiers(&faces.groups)) {
        let subset = Subset { name: &format!("group_{name}"), family: "groups", material: None };
        subset.write(history, out, |face| face.group == Some(number))?;
    }
    for (number, name) in (0..).zip(identifiers(&faces.materials)) {
        let (subset_name, material) = (format!("material_{name}"), Some(name.as_str()));
        let subset = Subset { name: &subset_name, family: "materialBind", material };
        subset.write(history, out, |face| face.material == Some(number))?;
    }
    Ok(())
}

/// A subset of the faces.
struct Subset<'a> {
    name: &'a str,
    family: &'a str,
    material: Option<&'a str>,
}

impl Subset<'_> {
    fn write(
        &self,
        history: &FaceHistory<'_>,
        out: &mut dyn Write,
        contains: impl Fn(&Face) -> bool,
    ) -> std::io::Result<()> {
        let Self { name, family, material } = self;
        let schema = match material {
            Some(_) => " (\n            prepend apiSchemas = [\"MaterialBindingAPI\"]\n        )",
            None => "",
        };
        writeln!(out, "        def GeomSubset \"{name}\"{schema}\n        {{")?;
        writeln!(out, "        uniform token elementType = \"face\"")?;
        writeln!(out, "        uniform token familyName = \"{family}\"")?;
        if let Some(material) = material {
            writeln!(out, "        rel material:binding = </scene/materials/{material}>")?;
        }
        history.write(out, "int[] indices", |faces| {
            let places = faces.iter().enumerate().filter(|(_, face)| contains(face));
            places.map(|(place, _)| place).collect()
        })?;
        writeln!(out, "        }}")
    }
}

/// Returns different names of prims for names of any form.
fn identifiers(names: &[String]) -> Vec<String> {
    let mut identifiers: Vec<String> = Vec::with_capacity(names.len());
    for (number, name) in names.iter().enumerate() {
        let letter = |one: char| if one.is_ascii_alphanumeric() { one } else { '_' };
        let mut identifier: String = name.chars().map(letter).collect();
        if identifier.starts_with(|first: char| first.is_ascii_digit()) {
            identifier.insert(0, '_');
        }
        while identifiers.contains(&identifier) {
            identifier += &format!("_{number}");
        }
        identifiers.push(identifier);
    }
    identifiers
}

/// Writes the meshes of the colliders, which keep the form of the first frame, and their poses.
fn write_colliders(
    snapshots: &Snapshots<'_>,
    out: &mut dyn Write,
    colliders: &Colliders,
) -> anyhow::Result<()> {
    let first = snapshots.first()?;
    let mut samples = vec![PoseSamples::default(); first.colliders().len()];
    snapshots.for_each_frame(|frame| {
        for (samples, collider) in samples.iter_mut().zip(frame.state.colliders()) {
            samples.add(frame.number, colliders.pose(&collider.shape));
        }
        Ok(())
    })?;
    for (index, solid, pose) in colliders.solids(&first) {
        writeln!(out, "    def Mesh \"{}\"\n    {{", Colliders::name(index))?;
        let transform = "matrix4d xformOp:transform";
        if let [_, _, ..] = samples[index].changes.as_slice() {
            writeln!(out, "        {transform}.timeSamples = {{")?;
            for (number, pose) in &samples[index].changes {
                writeln!(out, "            {number}: {},", Matrix(*pose))?;
            }
            writeln!(out, "        }}")?;
        } else {
            writeln!(out, "        {transform} = {}", Matrix(pose))?;
        }
        writeln!(out, "        uniform token[] xformOpOrder = [\"xformOp:transform\"]")?;
        writeln!(out, "        uniform token subdivisionScheme = \"none\"")?;
        let vertices = solid.vertices.iter().map(|vertex| Tuple(vertex.as_vec3().to_array()));
        let counts = solid.faces.iter().map(Vec::len);
        write_attribute(out, "point3f[] points", vertices)?;
        write_attribute(out, "int[] faceVertexCounts", counts)?;
        write_attribute(out, "int[] faceVertexIndices", solid.faces.iter().flatten())?;
        writeln!(out, "    }}")?;
    }
    Ok(())
}

/// The pose of a collider over time: a sample for each change, and one for the frame before it, because USD
/// interpolates between samples.
#[derive(Debug, Clone, Default)]
struct PoseSamples {
    changes: Vec<(u64, Pose)>,
    last_number: u64,
}

impl PoseSamples {
    /// Adds the pose in a frame, unless it is not finite.
    fn add(&mut self, number: u64, pose: Option<Pose>) {
        let last_number = std::mem::replace(&mut self.last_number, number);
        let Some(pose) = pose else { return };
        match self.changes.last().copied() {
            Some((_, last)) if last == pose => return,
            Some((sampled, last)) if sampled != last_number => {
                self.changes.push((last_number, last));
            }
            _ => {}
        }
        self.changes.push((number, pose));
    }
}

fn write_attribute<T: Display>(
    out: &mut dyn Write,
    attribute: &str,
    values: impl Iterator<Item = T>,
) -> std::io::Result<()> {
    write!(out, "        {attribute} = ")?;
    write_list(out, values)?;
    writeln!(out)
}

/// Writes a value in brackets.
fn write_list<T: Display>(
    out: &mut dyn Write,
    values: impl Iterator<Item = T>,
) -> std::io::Result<()> {
    write!(out, "[")?;
    for (index, value) in values.enumerate() {
        let comma = if index == 0 { "" } else { ", " };
        write!(out, "{comma}{value}")?;
    }
    write!(out, "]")
}

/// A vector in the syntax of USD.
struct Tuple<const N: usize>([f32; N]);

impl<const N: usize> Display for Tuple<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let numbers = self.0.map(|number| format!("{number:?}"));
        write!(f, "({})", numbers.join(", "))
    }
}

/// A pose as a matrix that multiplies row vectors from the right.
struct Matrix(Pose);

impl Display for Matrix {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Pose { translation, rotation } = self.0;
        let [x, y, z] = glam::DVec3::AXES.map(|axis| rotation * axis);
        let rows = [(x, 0), (y, 0), (z, 0), (translation, 1)];
        let rows =
            rows.map(|(row, last)| format!("({:?}, {:?}, {:?}, {last})", row.x, row.y, row.z));
        write!(f, "({})", rows.join(", "))
    }
}

#[cfg(test)]
mod usda_tests {
    use glam::{DQuat, DVec3};

    use super::*;

    #[test]
    fn a_pose_has_samples_at_each_change_and_in_the_frame_before_it() {
        let at = |x: i32| {
            let translation = DVec3::new(x.into(), 0.0, 0.0);
            Pose { translation, rotation: DQuat::IDENTITY }
        };
        let mut samples = PoseSamples::default();
        for (number, x) in [(0, 0), (2, 0), (4, 0), (6, 1), (8, 2), (10, 2), (12, 2), (14, 0)] {
            samples.add(number, Some(at(x)));
        }
        let expected = [(0, at(0)), (4, at(0)), (6, at(1)), (8, at(2)), (12, at(2)), (14, at(0))];
        assert_eq!(samples.changes, expected);
    }

    #[test]
    fn names_of_any_form_have_different_identifiers() {
        let names = ["a b", "a_b_2", "a-b", "a b", "2nd"].map(str::to_owned);
        assert_eq!(identifiers(&names), ["a_b", "a_b_2", "a_b_2_2", "a_b_3", "_2nd"]);
    }
}
