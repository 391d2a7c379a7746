//! Serialization of f32 with the fewest digits that parse back to the same bits.

use serde::{Serialize, Serializer};

/// Returns the f64 whose shortest text is that of the f32: 0.1, not 0.10000000149011612.
pub(crate) fn shortest(value: f32) -> f64 {
    value.to_string().parse().unwrap_or_else(|_| f64::from(value))
}

/// `#[serde(with = "decimal::number")]` for an f32.
pub(crate) mod number {
    use super::{Serializer, shortest};

    #[allow(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde requires")]
    pub(crate) fn serialize<S: Serializer>(value: &f32, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_f64(shortest(*value))
    }
}

/// `#[serde(with = "decimal::vector")]` for three f32.
pub(crate) mod vector {
    use super::{Serialize, Serializer, shortest};

    pub(crate) fn serialize<S: Serializer>(
        value: &[f32; 3],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        value.map(shortest).serialize(serializer)
    }
}

/// `#[serde(with = "decimal::pair")]` for two f32.
pub(crate) mod pair {
    use super::{Serialize, Serializer, shortest};

    #[allow(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde requires")]
    pub(crate) fn serialize<S: Serializer>(
        value: &[f32; 2],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        value.map(shortest).serialize(serializer)
    }
}

/// `#[serde(serialize_with = "decimal::vectors::serialize")]` for a list of three f32 each.
pub(crate) mod vectors {
    use super::{Serializer, shortest};

    pub(crate) fn serialize<S: Serializer>(
        values: &[[f32; 3]],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(values.iter().map(|value| value.map(shortest)))
    }
}

/// `#[serde(serialize_with = "decimal::pairs::serialize")]` for a list of two f32 each.
pub(crate) mod pairs {
    use super::{Serializer, shortest};

    pub(crate) fn serialize<S: Serializer>(
        values: &[[f32; 2]],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(values.iter().map(|value| value.map(shortest)))
    }
}

/// `#[serde(with = "decimal::optional")]` for an optional f32.
pub(crate) mod optional {
    use super::{Serialize, Serializer, shortest};

    #[allow(
        clippy::ref_option,
        clippy::trivially_copy_pass_by_ref,
        reason = "the signature that serde requires"
    )]
    pub(crate) fn serialize<S: Serializer>(
        value: &Option<f32>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        value.map(shortest).serialize(serializer)
    }
}

/// `#[serde(with = "decimal::quaternion")]` for four f32.
pub(crate) mod quaternion {
    use super::{Serialize, Serializer, shortest};

    pub(crate) fn serialize<S: Serializer>(
        value: &[f32; 4],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        value.map(shortest).serialize(serializer)
    }
}
