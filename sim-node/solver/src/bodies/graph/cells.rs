//! How bodies fall, are pulled back by their tethers, and meet colliders.

use glam::Vec3;

use super::super::motion::{Motion, pull_back};
use super::Tether;
use crate::contact::{Cells, Contacts};
use crate::kernels::{Body, Wide, Work, axes};
use crate::project::Rest;
use crate::solid::{Way, Zone};

/// Lets bodies fall.
pub(super) struct PredictWork<'a> {
    pub(super) bodies: &'a mut [Body],
    /// Empty where there is no wind.
    pub(super) gains: &'a [[f32; 3]],
    pub(super) motion: &'a Motion<'a>,
}

impl Work for PredictWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Self { bodies, gains, motion: Motion { fall, .. } } = self;
        let (eights, rest) = bodies.as_chunks_mut::<8>();
        let eights_end = 8 * eights.len();
        for (eight, bodies) in eights.iter_mut().enumerate() {
            let [[_, _, _, w], [x, y, z, _]] = W::columns(bodies);
            let wind = match gains.get(8 * eight..8 * eight + 8) {
                None => [W::splat(0.0); 3],
                Some(gains) => {
                    axes(|axis| W::load(&std::array::from_fn(|lane| gains[lane][axis]), 0))
                }
            };
            W::set_displacements(bodies, fall.predict([x, y, z], wind, w));
        }
        for (index, body) in rest.iter_mut().enumerate() {
            let Body([_, _, _, w, x, y, z, _]) = *body;
            let wind = gains.get(eights_end + index).copied().unwrap_or_default();
            body.0[4..7].copy_from_slice(&fall.predict([x, y, z], wind, w));
        }
    }
}

pub(super) struct EndWork<'a, 'b> {
    pub(super) cells: BodyCells<'a>,
    pub(super) contacts: &'b mut Contacts,
    pub(super) motion: &'b Motion<'b>,
}

impl Work for EndWork<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(mut self) {
        self.contacts.end_substep::<W>(&mut self.cells, self.motion.obstacles);
    }
}

/// Bodies, for contacts.
pub(super) struct BodyCells<'a> {
    pub(super) bodies: &'a mut [Body],
    pub(super) predicted: &'a [[f32; 3]],
}

impl Cells for BodyCells<'_> {
    fn count(&self) -> usize {
        self.bodies.len()
    }

    fn inverse_mass(&self, index: usize) -> f32 {
        self.bodies[index].0[3]
    }

    fn way(&self, index: usize) -> Way {
        let Body([x, y, z, _, dx, dy, dz, _]) = self.bodies[index];
        Way { start: Vec3::new(x, y, z), displacement: Vec3::new(dx, dy, dz) }
    }

    fn predicted(&self, index: usize) -> Vec3 {
        self.predicted.get(index).copied().map_or(Vec3::ZERO, Vec3::from_array)
    }

    fn set_displacement(&mut self, index: usize, displacement: Vec3) {
        self.bodies[index].0[4..7].copy_from_slice(&displacement.to_array());
    }

    fn set_position(&mut self, index: usize, position: Vec3) {
        self.bodies[index].0[..3].copy_from_slice(&position.to_array());
    }

    #[inline(always)]
    fn may_touch<W: Wide>(&self, eight: usize, zone: &Zone) -> bool {
        if let Some(bodies) = self.bodies[8 * eight..].first_chunk::<8>() {
            let [[x, y, z, _], [dx, dy, dz, _]] = W::columns(bodies);
            return W::any(zone.may_be_met([x, y, z], [dx, dy, dz]));
        }
        self.bodies[8 * eight..]
            .iter()
            .any(|Body([x, y, z, _, dx, dy, dz, _])| zone.may_be_met([*x, *y, *z], [*dx, *dy, *dz]))
    }

    #[inline(always)]
    fn advance<W: Wide>(&mut self) {
        for Body(numbers) in self.bodies.iter_mut() {
            let (x, d) = numbers.split_at_mut(4);
            // With the inverse mass, to which 0 is added: all four at once.
            for (x, d) in x.iter_mut().zip(d) {
                *x += *d;
            }
        }
    }
}

#[inline(always)]
pub(super) fn body_pull_back(body: &mut Body, tether: &Tether) {
    let Body([x, y, z, w, dx, dy, dz, _]) = *body;
    let [root_x, root_y, root_z] = tether.root;
    let rest = Rest::new(tether.length);
    let take = pull_back([x - root_x, y - root_y, z - root_z], [dx, dy, dz], rest, w);
    for (number, take) in body.0[4..7].iter_mut().zip(take) {
        *number -= take;
    }
}
