//! Why a command was not applied, for users.

/// There is no node.
pub const NO_NODE: &str = "no_node";
/// The node did not answer.
pub const NO_ANSWER: &str = "no_answer";
/// Too many commands wait.
pub const BUSY: &str = "busy";
/// The page showed another load.
pub const STALE_EPOCH: &str = "stale_epoch";
/// The page holds too many particles.
pub const TOO_MANY_HELD: &str = "too_many_held";
/// A recording does not take it.
pub const ONLY_LIVE: &str = "only_live";
/// A live node does not take it.
pub const ONLY_REPLAY: &str = "only_replay";

/// Reasons of the node and of the bridge, and a sentence for each.
const TEXTS: [(&str, &str); 18] = [
    ("non_finite", "a number is not finite"),
    ("out_of_range", "a value is out of its range"),
    ("unknown_particle", "the scene has no such particle"),
    ("unknown_constraint", "the scene has no such constraint"),
    ("unknown_anchor", "the scene has no such anchor"),
    ("unknown_collider", "the scene has no such collider"),
    ("unknown_parameter", "there is no such parameter"),
    ("already_torn", "it is torn already"),
    ("not_grabbed", "the particle is not held"),
    ("grabbed_by_other", "somebody else holds the particle"),
    (
        "no_effect_here",
        "it has no effect here (a frozen particle, a parameter of the other method, a step while running, a scene of another rate, or a recording)",
    ),
    (NO_NODE, "no node runs"),
    (NO_ANSWER, "the node did not answer; it may still happen"),
    (BUSY, "too many commands wait"),
    (STALE_EPOCH, "another scene was loaded meanwhile"),
    (TOO_MANY_HELD, "this page holds 16 particles already"),
    (ONLY_LIVE, "a recording cannot be changed"),
    (ONLY_REPLAY, "only a recording can do this"),
];

/// The sentence of a reason.
pub fn text(reason: &str) -> &'static str {
    TEXTS.iter().find(|(known, _)| *known == reason).map_or("", |(_, text)| text)
}
