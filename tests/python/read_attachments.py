"""Reads the attachments and the colliders of a recording with the stock MCAP reader, and prints them as JSON.

usage: read_attachments.py RECORDING
"""

import json
import sys

from mcap.reader import make_reader
from xxhash import xxh3_64_hexdigest

if len(sys.argv) != 2:
    sys.exit("usage: read_attachments.py RECORDING")
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, validate_crcs=True)
    attachments = {}
    for attachment in reader.iter_attachments():
        lines = attachment.data.decode().splitlines()
        attachments[attachment.name] = {
            "hash": xxh3_64_hexdigest(attachment.data),
            "vertices": [
                [float(word) for word in line.split()[1:]] for line in lines if line.startswith("v ")
            ],
            "faces": [[int(word) for word in line.split()[1:]] for line in lines if line.startswith("f ")],
        }
    rows = [json.loads(message.data) for _, _, message in reader.iter_messages(topics=["/colliders"])]
    print(json.dumps({"attachments": attachments, "colliders": [row["colliders"] for row in rows]}))
