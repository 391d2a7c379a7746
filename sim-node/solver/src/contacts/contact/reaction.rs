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

/// Sums over the contacts of a row or block of particles with a collider in a step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BlockReaction {
    /// Of contacts that are handled one by one. It also counts all contacts of the substep.
    pub(crate) single: Reaction,
    /// Of contacts that are handled eight at a time, linear and angular, in the units of [`Reaction`].
    lanes: [[Lanes8; 3]; 2],
}

/// The sum of block reactions, lane by lane.
#[derive(Debug, Default)]
pub(crate) struct ReactionSum {
    single: Reaction,
    lanes: [[[f64; 8]; 3]; 2],
}

impl ReactionSum {
    /// Takes a block's impulses, not its contacts.
    pub(crate) fn take(&mut self, block: &mut BlockReaction) {
        let BlockReaction { single, lanes } = std::mem::take(block);
        self.single.add_substep(&single);
        let sums = self.lanes.as_flattened_mut().as_flattened_mut();
        for (sum, lane) in sums.iter_mut().zip(lanes.as_flattened().as_flattened()) {
            *sum += f64::from(*lane);
        }
    }

    /// Adds the impulses to those of a reaction.
    pub(crate) fn add_to(&self, total: &mut Reaction) {
        let [linear, angular] = self
            .lanes
            .map(|sums| DVec3::from_array(map_axes(sums, |lanes| lanes.into_iter().sum())));
        total.linear += self.single.linear + linear;
        total.angular += self.single.angular + angular;
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
