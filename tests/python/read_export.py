"""Opens an export with the reader of another project, and compares it with the recording, bit by bit.

usage: read_export.py FORMAT RECORDING EXPORT

The recording is read with the stock MCAP reader. Its particles are compared as integers, so that every bit
counts.
"""

import base64
import csv
import json
import sys
import tomllib
import xml.etree.ElementTree
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory



def index_lists(text):
    """The lists of indices of a printed scene: base64 of varints, of each list its length and its indices."""
    numbers, number, shift = [], 0, 0
    for byte in base64.b64decode(text, validate=True):
        number |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            numbers.append(number)
            number, shift = 0, 0
    lists = []
    while numbers:
        lists.append(numbers[1 : numbers[0] + 1])
        del numbers[: numbers[0] + 1]
    return lists


class Recording:
    """All snapshots of a recording. Shape of the particles: snapshots x particles x 8 columns."""

    def __init__(self, path):
        self.steps, self.rows, clouds = [], {}, []
        with open(path, "rb") as file:
            reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            for _schema, channel, message in reader.iter_messages():
                if channel.message_encoding == "json":
                    self.rows.setdefault(channel.topic, []).append(json.loads(message.data))
            for _schema, _channel, message, cloud in reader.iter_decoded_messages(topics=["/particles"]):
                self.steps.append(message.sequence)
                clouds.append(np.frombuffer(cloud.data, "<f4").reshape(-1, 8))
            (scene,) = (one.data for one in reader.iter_attachments() if one.name == "scene.toml")
        self.particles = np.stack(clouds)
        self.flags = np.ascontiguousarray(self.particles[:, :, 7]).view("<u4")
        topology = self.rows["/topology"][0]
        self.ends = np.stack([topology["a"], topology["b"]], axis=1)
        self.rest_lengths = np.array(topology["rest_length"], "f4")
        self.triangles = np.array(self.rows["/surface"][0]["triangles"], int).reshape(-1, 3)
        self.rate_hz = 240
        self.collider_count = len(self.rows.get("/colliders", [{"colliders": []}])[0]["colliders"])
        # A scene of one mesh has its faces, every other one the triangles.
        generated = tomllib.loads(scene.decode())["generate"]
        self.mesh = generated[0] if len(generated) == 1 and "faces" in generated[0] else {}
        self.mesh |= {key: index_lists(self.mesh[key]) for key in ("faces", "face_uvs") if key in self.mesh}
        if "uvs" in self.mesh:
            numbers = np.frombuffer(base64.b64decode(self.mesh["uvs"], validate=True), "<f4")
            self.mesh["uvs"] = numbers.reshape(-1, 2)
        self.faces = self.mesh.get("faces", self.triangles.tolist())

    def index(self, step):
        return self.steps.index(step)

    def torn(self, step):
        rows = [row for row in self.rows.get("/tears", []) if row["step"] <= step]
        return {constraint for row in rows for constraint in row["constraints"]}

    def untorn(self, step):
        return [i for i in range(len(self.ends)) if i not in self.torn(step)]

    def intact(self, step, polygons):
        """The polygons without a torn side of a triangle: one whose constraints are all torn."""
        torn = {frozenset(self.ends[i].tolist()) for i in self.torn(step)}
        edges = torn - {frozenset(self.ends[i].tolist()) for i in self.untorn(step)}

        def is_torn(one):
            fan = [{one[0], *one[i : i + 2]} for i in range(1, len(one) - 1)]
            return any(edge <= corners for edge in edges for corners in fan)

        return [one for one in polygons if not is_torn(one)]

    def intact_triangles(self, step):
        return self.intact(step, self.triangles.tolist())

    def intact_faces(self, step):
        return self.intact(step, self.faces)


def same(actual, expected):
    """Requires the same bits."""
    actual = np.ascontiguousarray(actual, "<f4")
    expected = np.ascontiguousarray(expected, "<f4")
    assert actual.shape == expected.shape, (actual.shape, expected.shape)
    assert (actual.view("u4") == expected.view("u4")).all()


