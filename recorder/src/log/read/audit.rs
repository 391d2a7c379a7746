//! Compares the bytes of a file with those that a recorder writes for the same content.
//!
//! A reader takes from each message what it needs, so an edit of the rest would go unnoticed where
//! the checksums are gone: a key that it does not know, a time, the definition of a channel.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::{AttachmentHeader, Channel, MessageHeader, SchemaHeader};

use super::decode::LoggedMessage;
use crate::log::encoding::{MessageEncoder, TopicFormat, encode_transform};
use crate::log::rows::scene_colliders::mesh_file_name;
use crate::log::run::selection::ContentSelection;
use crate::log::run::{
    Closing, FORMAT_VERSION, REPAIR_METADATA, RunDescription, SCENE_ATTACHMENT, SCENE_MEDIA_TYPE,
    header_library,
};
use crate::log::topic::{AllCounts, Topic};

/// Most names of foreign content to keep.
const FOREIGN_MAX: usize = 16;

/// A part of a file that differs from what a recorder writes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AuditDifference {
    /// The step of the message, if the part belongs to one.
    pub step: Option<u64>,
    /// The part and its difference, for people.
    pub what: String,
}

/// The result of the comparison so far.
#[derive(Debug, Default)]
pub struct Audit {
    /// The first difference.
    difference: Option<AuditDifference>,
    /// Content of other programs, which is not compared.
    foreign: BTreeSet<String>,
    /// Names of attached meshes with the content that they name.
    mesh_files: BTreeSet<String>,
    encoder: MessageEncoder,
    /// The recording has forces.
    has_forces: bool,
    formats: Formats,
    /// The topic that each schema defines, by id. `None` for a schema of another program.
    schemas: BTreeMap<u16, Option<Topic>>,
    /// Only `written` is set.
    counts: AllCounts,
}

/// The format of each topic, in the order of [`Topic::ALL`].
#[derive(Debug)]
struct Formats([TopicFormat; Topic::ALL.len()]);

impl Default for Formats {
    fn default() -> Self {
        Self(Topic::ALL.map(TopicFormat::for_topic))
    }
}

impl Formats {
    /// Returns the topic that a schema defines. The definitions of two topics differ.
    fn topic_of_schema(&self, header: &SchemaHeader, data: &[u8]) -> Option<Topic> {
        let found = (header.name.as_str(), header.encoding.as_str(), data);
        Topic::ALL.into_iter().find(|topic| {
            let schema = &self.0[topic.index()].schema;
            (schema.name, schema.encoding, schema.data.as_slice()) == found
        })
    }
}

/// The header of a file, as it was read.
#[derive(Debug, Clone, Default)]
pub(super) struct HeaderText {
    pub(super) profile: String,
    pub(super) library: String,
    pub(super) run: BTreeMap<String, String>,
    /// `None` if the file does not declare one.
    pub(super) selection: Option<BTreeMap<String, String>>,
    /// `None` if the file has no scene.
    pub(super) scene: Option<AttachmentHeader>,
}

impl Audit {
    /// Returns the first difference.
    pub fn difference(&self) -> Option<&AuditDifference> {
        self.difference.as_ref()
    }

    /// Returns the names of content of other programs. It is not compared.
    pub fn foreign(&self) -> impl Iterator<Item = &str> {
        self.foreign.iter().map(String::as_str)
    }

    fn report(&mut self, step: Option<u64>, what: String) {
        self.difference.get_or_insert(AuditDifference { step, what });
    }

    /// Returns the names of the attached meshes so far whose content has the hash in its name. They may belong to
    /// another scene.
    pub fn mesh_files(&self) -> impl Iterator<Item = &str> {
        self.mesh_files.iter().map(String::as_str)
    }

    fn add_foreign(&mut self, name: String) {
        if self.foreign.len() < FOREIGN_MAX {
            self.foreign.insert(name);
        } else {
            self.foreign.insert("more content of other programs".to_owned());
        }
    }

    pub(super) fn check_header(
        &mut self,
        text: &HeaderText,
        run: &RunDescription,
        selection: ContentSelection,
    ) {
        self.has_forces = selection.has_topic(Topic::Forces);
        let expected = selection.to_map();
        if let Some(found) = text.selection.as_ref().filter(|found| **found != expected) {
            let key = first_other_key(found, &expected);
            self.report(
                None,
                format!("the metadata 'selection': its entry '{key}' has another form"),
            );
        }
        if text.run != run.to_map() {
            let expected = run.to_map();
            let key = first_other_key(&text.run, &expected);
            self.report(None, format!("the metadata 'run': its entry '{key}' has another form"));
        }
        let library = header_library(&run.recorder_version);
        if !text.library.starts_with(&library) || !text.profile.is_empty() {
            let what = format!("the header of the file is not that of '{}'", library.trim_end());
            self.report(None, what);
        }
        if let Some(scene) = &text.scene
            && (scene.media_type != SCENE_MEDIA_TYPE || scene.create_time != run.epoch_ns)
        {
            self.report(
                None,
                format!("the attachment {SCENE_ATTACHMENT} has another type or time"),
            );
        }
    }

    pub(super) fn add_attachment(&mut self, name: &str, content: &[u8]) {
        let is_mesh = name == mesh_file_name(content);
        if is_mesh && self.mesh_files.len() < FOREIGN_MAX {
            self.mesh_files.insert(name.to_owned());
        } else {
            self.add_foreign(format!("attachment '{name}'"));
        }
    }

