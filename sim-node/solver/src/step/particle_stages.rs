//! The stages of single particles, for rows of sheets and crowds and for blocks of the graph alike.

use super::particle_block::ParticleBlock;
use super::stage::Stage;
use super::substep::SubstepInputs;
use crate::contacts::contact::Contacts;
use crate::kernels::lanes::Wide;

/// Runs one stage on a block of particles. `contacts` carries the contacts of the block from
/// [`Stage::Contact`] to [`Stage::Advance`].
#[inline(always)]
pub(crate) fn run_stage<W: Wide>(
    stage: Stage,
    particles: &mut impl ParticleBlock,
    inputs: &SubstepInputs<'_>,
    contacts: &mut Contacts,
) {
    match stage {
        Stage::Predict => particles.predict::<W>(&inputs.prediction),
        Stage::Tether => particles.pull_to_roots::<W>(),
        Stage::Contact => contacts.push_out::<W>(particles, inputs),
        Stage::Advance => {
            particles.advance::<W>();
            contacts.correct_touched::<W>(particles, inputs);
        }
        Stage::Drive
        | Stage::Wind
        | Stage::Project
        | Stage::Bend
        | Stage::LimitStretch
        | Stage::ParticleContact
        | Stage::Tear
        | Stage::Freeze
        | Stage::Hash => unreachable!("{stage:?} is not a stage of single particles"),
    }
}
