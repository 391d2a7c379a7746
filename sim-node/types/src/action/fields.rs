//! The fields of each kind of action.

use crate::suggestion::did_you_mean;

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

    /// Returns ` (did you mean 'x'?)` for the first unknown name in the JSON form of an action, its kind or one of its fields,
    /// or an empty text.
    pub fn meant<'a>(kind: &str, fields: impl IntoIterator<Item = &'a str>) -> String {
        let Some(row) = Self::ALL.iter().find(|row| row.kind == kind) else {
            return did_you_mean(kind, Self::ALL.map(|row| row.kind));
        };
        let known = || ["kind"].iter().chain(row.required).chain(row.optional).copied();
        let unknown = fields.into_iter().find(|name| known().all(|known| known != *name));
        unknown.map_or_else(String::new, |name| did_you_mean(name, known()))
    }

    const fn new(
        kind: &'static str,
        required: &'static [&'static str],
        optional: &'static [&'static str],
    ) -> Self {
        Self { kind, required, optional }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_kind_or_field_is_answered_with_the_nearest_one() {
        assert_eq!(ActionFields::meant("gab", ["kind"]), " (did you mean 'grab'?)");
        let partcle = ActionFields::meant("pin", ["kind", "partcle"]);
        assert_eq!(partcle, " (did you mean 'particle'?)");
        assert_eq!(ActionFields::meant("pin", ["kind", "particle"]), "");
    }
}
