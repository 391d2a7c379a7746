"""Reads the latched services of a running node with the iceoryx2 package, and prints them as JSON.

usage: read_live.py PREFIX ROOT
"""

import ctypes
import json
import sys

import iceoryx2 as iox2

UINT32, UINT64, FLOAT32 = ctypes.c_uint32, ctypes.c_uint64, ctypes.c_float
INT32, FLOAT64 = ctypes.c_int32, ctypes.c_double


def struct(name, *fields):
    """A structure of the contract. Each group of fields is a type and names separated by spaces."""
    flat = [(field, kind) for kind, names in fields for field in names.split()]
    functions = {"type_name": staticmethod(lambda: f"catenary.{name}")}
    return type(name, (ctypes.Structure,), {"_fields_": flat, **functions})


ParticleState = struct(
    "ParticleState",
    (FLOAT32 * 3, "position"),
    (FLOAT32, "inverse_mass"),
    (FLOAT32 * 3, "velocity"),
    (UINT32, "flags"),
)
SnapshotHeader = struct(
    "SnapshotHeader",
    (UINT32, "contract_version solver_version"),
    (UINT64, "run_id step scene_step keyframe_step sim_time_ns publish_monotonic_ns state_hash"),
    (UINT64, "outcome_count wake_late_ns solve_ns"),
    (UINT32, "topology_revision torn_count particle_count flags stride snapshot_index"),
)
TornConstraint = struct("TornConstraint", (UINT32, "constraint cause"))
TearsHeader = struct(
    "TearsHeader", (UINT64, "run_id step since_step"), (UINT32, "new_count count")
)
ParameterState = struct(
    "ParameterState",
    (UINT32, "parameter constraint_kind"),
    (INT32, "block"),
    (UINT32, "form"),
    (FLOAT32 * 3, "value"),
)
ParametersHeader = struct(
    "ParametersHeader", (UINT64, "run_id step"), (UINT32, "count spare")
)

BendState = struct(
    "BendState",
    (UINT32 * 4, "particles"),
    (FLOAT32 * 4, "coefficients"),
    (FLOAT32, "geometry rigidity rest"),
    (UINT32, "shape"),
    (INT32, "block"),
)
LoadHeader = struct(
    "LoadHeader",
    (UINT64, "run_id step scene_hash"),
    (FLOAT64 * 3, "origin"),
    (UINT32, "topology_revision count particle_count rate_hz method spare"),
)


def receive(node, name, element, header):
    """Waits for the latest message of a service, and returns its header and elements."""
    service = (
        node.service_builder(iox2.ServiceName.new(name))
        .publish_subscribe(iox2.Slice[element])
        .user_header(header)
        .open()
    )
    subscriber = service.subscriber_builder().create()
    sample = None
    while sample is None:
        node.wait(iox2.Duration.from_millis(5))
        sample = subscriber.receive()
    copied = header.from_buffer_copy(sample.user_header().contents)
    payload = sample.payload()
    # The length of a slice is in bytes in iceoryx2 0.10.0, so the header gives the count.
    count = copied.particle_count if element is ParticleState else copied.count
    array = element * count
    elements = list(array.from_buffer_copy(array.from_address(payload.as_ptr())))
    # Destroyed in any other order, the ports leave a dead node behind.
    del payload, sample, subscriber, service
    return copied, elements


def main(prefix, root):
    config = iox2.Config.default() if hasattr(iox2, "Config") else iox2.config.default()
    config.global_cfg.prefix = iox2.FileName.new(prefix)
    config.global_cfg.root_path = iox2.Path.new(root)
    node = iox2.NodeBuilder.new().config(config).create(iox2.ServiceType.Ipc)
    snapshot, particles = receive(node, "sim/particles", ParticleState, SnapshotHeader)
    tears, torn = receive(node, "sim/tears", TornConstraint, TearsHeader)
    _, parameters = receive(node, "sim/parameters", ParameterState, ParametersHeader)
    _, bends = receive(node, "sim/bends", BendState, LoadHeader)
    report = {
        "contract_version": snapshot.contract_version,
        "step": snapshot.step,
        "particle_count": snapshot.particle_count,
        "first": [list(particle.position) for particle in particles[:3]],
        "torn": [[one.constraint, one.cause] for one in torn],
        "new_tears": tears.new_count,
        "parameters": [
            [one.parameter, one.constraint_kind, one.block, one.form, list(one.value)]
            for one in parameters
        ],
        "bends": [
            [list(one.particles), list(one.coefficients), one.rigidity, one.shape, one.block]
            for one in bends
        ],
    }
    print(json.dumps(report))
    del node


if len(sys.argv) != 3:
    sys.exit("usage: read_live.py PREFIX ROOT, such as: read_live.py iox2_ /tmp/iceoryx2")
main(*sys.argv[1:])
