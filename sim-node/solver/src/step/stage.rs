//! The stages of a step, in order.

/// A stage of a step. The declaration order is the order of execution.
///
/// x is the position of a particle, d its displacement in the substep, v its velocity, w its inverse
/// mass; h = dt / substeps in seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stage {
    /// Anchored and grabbed particles: d = their share of the path to the target.
    Drive,
    /// Force of the wind on triangles: a change of v for each corner.
    Wind,
    /// v = max(0, 1 - c h) v + h a, |v| <= `max_speed`; d = h v; fixed particles keep their d.
    Predict,
    /// Constraints, group by group, `iterations` times: `delta_lambda` = -(C + a lambda) /
    /// (`w_a` + `w_b` + a) with a = compliance / h^2 (xpbd), or the share k' of C (pbd).
    Project,
    /// Bends, group by group, in the same passes: `delta_Lambda` = -(C + a Lambda) / (sum of w c^2 + a)
    /// with C = sum of c x, less the rest value along its own direction for a hinge with a curved rest shape.
    Bend,
    /// Constraints longer than `max_stretch` times their rest length: back to it, pulling only.
    LimitStretch,
    /// Free particles beyond the length of a tether: d is shortened to it, one tether after the other, pulling only.
    Tether,
    /// Particles nearer to each other, or to a triangle, than the contact distance: pushed apart along the line between
    /// them, one after the other in the order of a hash; friction on the tangential d.
    ParticleContact,
    /// Free particles inside a collider, or on a path through a mesh: pushed out along its normal; friction on the
    /// tangential d.
    Contact,
    /// x = x + d; v = d / h; particles in contact take the velocity that their contacts leave them.
    Advance,
    /// Constraints beyond a limit of length or force are taken out, in index order.
    Tear,
    /// Particles whose state is not finite stay where the step began; zeros become +0.
    Freeze,
    /// The hash of the state: XXH3-64 of the particles, seeded with the torn constraints.
    Hash,
}

impl Stage {
    /// The stages of each substep, in order.
    pub(crate) const OF_SUBSTEP: [Self; 10] = [
        Self::Drive,
        Self::Wind,
        Self::Predict,
        Self::Project,
        Self::Bend,
        Self::LimitStretch,
        Self::Tether,
        Self::ParticleContact,
        Self::Contact,
        Self::Advance,
    ];

    /// The stages after the last substep, in order.
    pub(crate) const AFTER_SUBSTEPS: [Self; 3] = [Self::Tear, Self::Freeze, Self::Hash];

    /// True for stages that run constraint group by constraint group.
    pub(crate) fn is_grouped(self) -> bool {
        matches!(self, Self::Project | Self::Bend | Self::LimitStretch)
    }
}
