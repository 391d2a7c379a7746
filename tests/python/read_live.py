"""Reads a snapshot of a running node with the iceoryx2 package, and prints it as JSON.

usage: read_live.py PREFIX ROOT
"""

import ctypes
import json
import sys

import iceoryx2 as iox2


class ParticleState(ctypes.Structure):
    _fields_ = [
        ("position", ctypes.c_float * 3),
        ("inverse_mass", ctypes.c_float),
        ("velocity", ctypes.c_float * 3),
        ("flags", ctypes.c_uint32),
    ]

    @staticmethod
    def type_name():
        return "catenary.ParticleState"


class SnapshotHeader(ctypes.Structure):
    _fields_ = (
        [("contract_version", ctypes.c_uint32), ("solver_version", ctypes.c_uint32)]
        + [
            (name, ctypes.c_uint64)
            for name in (
                "run_id step scene_step keyframe_step sim_time_ns publish_monotonic_ns state_hash "
                "outcome_count wake_late_ns solve_ns"
            ).split()
        ]
        + [
            (name, ctypes.c_uint32)
            for name in (
                "topology_revision torn_count particle_count flags stride spare"
            ).split()
        ]
    )

    @staticmethod
    def type_name():
        return "catenary.SnapshotHeader"


def main(prefix, root):
    config = iox2.Config.default() if hasattr(iox2, "Config") else iox2.config.default()
    config.global_cfg.prefix = iox2.FileName.new(prefix)
    config.global_cfg.root_path = iox2.Path.new(root)
    node = iox2.NodeBuilder.new().config(config).create(iox2.ServiceType.Ipc)
    service = (
        node.service_builder(iox2.ServiceName.new("sim/particles"))
        .publish_subscribe(iox2.Slice[ParticleState])
        .user_header(SnapshotHeader)
        .open()
    )
    subscriber = service.subscriber_builder().create()
    sample = None
    while sample is None:
        node.wait(iox2.Duration.from_millis(5))
        sample = subscriber.receive()
    header = sample.user_header().contents
    floats = ctypes.cast(sample.payload().as_ptr(), ctypes.POINTER(ParticleState))
    count = header.particle_count
    first = [list(floats[index].position) for index in range(min(count, 3))]
    print(json.dumps({"step": header.step, "particle_count": count, "first": first}))
    # Destroyed in any other order at exit, the ports leave a dead node behind.
    del sample, subscriber, service, node


main(*sys.argv[1:])
