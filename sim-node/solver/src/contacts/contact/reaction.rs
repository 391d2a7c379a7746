//! Reactions: impulses of the particles in contact with a collider on it.

use glam::{DVec3, Vec3};

use crate::kernels::lanes::{Lanes8, Wide, map_axes};
use crate::kernels::vectors::{cross, difference, masked, scaled, splat, sum};

/// Sums over the contacts of some particles with a collider.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Reaction {
    /// Impulse on the collider, times the length of a substep, in kg m.
    pub(crate) linear: DVec3,
    /// Angular impulse about its center, times the length of a substep, in kg m^2.
    pub(crate) angular: DVec3,
    pub(crate) contacts: u32,
}

impl Reaction {
    /// Adds a contact of a particle that leaves it `lost` less of its displacement.
    pub(super) fn add(&mut self, mass: f32, lost: Vec3, arm: Vec3) {
        let linear = lost.as_dvec3() * f64::from(mass);
        self.linear += linear;
        self.angular += arm.as_dvec3().cross(linear);
    }

    /// Adds an impulse, times the length of a substep, at the end of an arm.
    pub(crate) fn add_impulse(&mut self, impulse: Vec3, arm: Vec3) {
        let linear = impulse.as_dvec3();
        self.linear += linear;
        self.angular += arm.as_dvec3().cross(linear);
    }

    /// Adds the contacts of a substep.
    pub(crate) fn add_substep(&mut self, other: &Self) {
        self.linear += other.linear;
        self.angular += other.angular;
        self.contacts = self.contacts.max(other.contacts);
    }
}

/// The contacts of a row or block of particles with a collider in a substep.
#[derive(Debug, Default)]
pub(super) struct BlockReaction {
    /// Of contacts that are handled one by one. It also counts all contacts.
    pub(super) single: Reaction,
    /// Of contacts that are handled eight at a time, linear and angular, in the units of [`Reaction`].
    lanes: [[Lanes8; 3]; 2],
}

/// The reactions that a worker has summed, by collider.
///
/// Workers come to the blocks in any order. So the sums are whole numbers of a small unit, whose sum is the same in
/// every order.
#[derive(Debug, Clone, Default)]
pub(crate) struct Reactions {
    /// Units in a kg m, and in a kg m^2.
    scale: f64,
    /// Empty while nobody asks for forces.
    sums: Vec<WholeReaction>,
}

/// Memory for reactions.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct ReactionRoom {
    /// 0 while nobody asks for forces.
    pub(crate) collider_count: usize,
    /// Largest mass of a particle.
    pub(crate) mass_max: f64,
}

/// Units in the product of the largest mass and a meter: contacts that move it by 1e-6 m in a substep are exact to
/// 1e-15, and the sums have room for 1e16 m.
const UNITS_PER_MASS: f64 = (1_u128 << 72) as f64;

/// A [`Reaction`] in whole units.
#[derive(Debug, Clone, Copy, Default)]
struct WholeReaction {
    linear: [i128; 3],
    angular: [i128; 3],
    contacts: u32,
}

impl Reactions {
    pub(crate) fn new(room: ReactionRoom) -> Self {
        // A power of two, so that a division by it is exact.
        let power_of_two = f64::from_bits(room.mass_max.to_bits() & f64::INFINITY.to_bits());
        let sums = vec![WholeReaction::default(); room.collider_count];
        Self { scale: UNITS_PER_MASS / power_of_two, sums }
    }

    /// Returns the reaction of a block before its contacts; `None` if nobody asks.
    #[inline(always)]
    pub(super) fn begin_block(&self) -> Option<BlockReaction> {
        (!self.sums.is_empty()).then(BlockReaction::default)
    }

    /// Adds the contacts of a block.
    pub(super) fn add(&mut self, collider: usize, block: &BlockReaction) {
        let BlockReaction { single, lanes } = block;
        if single.contacts == 0 {
            return;
        }
        let [linear, angular] = lanes.map(|lanes| {
            let sum = |lanes: Lanes8| lanes.into_iter().map(f64::from).sum();
            DVec3::from_array(map_axes(lanes, sum))
        });
        let whole = &mut self.sums[collider];
        whole.contacts += single.contacts;
        add_whole(&mut whole.linear, (single.linear + linear) * self.scale);
        add_whole(&mut whole.angular, (single.angular + angular) * self.scale);
    }

    /// Moves the number of contacts with a collider since the last call.
    pub(crate) fn take_contacts(&mut self, collider: usize) -> u32 {
        std::mem::take(&mut self.sums[collider].contacts)
    }
}

/// Moves the impulses that all workers have summed for a collider to its reaction.
pub(crate) fn take_impulses<'a>(
    workers: impl Iterator<Item = &'a mut Reactions>,
    collider: usize,
    total: &mut Reaction,
) {
    let (mut sum, mut scale) = (WholeReaction::default(), 1.0);
    for worker in workers {
        let WholeReaction { linear, angular, .. } = std::mem::take(&mut worker.sums[collider]);
        for (sum, more) in sum.linear.iter_mut().zip(linear) {
            *sum = sum.wrapping_add(more);
        }
        for (sum, more) in sum.angular.iter_mut().zip(angular) {
            *sum = sum.wrapping_add(more);
        }
        scale = worker.scale;
    }
    total.linear += DVec3::from_array(sum.linear.map(|units| units as f64)) / scale;
    total.angular += DVec3::from_array(sum.angular.map(|units| units as f64)) / scale;
}

/// Adds a vector in whole units to sums, rounded towards zero. A component beyond the range of i128 adds its nearest end,
/// and NaN adds 0.
fn add_whole(sums: &mut [i128; 3], units: DVec3) {
    for (sum, units) in sums.iter_mut().zip(units.to_array()) {
        #[allow(clippy::cast_possible_truncation, reason = "rounds towards zero and saturates")]
        let units = units as i128;
        *sum = sum.wrapping_add(units);
    }
}

/// The contacts of eight particles after eight, before they are added to a [`BlockReaction`].
pub(super) struct LaneReaction<W> {
    linear: [W; 3],
    angular: [W; 3],
    contacts: u32,
}

/// Eight contacts, or fewer.
pub(super) struct LaneContacts<W: Wide> {
    pub(super) is_hit: W::Mask,
    pub(super) inverse_mass: W,
    /// Displacement before the contact less that after it.
    pub(super) lost: [W; 3],
    /// Position in contact.
    pub(super) position: [W; 3],
}

impl<W: Wide> LaneReaction<W> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        let zero = W::splat(0.0);
        Self { linear: [zero; 3], angular: [zero; 3], contacts: 0 }
    }

    #[inline(always)]
    pub(super) fn add(&mut self, contacts: &LaneContacts<W>, center: Vec3) {
        let LaneContacts { is_hit, inverse_mass, lost, position } = *contacts;
        let linear = masked(scaled(lost, W::splat(1.0) / inverse_mass), is_hit);
        let arm = difference(position, splat(center.to_array()));
        self.linear = sum(self.linear, linear);
        self.angular = sum(self.angular, masked(cross(arm, linear), is_hit));
        self.contacts += W::bits(is_hit).count_ones();
    }

    #[inline(always)]
    pub(super) fn add_to(self, reaction: &mut BlockReaction) {
        if self.contacts == 0 {
            return;
        }
        reaction.single.contacts += self.contacts;
        for (sums, lanes) in reaction.lanes.iter_mut().zip([self.linear, self.angular]) {
            for (sum, lanes) in sums.iter_mut().zip(lanes) {
                (W::load(sum, 0) + lanes).store(sum, 0);
            }
        }
    }
}
