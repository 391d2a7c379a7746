//! The keys of each table, for the error of an unknown key.

use serde::de::value::Error;
use serde::de::{Deserialize, Deserializer, Error as _, Visitor};
use serde::forward_to_deserialize_any;
use sim_types::{did_you_mean, nearest};

use crate::scene::read::anchor::FileAnchor;
use crate::scene::read::collider::FileCollider;
use crate::scene::read::contact::FileContact;
use crate::scene::read::element::{FileBend, FileConstraint, FileParticle};
use crate::scene::read::file_scene::FileScene;
use crate::scene::read::generator::file::FileGenerator;
use crate::scene::read::settings::FileSolver;
use crate::scene::read::wind::FileWind;

/// Returns `true` for the keys that are lists of tables.
pub(super) fn is_list_of_tables(path: &str) -> bool {
    ["particle", "constraint", "bend", "collider", "anchor", "generate"].contains(&path)
}

/// Returns the advice for an unknown key: a similar key of this table, the tables that have the key, or a
/// similar key of another table. Empty without such a key.
pub(super) fn advice<'a>(key: &str, allowed: impl IntoIterator<Item = &'a str>) -> String {
    let similar = did_you_mean(key, allowed);
    if !similar.is_empty() {
        return similar;
    }
    let owners = tables().into_iter().filter(|(_, keys)| keys.contains(&key));
    let owners: Vec<_> = owners.map(|(table, _)| table).collect();
    if !owners.is_empty() {
        return format!(" (a key of {})", owners.join(", "));
    }
    // The end of a word alone, such as `speed` of `max_speed`, is too little to point to another table.
    let begins_alike = |one: &&str| one.chars().next() == key.chars().next();
    let elsewhere = tables().into_iter().find_map(|(table, keys)| {
        let nearest = nearest(key, keys.iter().copied().filter(begins_alike))?;
        Some(format!(" (did you mean '{nearest}' of {table}?)"))
    });
    elsewhere.unwrap_or_default()
}

/// Each table of a scene with its keys.
fn tables() -> [(&'static str, &'static [&'static str]); 10] {
    [
        ("the top of the file", keys::<FileScene>()),
        ("[solver]", keys::<FileSolver>()),
        ("[wind]", keys::<FileWind>()),
        ("[contact]", keys::<FileContact>()),
        ("[[particle]]", keys::<FileParticle>()),
        ("[[constraint]]", keys::<FileConstraint>()),
        ("[[bend]]", keys::<FileBend>()),
        ("[[collider]]", keys::<FileCollider>()),
        ("[[anchor]]", keys::<FileAnchor>()),
        ("[[generate]]", keys::<FileGenerator>()),
    ]
}

/// Returns the names of the fields that a struct asks its deserializer for.
fn keys<T: Deserialize<'static>>() -> &'static [&'static str] {
    let mut keys: &[&str] = &[];
    let _stopped = T::deserialize(KeyReader(&mut keys));
    keys
}

/// Deserializer that notes the fields of a struct and reads nothing.
struct KeyReader<'k>(&'k mut &'static [&'static str]);

impl<'de> Deserializer<'de> for KeyReader<'_> {
    type Error = Error;

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        fields: &'static [&'static str],
        _visitor: V,
    ) -> Result<V::Value, Error> {
        *self.0 = fields;
        Err(Error::custom("only the fields are read"))
    }

    fn deserialize_any<V: Visitor<'de>>(self, _visitor: V) -> Result<V::Value, Error> {
        Err(Error::custom("it is no struct"))
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option
        unit unit_struct newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}
