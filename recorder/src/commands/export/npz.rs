//! NPZ, the archive of NumPy: one array per column, in a ZIP file without compression.

use std::collections::BTreeSet;
use std::io::Write;

use anyhow::bail;
use recording::{ForcesRow, OutcomeRow, SceneState, counted};
use sim_contract::{ParticleState, PlainF32};
use zip::write::{SimpleFileOptions, StreamWriter};
use zip::{DateTime, ZipWriter};

use super::snapshots::{Snapshots, new_outcomes};

/// The header of an array is padded to a multiple of this, so that its numbers are aligned.
const HEADER_ALIGNMENT: usize = 64;
/// Bytes of a header before its text: the magic string, the version, and the length of the text.
const PREFIX_SIZE_BYTES: usize = 10;
/// Bytes of a number in the arrays of particles and forces.
const NUMBER_SIZE_BYTES: usize = 4;

/// A column of the particles.
struct Column {
    name: &'static str,
    number_type: &'static str,
    /// Numbers per particle. One number has no axis of its own.
    width: usize,
    append: fn(&ParticleState, &mut Vec<u8>),
}

const COLUMNS: [Column; 4] = [
    Column {
        name: "positions",
        number_type: "<f4",
        width: 3,
        append: |particle, bytes| bytes.extend_from_slice(bytemuck::bytes_of(&particle.position)),
    },
    Column {
        name: "velocities",
        number_type: "<f4",
        width: 3,
        append: |particle, bytes| bytes.extend_from_slice(bytemuck::bytes_of(&particle.velocity)),
    },
    Column {
        name: "inverse_masses",
        number_type: "<f4",
        width: 1,
        append: |particle, bytes| bytes.extend_from_slice(&particle.inverse_mass.to_le_bytes()),
    },
    Column {
        name: "flags",
        number_type: "<u4",
        width: 1,
        append: |particle, bytes| bytes.extend_from_slice(&particle.flags.to_le_bytes()),
    },
];

/// A column of the forces, with a row for each collider, anchor or fixed particle.
struct ForceColumn {
    name: &'static str,
    number_type: &'static str,
    /// Numbers per row. One number has no axis of its own.
    width: usize,
    rows: fn(&ArraySurvey) -> usize,
    append: fn(&ArraySurvey, &ForcesRow, &mut Vec<u8>),
}

const FORCE_COLUMNS: [ForceColumn; 6] = [
    ForceColumn {
        name: "collider_impulses",
        number_type: "<f4",
        width: 3,
        rows: |survey| survey.collider_count,
        append: |_, row, bytes| {
            row.colliders.iter().for_each(|one| append_vector(bytes, one.impulse));
        },
    },
    ForceColumn {
        name: "collider_angular_impulses",
        number_type: "<f4",
        width: 3,
        rows: |survey| survey.collider_count,
        append: |_, row, bytes| {
            row.colliders.iter().for_each(|one| append_vector(bytes, one.angular_impulse));
        },
    },
    ForceColumn {
        name: "collider_contacts",
        number_type: "<u4",
        width: 1,
        rows: |survey| survey.collider_count,
        append: |_, row, bytes| {
            let contacts = row.colliders.iter().map(|one| one.contacts.to_le_bytes());
            bytes.extend(contacts.flatten());
        },
    },
    ForceColumn {
        name: "anchor_impulses",
        number_type: "<f4",
        width: 3,
        rows: |survey| survey.anchor_count,
        append: |_, row, bytes| {
            row.anchors.iter().for_each(|one| append_vector(bytes, one.impulse));
        },
    },
    ForceColumn {
        name: "anchor_angular_impulses",
        number_type: "<f4",
        width: 3,
        rows: |survey| survey.anchor_count,
        append: |_, row, bytes| {
            row.anchors.iter().for_each(|one| append_vector(bytes, one.angular_impulse));
        },
    },
    ForceColumn {
        name: "fixed_impulses",
        number_type: "<f4",
        width: 3,
        rows: |survey| survey.fixed.len(),
        append: |survey, row, bytes| {
            // Both lists ascend.
            let mut fixed = row.particles.iter().zip(&row.impulses).peekable();
            for particle in &survey.fixed {
                let impulse = fixed.next_if(|(one, _)| *one == particle).map(|(_, one)| *one);
                append_vector(bytes, impulse.unwrap_or([PlainF32(f32::NAN); 3]));
            }
        },
    },
];

