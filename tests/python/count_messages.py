"""Counts the messages of a recording by topic, with the indexed reader of the stock MCAP package.

usage: count_messages.py RECORDING
"""

import json
import sys

from mcap.reader import make_reader


def main(recording):
    counts = {}
    with open(recording, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        for _, channel, _ in reader.iter_messages():
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
        statistics = reader.get_summary().statistics
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    assert statistics.message_count == sum(counts.values())
    print(json.dumps({"counts": counts, "repair": metadata["repair"]}))


main(*sys.argv[1:])