    pub(super) fn add_metadata(&mut self, name: &str) {
        if name == REPAIR_METADATA {
            return;
        }
        self.add_foreign(format!("metadata '{name}'"));
    }

    pub(super) fn add_long_record(&mut self) {
        self.add_foreign("a record longer than any of a recorder".to_owned());
    }

    pub(super) fn add_schema(&mut self, header: &SchemaHeader, data: &[u8]) {
        let topic = self.formats.topic_of_schema(header, data);
        let known = self.schemas.insert(header.id, topic);
        if known.is_some_and(|known| known != topic) {
            self.report(None, format!("the file has two schemas with id {}", header.id));
        }
        if topic.is_none() {
            self.add_foreign(format!("schema '{}'", header.name));
        }
    }

    pub(super) fn check_channel(&mut self, channel: &Channel) {
        let Some(topic) = Topic::from_name(&channel.topic) else {
            self.add_foreign(format!("topic '{}'", channel.topic));
            return;
        };
        if topic == Topic::Forces && !self.has_forces {
            let what = "the metadata 'selection' does not declare /forces, which the file has";
            self.report(None, what.to_owned());
        }
        let encoding = self.formats.0[topic.index()].encoding;
        let has_own_schema = self.schemas.get(&channel.schema_id) == Some(&Some(topic));
        let has_own_encoding = channel.message_encoding == encoding && channel.metadata.is_empty();
        if !has_own_schema {
            self.report(None, format!("the schema of {} has another definition", topic.name()));
        }
        if !has_own_encoding {
            self.report(None, format!("the channel of {} has another definition", topic.name()));
        }
    }

    pub(super) fn report_unknown_channel(&mut self, id: u16) {
        self.report(None, format!("a message on channel {id}, which the file does not declare"));
    }

    pub(super) fn check_message(
        &mut self,
        logged: &LoggedMessage,
        data: &[u8],
        run: &RunDescription,
    ) {
        let LoggedMessage { message, sequence, publish_time_ns, .. } = logged;
        let (topic, step) = (message.topic(), message.step());
        self.counts[topic].written += 1;
        if *publish_time_ns != run.time_of_step_ns(step)
            || u64::from(*sequence) != step & 0xffff_ffff
        {
            let what = format!("the message on {} has the time of another step", topic.name());
            self.report(Some(step), what);
        }
        if !self.encoder.has_bytes(message, *publish_time_ns, data) {
            let what = format!(
                "the message on {} has bytes that a recorder does not write: an unknown or missing \
                 field, or another form of a value",
                topic.name()
            );
            self.report(Some(step), what);
        }
    }

    pub(super) fn check_transform(
        &mut self,
        header: &MessageHeader,
        data: &[u8],
        run: &RunDescription,
    ) {
        self.counts[Topic::Tf].written += 1;
        let time_ns = run.time_of_step_ns(0);
        let is_same = data == encode_transform(time_ns, run.origin, run.up)
            && (header.sequence, header.publish_time) == (0, time_ns);
        if !is_same || self.counts[Topic::Tf].written > 1 {
            let what = "the message on /tf does not have the frame of the run".to_owned();
            self.report(Some(0), what);
        }
    }

    pub(super) fn check_closing(&mut self, map: &BTreeMap<String, String>, closing: &Closing) {
        if *map != closing.to_map() {
            let expected = closing.to_map();
            let key = first_other_key(map, &expected);
            let what = format!("the metadata 'recorder': its entry '{key}' has another form");
            self.report(None, what);
        }
        let other = closing.counts.iter().zip(self.counts.iter()).find_map(|(claimed, found)| {
            let (topic, claimed, found) = (claimed.0, claimed.1.written, found.1.written);
            (claimed != found).then_some((topic.name(), claimed, found))
        });
        if let Some((topic, claimed, found)) = other {
            self.report(
                None,
                format!(
                    "the metadata 'recorder' counts {claimed} messages on {topic}, but the file has \
                     {found}"
                ),
            );
        }
    }

    /// Checks that a complete file has the parts that every file has once.
    pub(super) fn check_end(&mut self, closing: Option<&Closing>) {
        if closing.is_none() {
            self.report(None, "the file ends without its metadata 'recorder'".to_owned());
        }
        if self.counts[Topic::Tf].written == 0 {
            self.report(None, "the file has no message on /tf".to_owned());
        }
    }
}

/// Returns `true` if messages of this file have the form that this recorder writes.
pub(in crate::log) fn is_current_format(map: &BTreeMap<String, String>) -> bool {
    map.get("format_version").is_some_and(|version| *version == FORMAT_VERSION.to_string())
}

/// Returns the version of the format of this file; 0 without one.
pub(in crate::log) fn format_version(map: &BTreeMap<String, String>) -> u32 {
    map.get("format_version").and_then(|version| version.parse().ok()).unwrap_or_default()
}

/// Returns the first key whose value differs.
fn first_other_key<'a>(
    found: &'a BTreeMap<String, String>,
    expected: &'a BTreeMap<String, String>,
) -> &'a str {
    let mut keys = found.keys().chain(expected.keys());
    keys.find(|key| found.get(*key) != expected.get(*key)).map_or("", String::as_str)
}