def check_npz(recording, path):
    arrays = np.load(path)
    assert arrays["steps"].tolist() == recording.steps
    assert (arrays["times"] == np.array(recording.steps) / recording.rate_hz).all()
    same(arrays["positions"], recording.particles[:, :, 0:3])
    same(arrays["inverse_masses"], recording.particles[:, :, 3])
    same(arrays["velocities"], recording.particles[:, :, 4:7])
    assert (arrays["flags"] == recording.flags).all()
    outcomes, forces = recording.rows["/outcomes"], recording.rows["/forces"]
    assert arrays["command_steps"].tolist() == [row["step"] for row in outcomes] == [20, 30, 40]
    assert [json.loads(text) for text in arrays["commands"]] == outcomes
    # The first state has no forces. A particle that is pinned later has none before.
    assert [row["step"] for row in forces] == recording.steps[1:]
    fixed = arrays["fixed_particles"].tolist()
    assert fixed == sorted({particle for row in forces for particle in row["particles"]}) and 90 in fixed
    expected = np.full((len(recording.steps), len(fixed), 3), np.nan, "f4")
    for index, row in enumerate(forces, 1):
        for particle, impulse in zip(row["particles"], row["impulses"], strict=True):
            expected[index, fixed.index(particle)] = impulse
    assert np.isnan(expected[1:]).any() and np.isfinite(expected[40:]).all()
    assert np.array_equal(arrays["fixed_impulses"], expected, equal_nan=True)
    for kind in ("collider", "anchor"):
        for name in ("impulse", "angular_impulse"):
            found = arrays[f"{kind}_{name}s"]
            expected = [[one[name] for one in row[f"{kind}s"]] for row in forces]
            assert found.shape[0] == len(recording.steps) and np.isnan(found[0]).all()
            assert np.array_equal(found[1:], np.array(expected, "f4").reshape(found[1:].shape))
    contacts = [[one["contacts"] for one in row["colliders"]] for row in forces]
    assert arrays["collider_contacts"][1:].tolist() == contacts
    return len(arrays["steps"])


def check_csv(recording, path):
    with open(path, newline="", encoding="ascii") as file:
        table = list(csv.DictReader(file))
    count = recording.particles.shape[1]
    assert len(table) == len(recording.steps) * count
    names = ["x", "y", "z", "inverse_mass", "vx", "vy", "vz"]
    numbers = np.array([[float(row[name]) for name in names] for row in table])
    same(numbers.reshape(-1, count, 7), recording.particles[:, :, 0:7])
    assert [int(row["step"]) for row in table] == np.repeat(recording.steps, count).tolist()
    assert all(float(row["time_s"]) == int(row["step"]) / recording.rate_hz for row in table)
    assert [int(row["particle"]) for row in table[:count]] == list(range(count))
    assert [int(row["flags"]) for row in table] == recording.flags.flatten().tolist()
    return len(table) // count


def polygons(data):
    """Returns the corners of the polygons of VTK's PolyData."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    cells = data.GetPolys()
    ends = vtk_to_numpy(cells.GetOffsetsArray())
    return [part.tolist() for part in np.split(vtk_to_numpy(cells.GetConnectivityArray()), ends[1:-1])]


def check_names(recording, data, faces):
    """Requires the groups of a mesh in cell data, and their names in field data."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    names = data.GetFieldData().GetAbstractArray("group_names")
    names = [names.GetValue(i) for i in range(names.GetNumberOfValues())]
    numbers = vtk_to_numpy(data.GetCellData().GetArray("group"))[-len(faces) :]
    runs = recording.mesh["groups"]
    for face, number in zip(faces, numbers, strict=True):
        index = recording.faces.index(face)
        assert names[number] == [run["name"] for run in runs if run["first"] <= index][-1]


