//! The fields of each kind of action.

/// The fields of a kind of action in its JSON form, besides `kind`.
#[derive(Debug)]
pub struct ActionFields {
    /// Name of the kind.
    pub kind: &'static str,
    /// Fields that must be present.
    pub required: &'static [&'static str],
    /// Fields that may be absent.
    pub optional: &'static [&'static str],
}

impl ActionFields {
    /// All kinds, in the order of their numbers on the wire.
    pub const ALL: [Self; 23] = [
        Self::new("pin", &["particle"], &[]),
        Self::new("unpin", &["particle"], &[]),
        Self::new("grab", &["particle", "target"], &["over_s"]),
        Self::new("move", &["particle", "target"], &["over_s"]),
        Self::new("release", &["particle"], &["force"]),
        Self::new("pause", &[], &[]),
        Self::new("resume", &[], &[]),
        Self::new("step", &["count"], &[]),
        Self::new("reset", &[], &[]),
        Self::new("push", &["center", "radius", "delta"], &["limit"]),
        Self::new("cut", &["constraint"], &[]),
        Self::new("cut_radius", &["center", "radius"], &[]),
        Self::new("cut_segment", &["from", "to", "direction"], &[]),
        Self::new("move_anchor", &["anchor", "translation"], &["rotation", "over_s"]),
        Self::new("move_collider", &["collider", "translation"], &["rotation", "over_s"]),
        Self::new("set", &["parameter", "value"], &["constraint_kind", "block", "collider"]),
        Self::new("load", &["scene"], &[]),
        Self::new("rewind", &[], &["to_step", "back_steps"]),
        Self::new("restore", &["contents", "state_hash"], &[]),
        Self::new("mark", &["text"], &[]),
        Self::new(
            "drive_body",
            &["collider", "translation"],
            &["rotation", "velocity", "angular_velocity", "force", "torque"],
        ),
        Self::new("follow", &["object", "object_index", "path"], &["append"]),
        Self::new("unknown", &["number"], &[]),
    ];

    const fn new(
        kind: &'static str,
        required: &'static [&'static str],
        optional: &'static [&'static str],
    ) -> Self {
        Self { kind, required, optional }
    }
}