fn append_vector(bytes: &mut Vec<u8>, vector: [PlainF32; 3]) {
    bytes.extend(vector.iter().flat_map(|number| number.0.to_le_bytes()));
}

/// The commands, and the numbers of rows of the forces.
#[derive(Default)]
struct ArraySurvey {
    /// The outcomes of the steps from the first to the last snapshot.
    commands: Vec<OutcomeRow>,
    has_forces: bool,
    collider_count: usize,
    anchor_count: usize,
    /// The particles that were fixed in any of the steps.
    fixed: BTreeSet<u32>,
}

impl ArraySurvey {
    fn read(snapshots: &Snapshots<'_>) -> anyhow::Result<Self> {
        let mut survey = Self::default();
        snapshots.for_each(|state| {
            survey.commands.extend_from_slice(new_outcomes(state));
            if let Some(row) = &state.forces {
                survey.has_forces = true;
                survey.collider_count = row.colliders.len();
                survey.anchor_count = row.anchors.len();
                survey.fixed.extend(&row.particles);
            }
            Ok(())
        })?;
        Ok(survey)
    }
}

/// Writes the arrays `steps` and `times` (s), those of the particles, the commands as JSON, and the forces if the
/// recording has them.
pub(crate) fn write(snapshots: &Snapshots<'_>, out: &mut dyn Write) -> anyhow::Result<()> {
    let mut archive = Archive(ZipWriter::new_stream(out));
    let steps = snapshots.steps.iter();
    archive.begin("steps", "<u8", &[snapshots.steps.len()])?;
    for step in steps.clone() {
        archive.0.write_all(&step.to_le_bytes())?;
    }
    archive.begin("times", "<f8", &[snapshots.steps.len()])?;
    for step in steps {
        archive.0.write_all(&snapshots.run_time_s(*step).to_le_bytes())?;
    }
    for Column { name, number_type, width, append } in COLUMNS {
        let array = Array { name, number_type, rows: snapshots.particle_count, width };
        archive.add_array(snapshots, &array, |state, bytes| {
            state.particles.iter().for_each(|particle| append(particle, bytes));
        })?;
    }
    let survey = ArraySurvey::read(snapshots)?;
    archive.add_commands(&survey.commands)?;
    if survey.has_forces {
        let fixed: Vec<_> = survey.fixed.iter().copied().collect();
        archive.begin("fixed_particles", "<u4", &[fixed.len()])?;
        archive.0.write_all(bytemuck::cast_slice(&fixed))?;
        for ForceColumn { name, number_type, width, rows, append } in FORCE_COLUMNS {
            let rows = rows(&survey);
            let array = Array { name, number_type, rows, width };
            // A snapshot without forces has NaN, or 0 of a whole number.
            let missing = if number_type == "<f4" { f32::NAN.to_le_bytes() } else { [0; 4] };
            archive.add_array(snapshots, &array, |state, bytes| match &state.forces {
                Some(row) => append(&survey, row, bytes),
                None => bytes.extend(missing.repeat(rows * width)),
            })?;
        }
    }
    archive.0.finish()?;
    Ok(())
}

/// An array with rows of numbers for each snapshot.
struct Array {
    name: &'static str,
    number_type: &'static str,
    /// Rows per snapshot.
    rows: usize,
    /// Numbers per row. One number has no axis of its own.
    width: usize,
}

/// An archive that is written without seeking.
struct Archive<'a>(ZipWriter<StreamWriter<&'a mut dyn Write>>);

