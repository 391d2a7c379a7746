"""Commands a running node, knowing nothing but the tables of SERVICES.md, and prints the outcomes as JSON.

usage: foreign_client.py PREFIX ROOT SERVICES.md
"""

import ctypes
import json
import re
import struct
import sys

import iceoryx2 as iox2

NUMBERS = {
    "u8": ctypes.c_uint8,
    "u32": ctypes.c_uint32,
    "i32": ctypes.c_int32,
    "u64": ctypes.c_uint64,
    "f32": ctypes.c_float,
    "f64": ctypes.c_double,
}


def structure(page, name):
    """The structure that the page describes under a name, checked against its offsets and sizes."""
    if name in NUMBERS:
        return NUMBERS[name]
    name = f"catenary.{name}"
    section = page.split(f"\n### {name}\n", 1)[1].split("\n### ", 1)[0]
    rows = re.findall(r"^\| (\d+) \| (\d+) \| (\w+)([\[\]0-9]*) \| `(\w+)` \|", section, re.M)
    fields = []
    for _, _, kind, lengths, field in rows:
        element = structure(page, kind)
        for length in reversed(re.findall(r"\d+", lengths)):
            element = element * int(length)
        fields.append((field, element))
    functions = {"type_name": staticmethod(lambda: name)}
    result = type(name, (ctypes.Structure,), {"_fields_": fields, **functions})
    assert ctypes.sizeof(result) == int(re.search(r"(\d+) bytes, alignment", section)[1]), name
    for offset, size, _, _, field in rows:
        place = getattr(result, field)
        assert (place.offset, place.size) == (int(offset), int(size)), (name, field)
    return result


def numbers(page, title):
    """The numbers of a row of the table, by name."""
    row = re.search(rf"^\| {re.escape(title)} \| (.*) \|$", page, re.M)[1]
    pairs = (entry.split(" ", 1) for entry in row.split(", "))
    return {name: int(number) for number, name in pairs}


def main(prefix, root, path):
    with open(path, encoding="utf-8") as file:
        page = file.read()
    Command, Outcome = structure(page, "Command"), structure(page, "Outcome")
    for name in re.findall(r"^### catenary\.(\w+)", page, re.M):
        structure(page, name)
    kinds = numbers(page, "`kind` of a command")
    reasons = {number: name for name, number in numbers(page, "`reason` of an outcome").items()}

    config = iox2.Config.default() if hasattr(iox2, "Config") else iox2.config.default()
    config.global_cfg.prefix = iox2.FileName.new(prefix)
    config.global_cfg.root_path = iox2.Path.new(root)
    node = iox2.NodeBuilder.new().config(config).create(iox2.ServiceType.Ipc)

    def service(name, kind):
        builder = node.service_builder(iox2.ServiceName.new(name))
        return builder.publish_subscribe(kind).open()

    outcomes = service("sim/outcomes", Outcome)
    commands = service("sim/commands", Command)
    subscriber = outcomes.subscriber_builder().create()
    publisher = commands.publisher_builder().create()

    def request(kind, client_id, sequence, layout, *values):
        """Sends a command, and waits for its outcome."""
        command = Command(kind=kinds[kind], client_id=client_id, sequence=sequence)
        struct.pack_into("<" + layout, command.fields, 0, *values)
        publisher.loan_uninit().write_payload(command).send()
        while True:
            sample = subscriber.receive()
            if sample is None:
                node.wait(iox2.Duration.from_millis(1))
                continue
            answer = Outcome.from_buffer_copy(sample.payload().contents)
            if (answer.command.client_id, answer.command.sequence) == (client_id, sequence):
                return [kind, answer.status, reasons[answer.reason]]

    report = [
        request("grab", 7, 1, "I3ff", 90, 0.5, 0.2, 0.3, 0.1),
        request("pin", 7, 2, "I", 10**6),
        request("cut", 7, 3, "I", 40),
        request("cut", 7, 4, "I", 40),
        request("pin", 2**53 - 1, 1, "I", 3),
        request("pin", 2**53, 1, "I", 4),
        request("load", 2**64 - 1, 1, "160s", b"rope"),
    ]
    print(json.dumps(report))
    # Destroyed in any other order, the ports leave a dead node behind.
    del subscriber, publisher, outcomes, commands
    del node


if len(sys.argv) != 4:
    sys.exit("usage: foreign_client.py PREFIX ROOT SERVICES.md")
main(*sys.argv[1:])