def check_vtk(recording, folder):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    (collection,) = Path(folder).glob("*.pvd")
    sets = xml.etree.ElementTree.parse(collection).getroot().findall("Collection/DataSet")
    colliders = [entry for entry in sets if entry.get("part") == "1"]
    sets = [entry for entry in sets if entry.get("part") == "0"]
    assert len(colliders) == (len(sets) if recording.collider_count else 0)
    for entry in colliders:
        reader = vtkXMLPolyDataReader()
        reader.SetFileName(str(Path(folder) / entry.get("file")))
        reader.Update()
        found = vtk_to_numpy(reader.GetOutput().GetCellData().GetArray("collider"))
        assert set(found) == set(range(recording.collider_count))
    for entry in sets:
        reader = vtkXMLPolyDataReader()
        reader.SetFileName(str(Path(folder) / entry.get("file")))
        reader.Update()
        data = reader.GetOutput()
        step = round(float(entry.get("timestep")) * recording.rate_hz)
        time_value = data.GetFieldData().GetArray("TimeValue").GetValue(0)
        assert time_value == float(entry.get("timestep")) == step / recording.rate_hz
        expected = recording.particles[recording.index(step)]
        same(vtk_to_numpy(data.GetPoints().GetData()), expected[:, 0:3])
        columns = data.GetPointData()
        same(vtk_to_numpy(columns.GetArray("velocity")), expected[:, 4:7])
        same(vtk_to_numpy(columns.GetArray("inverse_mass")), expected[:, 3])
        flags = vtk_to_numpy(columns.GetArray("flags"))
        assert (flags == recording.flags[recording.index(step)]).all()
        untorn, faces = recording.untorn(step), recording.intact_faces(step)
        lines = vtk_to_numpy(data.GetLines().GetConnectivityArray()).reshape(-1, 2)
        assert (lines == recording.ends[untorn]).all()
        assert polygons(data) == faces
        if recording.mesh:
            check_names(recording, data, faces)
        stretch = vtk_to_numpy(data.GetCellData().GetArray("stretch"))
        vertices = data.GetVerts().GetNumberOfCells()
        assert len(stretch) == vertices + len(untorn) + len(faces)
        a, b = expected[lines[:, 0], 0:3], expected[lines[:, 1], 0:3]
        lengths = np.linalg.norm(a.astype(float) - b.astype(float), axis=1)
        found = stretch[vertices : vertices + len(untorn)]
        assert np.allclose(found, lengths / recording.rest_lengths[untorn], rtol=1e-5)
        assert np.isnan(stretch[vertices + len(untorn) :]).all()
    return len(sets)


def read_obj(path):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOGeometry import vtkOBJReader

    reader = vtkOBJReader()
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    return vtk_to_numpy(data.GetPoints().GetData()), polygons(data)


def check_obj(recording, folder):
    files = sorted(Path(folder).glob("*.obj"))
    count = recording.particles.shape[1]
    for file in files:
        step = int(file.stem.split("_")[-1])
        if recording.mesh:
            # This reader doubles vertices with several texture coordinates, so the faces are read as text.
            lines = [line.split() for line in file.read_text().splitlines()]
            points = np.array([line[1:] for line in lines if line[0] == "v"], "f4")
            corners = [[one.split("/") for one in line[1:]] for line in lines if line[0] == "f"]
            faces = [[int(one[0]) - 1 for one in face] for face in corners]
            uvs = [[int(one[1]) - 1 for one in face if len(one) > 1] for face in corners]
            intact = [recording.faces.index(face) for face in faces if max(face) < count]
            assert uvs[: len(intact)] == [recording.mesh["face_uvs"][index] for index in intact]
        else:
            points, faces = read_obj(file)
        same(points[:count], recording.particles[recording.index(step), :, 0:3])
        own = [face for face in faces if max(face) < count]
        assert own == faces[: len(own)] == recording.intact_faces(step)
        assert (len(faces) > len(own)) == (recording.collider_count > 0)
    return len(files)


def check_pc2(recording, path):
    header = np.dtype(
        [("magic", "S12"), ("version", "<i4"), ("points", "<i4"), ("start", "<f4"), ("rate", "<f4"), ("samples", "<i4")]
    )
    assert header.itemsize == 32
    with open(path, "rb") as file:
        (head,) = np.fromfile(file, header, 1)
        positions = np.fromfile(file, "<f4")
    assert (head["magic"], head["version"]) == (b"POINTCACHE2", 1), head
    assert (head["start"], head["rate"]) == (0.0, 1.0), head
    positions = positions.reshape(head["samples"], head["points"], 3)
    same(positions, recording.particles[:, :, 0:3])
    points, faces = read_obj(Path(path).with_suffix(".obj"))
    same(points, positions[0])
    assert faces == recording.faces
    return int(head["samples"])


