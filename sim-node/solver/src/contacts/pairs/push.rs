//! The share of an overlap that changes velocities, and the share that does not.

/// Fraction of the contact distance up to which old overlap is resolved at once.
const OLD_AT_ONCE: f32 = 0.02;
/// Fraction of the remaining old overlap that is resolved in each substep.
const OLD_PER_SUBSTEP: f32 = 0.2;

/// The two parts of a push along the normal.
pub(super) struct Push {
    /// Part that changes the velocity.
    pub(super) displacement: f32,
    /// Part that does not.
    pub(super) position: f32,
}

impl Push {
    /// `depth` is the overlap at the end of the substep, `old` at its start, negative for a gap.
    #[inline(always)]
    pub(super) fn new(depth: f32, old: f32, distance: f32) -> Self {
        let old = if old > 0.0 { old } else { 0.0 };
        let at_once = OLD_AT_ONCE * distance;
        let at_once = if old < at_once { old } else { at_once };
        let displacement = depth - old + at_once;
        let displacement = if displacement > 0.0 { displacement } else { 0.0 };
        let displacement = if displacement < depth { displacement } else { depth };
        Self { displacement, position: OLD_PER_SUBSTEP * (depth - displacement) }
    }
}
