"""Writes random bytes into the services `ready` and `restore` of a node, as fast as it can.

usage: flood.py PREFIX ROOT SECONDS
"""

import ctypes
import os
import random
import sys
import time

import iceoryx2 as iox2

UINT32, UINT64 = ctypes.c_uint32, ctypes.c_uint64


def struct(name, *fields):
    """A structure of the contract. Each group of fields is a type and names separated by spaces."""
    flat = [(field, kind) for kind, names in fields for field in names.split()]
    functions = {"type_name": staticmethod(lambda: f"catenary.{name}")}
    return type(name, (ctypes.Structure,), {"_fields_": flat, **functions})


Ready = struct("Ready", (UINT64, "client_id run_id step"), (UINT32, "every tag"))
RestoreHeader = struct(
    "RestoreHeader",
    (UINT64, "client_id sequence scene_hash size_bytes"),
    (UINT32, "particle_count contents"),
)

PARTICLE_COUNT = 168
STATE_SIZE_BYTES = 32 * PARTICLE_COUNT + 200


def random_header():
    """Random numbers, or a header that fits its payload of random bytes."""
    if random.random() < 0.5:
        return RestoreHeader.from_buffer_copy(os.urandom(ctypes.sizeof(RestoreHeader)))
    return RestoreHeader(7, 1, 0, STATE_SIZE_BYTES, PARTICLE_COUNT, random.choice([1, 2]))


def main(prefix, root, seconds):
    config = iox2.Config.default() if hasattr(iox2, "Config") else iox2.config.default()
    config.global_cfg.prefix = iox2.FileName.new(prefix)
    config.global_cfg.root_path = iox2.Path.new(root)
    node = iox2.NodeBuilder.new().config(config).create(iox2.ServiceType.Ipc)
    ready = node.service_builder(iox2.ServiceName.new("sim/ready")).publish_subscribe(Ready).open()
    restore = (
        node.service_builder(iox2.ServiceName.new("sim/restore"))
        .publish_subscribe(iox2.Slice[ctypes.c_uint8])
        .user_header(RestoreHeader)
        .open()
    )
    members = ready.publisher_builder().create()
    states = restore.publisher_builder().initial_max_slice_len(STATE_SIZE_BYTES).create()
    noise = [os.urandom(STATE_SIZE_BYTES) for _ in range(16)]
    end, count = time.monotonic() + float(seconds), 0
    while time.monotonic() < end:
        members.loan_uninit().write_payload(
            Ready.from_buffer_copy(os.urandom(ctypes.sizeof(Ready)))
        ).send()
        sample = states.loan_slice_uninit(STATE_SIZE_BYTES)
        header = random_header()
        ctypes.memmove(sample.user_header(), ctypes.byref(header), ctypes.sizeof(header))
        ctypes.memmove(sample.payload().as_ptr(), random.choice(noise), STATE_SIZE_BYTES)
        sample.assume_init().send()
        count += 2
    print(f'{{"messages": {count}}}')
    # Destroyed in any other order, the ports leave a dead node behind.
    del sample, states, members, restore, ready, node


if len(sys.argv) != 4:
    sys.exit("usage: flood.py PREFIX ROOT SECONDS, such as: flood.py iox2_ /tmp/iceoryx2 10")
main(*sys.argv[1:])