def check_usda(recording, path):
    from pxr import Usd, UsdGeom, UsdShade

    stage = Usd.Stage.Open(path)
    assert UsdGeom.GetStageUpAxis(stage) == "Y" and UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert stage.GetTimeCodesPerSecond() == recording.rate_hz
    assert stage.GetStartTimeCode() == recording.steps[0]
    assert stage.GetEndTimeCode() == recording.steps[-1]
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/scene/particles"))
    assert mesh.GetPointsAttr().GetTimeSamples() == recording.steps
    for step in recording.steps:
        expected = recording.particles[recording.index(step)]
        same(np.array(mesh.GetPointsAttr().Get(step)), expected[:, 0:3])
        same(np.array(mesh.GetVelocitiesAttr().Get(step)), expected[:, 4:7])
        faces = recording.intact_faces(step)
        assert list(mesh.GetFaceVertexIndicesAttr().Get(step)) == sum(faces, [])
        assert list(mesh.GetFaceVertexCountsAttr().Get(step)) == [len(face) for face in faces]
        valid, reason = UsdGeom.Mesh.ValidateTopology(
            mesh.GetFaceVertexIndicesAttr().Get(step), mesh.GetFaceVertexCountsAttr().Get(step), len(expected)
        )
        assert valid, reason
    if recording.mesh:
        check_subsets(recording, mesh, UsdGeom, UsdShade)
    colliders = [prim for prim in stage.Traverse() if prim.GetName().startswith("collider_")]
    assert len(colliders) == recording.collider_count
    for prim in colliders:
        UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(recording.steps[-1])
    return len(recording.steps)


def check_subsets(recording, mesh, usd_geom, usd_shade):
    """Requires texture coordinates for each corner, and each face in the subsets of its group and material."""
    step = recording.steps[-1]
    faces = [recording.faces.index(face) for face in recording.intact_faces(step)]
    uvs = usd_geom.PrimvarsAPI(mesh).GetPrimvar("st")
    assert uvs.GetInterpolation() == usd_geom.Tokens.faceVarying
    expected = [recording.mesh["uvs"][index] for face in faces for index in recording.mesh["face_uvs"][face]]
    same(np.array(uvs.ComputeFlattened(step)), np.array(expected, "f4"))
    for family, runs in (("groups", "groups"), ("materialBind", "materials")):
        subsets = usd_geom.Subset.GetGeomSubsets(mesh, usd_geom.Tokens.face, family)
        found = sorted(index for subset in subsets for index in subset.GetIndicesAttr().Get(step))
        assert found == list(range(len(faces)))
        assert len(subsets) == len({run["name"] for run in recording.mesh[runs]})
    for subset in usd_geom.Subset.GetGeomSubsets(mesh, usd_geom.Tokens.face, "materialBind"):
        material, _ = usd_shade.MaterialBindingAPI(subset.GetPrim()).ComputeBoundMaterial()
        assert material.GetPrim().GetName() == subset.GetPrim().GetName().removeprefix("material_")


def messages(path):
    """Returns the raw messages of a file, without those on /scene, and its decoded scenes by sequence."""
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        raw = [
            (channel.topic, schema.name, schema.data, message.sequence, message.log_time, message.publish_time, message.data)
            for schema, channel, message in reader.iter_messages(log_time_order=False)
            if channel.topic != "/scene"
        ]
        decoded = reader.iter_decoded_messages(topics=["/scene"])
        scenes = {message.sequence: scene for _schema, _channel, message, scene in decoded}
        metadata = [(record.name, record.metadata) for record in reader.iter_metadata()]
        attachments = [(record.name, record.data) for record in reader.iter_attachments()]
        return (raw, metadata, attachments), scenes


def points(primitive):
    return np.array([[point.x, point.y, point.z] for point in primitive.points])


def check_foxglove(recording, path):
    copied, scenes = messages(path)
    original, none = messages(sys.argv[2])
    assert copied == original and not none
    period_s = 1 / 30
    for step, scene in scenes.items():
        # A file holds every entity in every message, because a viewer that jumps gets only one of them.
        assert [entity.id for entity in scene.entities] == ["sticks", "surface", "colliders", "meshes"]
        assert {entity.frame_id for entity in scene.entities} == {"world"}
        sticks, surface, _, _ = scene.entities
        positions = recording.particles[recording.index(step), :, 0:3]
        same(points(sticks.lines[0]), positions)
        same(points(surface.triangles[0]), positions)
        indices = np.array(sticks.lines[0].indices).reshape(-1, 2)
        assert (indices == recording.ends[recording.untorn(step)]).all()
        triangles = np.array(surface.triangles[0].indices).reshape(-1, 3)
        assert triangles.tolist() == recording.intact_triangles(step)
    times = np.array(sorted(scenes)) / recording.rate_hz
    assert np.allclose(np.diff(times), period_s)
    return len(scenes)


