//! The key `path` of `[[collider]]`: points in time, or the file of a mesh.

use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, Error, SeqAccess, Visitor};

use super::anchor::FileWaypoint;
use super::value::{Spanned, Tables, Word};

/// Points in time, or the file of a mesh.
#[derive(Debug)]
pub(super) enum ColliderPath {
    Points(Tables<FileWaypoint>),
    File(String),
}

impl<'de> Deserialize<'de> for ColliderPath {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(PathVisitor)
    }
}

struct PathVisitor;

impl<'de> Visitor<'de> for PathVisitor {
    type Value = ColliderPath;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a list of points in time, or the file of a mesh")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<ColliderPath, E> {
        Ok(ColliderPath::File(text.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<ColliderPath, A::Error> {
        let mut points = Tables::new();
        while let Some(point) = list.next_element()? {
            points.push(point);
        }
        Ok(ColliderPath::Points(points))
    }
}

impl ColliderPath {
    /// The file of a mesh.
    pub(super) fn file(path: &Spanned<Self>) -> Option<Word> {
        match path.get_ref() {
            Self::File(name) => Some(path.with(name.clone())),
            Self::Points(_) => None,
        }
    }

    /// The points in time.
    pub(super) fn points(path: &Spanned<Self>) -> Option<&Tables<FileWaypoint>> {
        match path.get_ref() {
            Self::Points(points) => Some(points),
            Self::File(_) => None,
        }
    }
}
