//! A recording for Foxglove viewers: a copy with `/scene`, the drawing that the viewer's server sends.

use std::collections::BTreeMap;
use std::io::{Read, Write};

use anyhow::{Context, bail};
use mcap::records::{MessageHeader, Metadata, Record};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::write::NoSeek;
use mcap::{Attachment, WriteOptions, Writer};
use recording::{
    AllCounts, CLOSING_METADATA, Closing, DrawnMesh, GapCounter, LogReader, SCENE_TOPIC,
    SceneDrawing, SceneState, Topic, TopicFormat, scene_format,
};
use sim_contract::TornConstraint;

use super::snapshots::Snapshots;

/// Copies the whole recording, with a drawing after each selected snapshot.
pub(crate) fn write(snapshots: &Snapshots<'_>, out: &mut dyn Write) -> anyhow::Result<()> {
    let mut source = (snapshots.open_bytes)()?;
    let mut copy = RecordingCopy::begin(&mut source, out)?;
    let mut drawing: Option<(u16, SceneDrawing)> = None;
    snapshots.for_each(|state| {
        copy.copy_through(state.row.step)?;
        let (channel, drawing) = match &mut drawing {
            Some(drawing) => drawing,
            unset => {
                // Only now, because numbers of channels are those of the source.
                let channel = copy.add_channel(SCENE_TOPIC, &scene_format())?;
                unset.insert((channel, SceneDrawing::new(mesh(state))))
            }
        };
        drawing.set_colliders(&state.collider_states());
        drawing.set_torn(&torn(state));
        let time_ns = snapshots.run.time_of_step_ns(state.row.step);
        copy.insert(*channel, &drawing.encode(time_ns, &state.particles))
    })?;
    copy.finish(|| count_gaps(snapshots))
}

/// Counts the messages that are missing in the recording, as their numbers show.
fn count_gaps(snapshots: &Snapshots<'_>) -> anyhow::Result<AllCounts> {
    let mut log = LogReader::new((snapshots.open_bytes)()?)?;
    let mut gaps = GapCounter::for_selection(log.selection());
    while let Some(logged) = log.next_message()? {
        gaps.add(&logged.message);
    }
    Ok(gaps.counts())
}

fn mesh(state: &SceneState) -> DrawnMesh {
    let constraints = &state.constraints;
    DrawnMesh {
        ends: constraints.iter().map(|one| [one.a, one.b]).collect(),
        triangles: state.triangles.iter().map(|one| one.corners).collect(),
        collider_meshes: state.collider_meshes.as_deref().cloned().unwrap_or_default(),
        bounds: bounds(state),
    }
}

/// Returns the least and the greatest coordinates.
fn bounds(state: &SceneState) -> [[f32; 3]; 2] {
    let points = state.particles.iter().map(|one| glam::Vec3::from_array(one.position));
    let boxes = points.filter(|point| point.is_finite()).map(|point| [point, point]);
    let around = boxes.reduce(|[min, max], [low, high]| [min.min(low), max.max(high)]);
    around.unwrap_or_default().map(|corner| corner.to_array())
}

fn torn(state: &SceneState) -> Vec<TornConstraint> {
    state.torn_constraints().map(|index| TornConstraint::new(index, None)).collect()
}

/// The copy of a recording, up to the record that was copied last.
pub(super) struct RecordingCopy<'a> {
    source: &'a mut dyn Read,
    reader: LinearReader,
    file: Writer<NoSeek<&'a mut dyn Write>>,
    particles_channel: Option<u16>,
    /// The row in /steps whose snapshot has not come yet.
    row: Option<(MessageHeader, Vec<u8>)>,
    /// The topics of a recording, by channel.
    topics: BTreeMap<u16, Topic>,
    /// Messages of these topics that are copied.
    counts: AllCounts,
    /// The source states the end of its recording.
    has_closing: bool,
    /// The header of the snapshot that was copied last.
    snapshot: Option<MessageHeader>,
}

impl<'a> RecordingCopy<'a> {
    /// Reads the header of `source` and begins a copy with the same one.
    pub(super) fn begin(source: &'a mut dyn Read, out: &'a mut dyn Write) -> anyhow::Result<Self> {
        // The end of the file may be missing.
        let options = LinearReaderOptions::default().with_skip_end_magic(true);
        let mut reader = LinearReader::new_with_options(options);
        let Some(Record::Header(header)) = next_record(&mut reader, source)? else {
            bail!("has no MCAP header");
        };
        let file = WriteOptions::new()
            .profile(header.profile)
            .library(header.library)
            .disable_seeking(true)
            .compression(Some(mcap::Compression::Zstd))
            .compression_level(1)
            .compression_threads(0)
            .create(NoSeek::new(out))?;
        Ok(Self {
            source,
            reader,
            file,
            particles_channel: None,
            row: None,
            topics: BTreeMap::new(),
            counts: AllCounts::default(),
            has_closing: false,
            snapshot: None,
        })
    }