impl Archive<'_> {
    /// Begins an array. Its numbers follow in row-major order.
    fn begin(&mut self, name: &str, number_type: &str, shape: &[usize]) -> anyhow::Result<()> {
        // The time of day is left out, so that equal exports have equal bytes.
        let options =
            SimpleFileOptions::default().last_modified_time(DateTime::default()).large_file(true);
        self.0.start_file(format!("{name}.npy"), options)?;
        self.0.write_all(&header(number_type, shape))?;
        Ok(())
    }

    /// Adds an array. `append` appends the rows of a snapshot, as bytes.
    fn add_array(
        &mut self,
        snapshots: &Snapshots<'_>,
        array: &Array,
        append: impl Fn(&SceneState, &mut Vec<u8>),
    ) -> anyhow::Result<()> {
        let Array { name, number_type, rows, width } = *array;
        let shape = [snapshots.steps.len(), rows, width];
        let axis_count = if width == 1 { 2 } else { 3 };
        self.begin(name, number_type, &shape[..axis_count])?;
        let mut bytes = Vec::new();
        snapshots.for_each(|state| {
            bytes.clear();
            append(state, &mut bytes);
            let row_size_bytes = width * NUMBER_SIZE_BYTES;
            if bytes.len() != rows * row_size_bytes {
                let (step, found) = (state.row.step, bytes.len() / row_size_bytes);
                let found = counted(found as u64, "row");
                bail!("step {step}: {name} has {found}, but {rows} in other steps");
            }
            Ok(self.0.write_all(&bytes)?)
        })
    }

    /// Adds the commands as they are in `/outcomes`, and their steps.
    fn add_commands(&mut self, commands: &[OutcomeRow]) -> anyhow::Result<()> {
        self.begin("command_steps", "<u8", &[commands.len()])?;
        for command in commands {
            self.0.write_all(&command.step.to_le_bytes())?;
        }
        let texts = commands.iter().map(serde_json::to_string).collect::<Result<Vec<_>, _>>()?;
        // Every text has the length of the longest one, in letters of 32 bits; NumPy removes zeros at the end.
        let length = texts.iter().map(|text| text.chars().count()).max().unwrap_or(0).max(1);
        self.begin("commands", &format!("<U{length}"), &[commands.len()])?;
        for text in &texts {
            let letters = text.chars().map(u32::from).chain(std::iter::repeat(0)).take(length);
            let bytes: Vec<_> = letters.flat_map(u32::to_le_bytes).collect();
            self.0.write_all(&bytes)?;
        }
        Ok(())
    }
}

/// Returns the header of an array, format 1.0: a text in the syntax of Python, padded with spaces.
fn header(number_type: &str, shape: &[usize]) -> Vec<u8> {
    // One axis is a tuple only with a comma at its end, which more axes may have, too.
    let shape: Vec<_> = shape.iter().map(usize::to_string).collect();
    let shape = shape.join(",");
    let mut text =
        format!("{{'descr': '{number_type}', 'fortran_order': False, 'shape': ({shape},), }}");
    let size_bytes = PREFIX_SIZE_BYTES + text.len() + 1;
    text.push_str(&" ".repeat(size_bytes.next_multiple_of(HEADER_ALIGNMENT) - size_bytes));
    text.push('\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    // Three axes of 20 digits need 150 characters.
    header.extend_from_slice(&u16::try_from(text.len()).unwrap_or(u16::MAX).to_le_bytes());
    header.extend_from_slice(text.as_bytes());
    header
}

#[cfg(test)]
mod npz_tests {
    use super::*;

    #[test]
    fn a_header_is_aligned_and_states_its_length() {
        for shape in [&[5][..], &[5, 12], &[16_777_216, 16_777_216, 3]] {
            let header = header("<f4", shape);
            assert_eq!(header.len() % HEADER_ALIGNMENT, 0);
            let length = u16::from_le_bytes([header[8], header[9]]);
            assert_eq!(PREFIX_SIZE_BYTES + usize::from(length), header.len());
            assert_eq!(header.last(), Some(&b'\n'));
        }
    }
}
