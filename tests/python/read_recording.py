"""Reads a recording with the stock MCAP reader, and compares its particles with published bytes.

usage: read_recording.py RECORDING PUBLISHED, where PUBLISHED has lines "STEP HEX"
"""

import json
import struct
import sys

from jsonschema import Draft202012Validator
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

FIELDS = ["x", "y", "z", "inverse_mass", "vx", "vy", "vz", "flags"]
UINT32, FLOAT32 = 5, 7


def check_cloud(cloud):
    assert cloud.frame_id == "world"
    assert cloud.point_stride == 32
    assert [field.name for field in cloud.fields] == FIELDS
    assert [field.offset for field in cloud.fields] == [4 * i for i in range(8)]
    assert [field.type for field in cloud.fields] == [FLOAT32] * 7 + [UINT32]
    assert cloud.pose.orientation.w == 1.0


def main(recording, published):
    expected = dict(line.split() for line in open(published, encoding="ascii"))
    counts, rows, compared = {}, {}, 0
    with open(recording, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == ""
        attachments = [attachment.name for attachment in reader.iter_attachments()]
        assert attachments == ["scene.toml"], attachments
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        assert list(metadata) == ["run", "recorder"], metadata
        assert metadata["run"]["format_version"] == "7", metadata
        assert metadata["run"]["bend_count"] == "0", metadata
        last_log_time, cloud_times, validators = 0, [], {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
            assert message.log_time >= last_log_time
            last_log_time = message.log_time
            if channel.topic == "/particles":
                cloud_times.append(message.log_time)
            if channel.message_encoding == "json":
                row = json.loads(message.data)
                if schema.id not in validators:
                    definition = json.loads(schema.data)
                    Draft202012Validator.check_schema(definition)
                    validators[schema.id] = Draft202012Validator(definition)
                validators[schema.id].validate(row)
                assert row["step"] % 2**32 == message.sequence
                rows.setdefault(channel.topic, []).append(row)
        assert len(set(cloud_times)) == len(cloud_times), "two snapshots share a time"
        for schema, _channel, message, keyframe in reader.iter_decoded_messages(topics=["/keyframe"]):
            assert schema.name == "catenary.Keyframe" and len(keyframe.data) > 0
            assert keyframe.step % 2**32 == message.sequence
        for _schema, _channel, _message, transform in reader.iter_decoded_messages(topics=["/tf"]):
            rotation = transform.rotation
            # The scene's y becomes z: a quarter turn about x.
            assert abs(rotation.x - 0.5**0.5) < 1e-15 and abs(rotation.w - 0.5**0.5) < 1e-15
        for _schema, channel, message, cloud in reader.iter_decoded_messages(topics=["/particles"]):
            check_cloud(cloud)
            if str(message.sequence) in expected:
                assert cloud.data.hex() == expected[str(message.sequence)], message.sequence
                x, y, z = struct.unpack_from("<3f", cloud.data)
                assert all(abs(axis) < 100 for axis in (x, y, z))
                compared += 1
    assert compared == len(expected) > 0, (compared, len(expected))
    assert counts["/steps"] == counts["/particles"]
    assert counts["/keyframe"] > 0
    for topic, count in counts.items():
        assert metadata["recorder"][f"{topic[1:]}.written"] == str(count), topic
    assert counts["/topology"] == counts["/surface"] == counts["/tf"] == 1
    report = {topic: rows.get(topic, []) for topic in ("/tears", "/parameters")}
    print(json.dumps({"compared": compared, "counts": counts, **report}))


if len(sys.argv) != 3:
    sys.exit("usage: read_recording.py RECORDING PUBLISHED, where PUBLISHED has lines STEP HEX")
main(*sys.argv[1:])