    /// Copies everything up to the snapshot of a step, and the snapshot.
    pub(super) fn copy_through(&mut self, step: u64) -> anyhow::Result<()> {
        // The sequence of a message is the low half of its step.
        let sequence = step & u64::from(u32::MAX);
        while let Some(record) = next_record(&mut self.reader, self.source)? {
            if self.copy(record)?.is_some_and(|copied| u64::from(copied) == sequence) {
                return Ok(());
            }
        }
        bail!("has no snapshot of step {step}")
    }

    /// Copies the rest and writes the index. If the source has no end, the copy declares that, with the
    /// messages that `count_gaps` finds missing. If it ends before the snapshot of a row in /steps, the row is left
    /// out.
    pub(super) fn finish(
        mut self,
        count_gaps: impl FnOnce() -> anyhow::Result<AllCounts>,
    ) -> anyhow::Result<()> {
        while let Some(record) = next_record(&mut self.reader, self.source)? {
            self.copy(record)?;
        }
        if !self.has_closing {
            let gaps = count_gaps()?;
            for topic in Topic::ALL {
                self.counts[topic].gaps = gaps[topic].gaps;
            }
            self.counts.set_received_to_written();
            let stop_reason = "unknown: the recording had no end".to_owned();
            let closing = Closing { stop_reason, counts: self.counts, unreadable: 0 };
            let (name, metadata) = (CLOSING_METADATA.to_owned(), closing.to_map());
            self.file.write_metadata(&Metadata { name, metadata })?;
        }
        self.file.finish()?;
        Ok(())
    }

    /// Adds a topic that the source lacks. Returns its channel.
    pub(super) fn add_channel(&mut self, topic: &str, format: &TopicFormat) -> anyhow::Result<u16> {
        let schema = &format.schema;
        let schema_id = self.file.add_schema(schema.name, schema.encoding, &schema.data)?;
        Ok(self.file.add_channel(schema_id, topic, format.encoding, &BTreeMap::new())?)
    }

    /// Writes a message with the times of the snapshot that was copied last.
    pub(super) fn insert(&mut self, channel_id: u16, data: &[u8]) -> anyhow::Result<()> {
        let snapshot = self.snapshot.context("no snapshot was copied")?;
        let header = MessageHeader { channel_id, ..snapshot };
        Ok(self.file.write_to_known_channel(&header, data)?)
    }

    /// Copies a record. Records of the index are left out, because the copy has one of its own. Returns the
    /// sequence of a snapshot.
    fn copy(&mut self, record: Record<'_>) -> anyhow::Result<Option<u32>> {
        match record {
            Record::Schema { header, data } => {
                self.file.add_schema_with_id(header.id, &header.name, &header.encoding, &data)?;
            }
            Record::Channel(channel) => {
                let mcap::records::Channel { id, schema_id, topic, message_encoding, metadata } =
                    channel;
                if topic == SCENE_TOPIC {
                    bail!("has /scene already; export the recording that it is a copy of");
                }
                if topic == Topic::Particles.name() {
                    self.particles_channel = Some(id);
                }
                self.topics.extend(Topic::from_name(&topic).map(|topic| (id, topic)));
                self.file.add_channel_with_id(
                    id,
                    schema_id,
                    &topic,
                    &message_encoding,
                    &metadata,
                )?;
            }
            Record::Message { header, data } => {
                self.write_row()?;
                if self.topics.get(&header.channel_id) == Some(&Topic::Steps) {
                    self.row = Some((header, data.into_owned()));
                    return Ok(None);
                }
                self.write_message(&header, &data)?;
                if self.particles_channel == Some(header.channel_id) {
                    self.snapshot = Some(header);
                    return Ok(Some(header.sequence));
                }
            }
            Record::Attachment { header, data, .. } => self.file.attach(&Attachment {
                log_time: header.log_time,
                create_time: header.create_time,
                name: header.name,
                media_type: header.media_type,
                data,
            })?,
            Record::Metadata(metadata) => {
                self.has_closing |= metadata.name == CLOSING_METADATA;
                if self.has_closing {
                    self.write_row()?;
                }
                self.file.write_metadata(&metadata)?;
            }
            _ => {}
        }
        Ok(None)
    }
}

impl RecordingCopy<'_> {
    fn write_row(&mut self) -> anyhow::Result<()> {
        match self.row.take() {
            Some((header, data)) => self.write_message(&header, &data),
            None => Ok(()),
        }
    }

    fn write_message(&mut self, header: &MessageHeader, data: &[u8]) -> anyhow::Result<()> {
        self.file.write_to_known_channel(header, data)?;
        if let Some(topic) = self.topics.get(&header.channel_id) {
            self.counts[*topic].written += 1;
        }
        Ok(())
    }
}

/// Returns the next record, or `None` at the end of the source, also within a record.
fn next_record(
    reader: &mut LinearReader,
    source: &mut dyn Read,
) -> anyhow::Result<Option<Record<'static>>> {
    loop {
        let Some(event) = reader.next_event() else { return Ok(None) };
        match event? {
            LinearReadEvent::ReadRequest(size_bytes) => {
                let count = source.read(reader.insert(size_bytes))?;
                if count == 0 {
                    return Ok(None);
                }
                reader.notify_read(count);
            }
            LinearReadEvent::Record { opcode, data } => {
                return Ok(Some(mcap::parse_record(opcode, data)?.into_owned()));
            }
        }
    }
}