def check_ros2(recording, folder):
    from mcap_ros2.reader import read_ros2_messages
    from rosbags.rosbag2 import Reader

    # The metadata; the messages are read with the decoder of MCAP, because this reader leaves out a message
    # that begins a chunk.
    with Reader(folder) as bag:
        types = {connection.topic: connection.msgtype for connection in bag.connections}
        latched = {c.topic: [qos.durability.name for qos in c.ext.offered_qos_profiles] for c in bag.connections}
        text = "std_msgs/msg/String"
        particles = {"/tf_static": "tf2_msgs/msg/TFMessage", "/particles": "sensor_msgs/msg/PointCloud2"}
        assert types == particles | {"/outcomes": text, "/forces": text}
        assert latched == {"/tf_static": ["TRANSIENT_LOCAL"], "/particles": [], "/outcomes": [], "/forces": []}
        rows = recording.rows["/outcomes"] + recording.rows["/forces"]
        assert bag.message_count == len(recording.steps) + 1 + len(rows)
        assert bag.duration == (recording.steps[-1] - recording.steps[0]) * 10**9 // recording.rate_hz + 1
    (file,) = Path(folder).glob("*.mcap")
    with open(file, "rb") as stream:
        assert make_reader(stream).get_header().profile == "ros2"
    first, *messages = read_ros2_messages(str(file))
    assert first.channel.topic == "/tf_static"
    clouds = [message for message in messages if message.channel.topic == "/particles"]
    for topic in ("/outcomes", "/forces"):
        texts = [message for message in messages if message.channel.topic == topic]
        found = [json.loads(message.ros_msg.data) for message in texts]
        assert found == recording.rows[topic]
        times = [message.log_time_ns for message in texts]
        assert times == [row["step"] * 10**9 // recording.rate_hz for row in found]
    (transform,) = first.ros_msg.transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("map", "world")
    rotation = transform.transform.rotation
    half = 0.5**0.5
    found = np.array([rotation.x, rotation.y, rotation.z, rotation.w])
    assert np.allclose(found, [half, 0, 0, half], atol=1e-15, rtol=0), "y does not become z"
    names = ["x", "y", "z", "inverse_mass", "vx", "vy", "vz", "flags"]
    fields = [(name, 4 * i, 6 if name == "flags" else 7, 1) for i, name in enumerate(names)]
    for step, message in zip(recording.steps, clouds, strict=True):
        cloud = message.ros_msg
        time_ns = step * 10**9 // recording.rate_hz
        assert message.log_time_ns == time_ns
        assert (cloud.header.stamp.sec, cloud.header.stamp.nanosec) == divmod(time_ns, 10**9)
        assert [(f.name, f.offset, f.datatype, f.count) for f in cloud.fields] == fields
        expected = recording.particles[recording.index(step)]
        assert (cloud.header.frame_id, cloud.height, cloud.width) == ("world", 1, len(expected))
        assert (cloud.point_step, cloud.row_step) == (32, 32 * len(expected))
        assert cloud.is_dense and not cloud.is_bigendian
        same(np.frombuffer(bytes(cloud.data), "<f4").reshape(-1, 8), expected)
    return len(clouds)


CHECKS = {
    "npz": check_npz,
    "csv": check_csv,
    "vtk": check_vtk,
    "obj": check_obj,
    "pc2": check_pc2,
    "usda": check_usda,
    "foxglove": check_foxglove,
    "ros2": check_ros2,
}

if len(sys.argv) != 4 or sys.argv[1] not in CHECKS:
    sys.exit(f"usage: read_export.py {'|'.join(CHECKS)} RECORDING EXPORT")
recording = Recording(sys.argv[2])
count = CHECKS[sys.argv[1]](recording, sys.argv[3])
torn = len(recording.torn(recording.steps[-1]))
print(json.dumps({"snapshots": count, "recorded": len(recording.steps), "torn": torn}))
