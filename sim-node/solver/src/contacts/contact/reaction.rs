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

    pub(crate) fn add_all(&mut self, other: &Self) {
        self.linear += other.linear;
        self.angular += other.angular;
        self.contacts += other.contacts;
    }
}

/// A [`Reaction`] of particles in eight lanes.
pub(super) struct LaneReaction<W> {
    linear: [W; 3],
    angular: [W; 3],
    contacts: W,
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
        Self { linear: [zero; 3], angular: [zero; 3], contacts: zero }
    }

    #[inline(always)]
    pub(super) fn add(&mut self, contacts: &LaneContacts<W>, center: Vec3) {
        let LaneContacts { is_hit, inverse_mass, lost, position } = *contacts;
        let linear = masked(scaled(lost, W::splat(1.0) / inverse_mass), is_hit);
        let arm = difference(position, splat(center.to_array()));
        self.linear = sum(self.linear, linear);
        self.angular = sum(self.angular, masked(cross(arm, linear), is_hit));
        self.contacts = self.contacts + W::splat(1.0).masked(is_hit);
    }

    /// Adds the lanes to a sum, in order.
    #[inline(always)]
    pub(super) fn add_to(self, reaction: &mut Reaction) {
        let total = |lanes: W| {
            let mut numbers: Lanes8 = [0.0; 8];
            lanes.store(&mut numbers, 0);
            total_of(&numbers)
        };
        let contacts = total(self.contacts);
        if contacts == 0.0 {
            return;
        }
        reaction.linear += DVec3::from_array(map_axes(self.linear, total));
        reaction.angular += DVec3::from_array(map_axes(self.angular, total));
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a number of particles"
        )]
        let contacts = contacts as u32;
        reaction.contacts += contacts;
    }
}

fn total_of(numbers: &Lanes8) -> f64 {
    numbers.iter().map(|number| f64::from(*number)).sum()
}
