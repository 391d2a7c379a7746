"""Reading recordings."""

from __future__ import annotations

import dataclasses
import json
import os
import signal
import struct
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import catenary
import numpy as np
import pytest
from conftest import DEADLINE, PROGRAMS, Interrupt, StartNode
from edits import MAGIC, records
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from PIL import Image

Simulate = Callable[..., Path]


@pytest.fixture
def recording(simulate: Simulate, tmp_path: Path) -> catenary.Recording:
    commands = tmp_path / "commands.jsonl"
    commands.write_text(
        '{"step": 100, "kind": "grab", "particle": 90, "target": [0.5, 0.2, 0.3]}\n'
        '{"step": 200, "kind": "cut", "constraint": 7}\n'
        '{"step": 201, "kind": "cut", "constraint": 7}\n'
    )
    return catenary.open(simulate("curtain", "--steps", "600", "--commands", str(commands)))


def test_snapshots_are_those_that_the_mcap_reader_finds(recording: catenary.Recording) -> None:
    with open(recording.path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        clouds = [cloud.data for *_, cloud in reader.iter_decoded_messages(["/particles"])]
    snapshots = list(recording)
    assert [snapshot.step for snapshot in snapshots] == list(range(601)) == list(range(len(clouds)))
    for snapshot, cloud in zip(snapshots, clouds):
        fields = np.frombuffer(cloud, np.float32).reshape(-1, 8)
        assert np.array_equal(snapshot.positions, fields[:, 0:3])
        assert np.array_equal(snapshot.velocities, fields[:, 4:7])


def test_a_step_a_time_and_a_slice_select_snapshots(recording: catenary.Recording) -> None:
    assert (recording.first_step, recording.last_step, recording.rate) == (0, 600, 240)
    assert recording[480].step == recording.at(2.0).step == 480
    assert recording.at(2.0041).step == 480 and recording.at(2.5).step == 600
    assert [one.step for one in recording[10:50:10]] == [10, 20, 30, 40]
    assert [one.step for one in recording[598:]] == [598, 599, 600]
    assert 480 in recording and 601 not in recording and 2**70 not in recording
    assert all(recording.at(one.time).step == one.step for one in recording)
    with pytest.raises(KeyError, match="no step 601"):
        recording[601]
    for key in (slice(-3, None), slice(None, None, -1)):
        with pytest.raises(ValueError):
            recording[key]
    for time_s in (-1.0, 2.5042, 1e9, float("nan")):
        with pytest.raises(ValueError, match=r"allowed: 0 to 2.5 seconds"):
            recording.at(time_s)


def test_a_recording_becomes_arrays(recording: catenary.Recording) -> None:
    arrays = recording.to_numpy(100, 201, every=50)
    assert arrays.steps.tolist() == [100, 150, 200]
    assert arrays.times == pytest.approx([100 / 240, 150 / 240, 200 / 240])
    assert arrays.positions.shape == arrays.velocities.shape == (3, 168, 3)
    assert np.array_equal(arrays.positions[1], recording[150].positions)
    assert arrays.hashes[2] == recording[200].hash
    # Those of the steps in between belong to it, and those after it do not.
    assert [(row["step"], row["kind"]) for row in arrays.commands] == [(100, "grab"), (200, "cut")]
    assert arrays.forces is None
    grab = catenary.Action.from_dict(arrays.commands[0])
    assert grab.to_dict()["particle"] == arrays.commands[0]["particle"]


def test_forces_become_arrays(simulate: Callable[..., Path], tmp_path: Path) -> None:
    commands = tmp_path / "commands.jsonl"
    commands.write_text('{"step": 20, "kind": "pin", "particle": 3}')
    path = simulate("drop-box", "--steps", "40", "--forces", "--commands", str(commands))
    with catenary.open(path) as recording:
        arrays = recording.to_numpy()
        forces = arrays.forces
        assert forces is not None and forces.fixed_particles.tolist() == [3]
        assert forces.collider_impulses.shape == (41, len(recording.forces(1).colliders), 3)
        assert np.isnan(forces.collider_impulses[0]).all(), "no step has led to the first state"
        assert np.isnan(forces.fixed_impulses[:20]).all()
        for step in (20, 33, 40):
            row = recording.forces(step)
            assert np.array_equal(forces.collider_impulses[step], row.colliders.impulse)
            assert np.array_equal(forces.collider_contacts[step], row.colliders.contacts)
            assert np.array_equal(forces.fixed_impulses[step], row.impulses)
    file = tmp_path / "run.npz"
    subprocess.run([PROGRAMS / "recorder", "export", path, "--npz", file], check=True, timeout=DEADLINE)
    exported = np.load(file)
    for field in dataclasses.fields(forces):
        found = getattr(forces, field.name)
        assert np.array_equal(exported[field.name], found, equal_nan=found.dtype.kind == "f"), field.name
    assert [json.loads(text) for text in exported["commands"]] == arrays.commands


@pytest.mark.parametrize("style", ["wires", "shaded"])
def test_pictures_are_those_of_the_export(
    simulate: Callable[..., Path], tmp_path: Path, style: Literal["wires", "shaded"]
) -> None:
    path = simulate("covered-bust", "--steps", "30")
    folder = tmp_path / "pictures"
    options = ["--at", "125ms", "--size", "320x240", "--style", style]
    command = [str(PROGRAMS / "recorder"), "export", str(path), "--png", str(folder), *options]
    subprocess.run(command, check=True, capture_output=True, timeout=DEADLINE)
    (file,) = folder.iterdir()
    expected = np.asarray(Image.open(file).convert("RGB"))
    simulation = catenary.Simulation("covered-bust")
    simulation.step(30)
    with catenary.open(path) as recording:
        pictures = [
            recording.render(30, size=(320, 240), style=style),
            simulation.render(size=(320, 240), style=style),
        ]
        for picture in pictures:
            assert picture.dtype == np.uint8 and picture.shape == (240, 320, 3)
            assert np.array_equal(picture, expected)
        near = recording.render(30, size=(320, 240), style=style, bounds=((0, 0, 0), np.full(3, 0.1, np.float32)))
        assert not np.array_equal(near, expected)
        with pytest.raises(KeyError, match="31"):
            recording.render(31)
    with pytest.raises(ValueError, match=r"`size` is \(8, 240\) \(allowed: 16 to 8192"):
        simulation.render(size=(8, 240))
    with pytest.raises(ValueError, match=r"`view` is 'up' \(allowed: front, side, top, iso\)"):
        simulation.render(view="up")  # type: ignore[arg-type]


def test_arrays_of_no_snapshot_are_refused_with_the_recorded_steps(
    recording: catenary.Recording,
) -> None:
    for start, stop in ((50, 10), (601, 700)):
        with pytest.raises(ValueError, match=rf"steps from {start} up to .* \(it has 0 to 600\)"):
            recording.to_numpy(start, stop)
    assert list(recording[50:10]) == []


def test_steps_and_outcomes_are_tables(recording: catenary.Recording) -> None:
    steps = recording.steps()
    assert all(len(column) == 601 for column in steps.values())
    assert steps["step"].tolist() == list(range(601))
    assert steps["torn_count"].tolist() == [0] * 200 + [1] * 401
    rows = recording.outcomes()
    assert [(row["step"], row["kind"], row["status"]) for row in rows] == [
        (100, "grab", "applied"),
        (200, "cut", "applied"),
        (201, "cut", "rejected"),
    ]
    assert recording.torn(199).size == 0 and recording.torn(200).tolist() == [7]


def test_the_commands_of_a_recording_give_its_states(recording: catenary.Recording) -> None:
    simulation = catenary.Simulation(toml=recording.scene())
    rows = [row for row in recording.outcomes() if row["status"] == "applied"]
    for snapshot in recording[1:]:
        for row in rows:
            if row["step"] == snapshot.step:
                simulation.apply(catenary.Action.from_dict(row))
        simulation.step()
        assert simulation.hash == snapshot.hash


def test_a_recording_knows_its_length_and_ends_with_its_block(recording: catenary.Recording) -> None:
    with recording as opened:
        assert opened is recording and len(recording) == 601 == sum(1 for _ in recording)
        positions = recording[480].positions
    assert "closed" in repr(recording) and positions.shape == (168, 3)
    calls: list[Callable[[], object]] = [
        lambda: recording.first_step,
        lambda: recording[480],
        lambda: recording.steps(),
        lambda: recording.state(480),
    ]
    for call in calls:
        with pytest.raises(catenary.Error, match="run.mcap: this recording is closed"):
            call()


def test_a_simulation_continues_from_the_state_of_any_step(recording: catenary.Recording) -> None:
    rows = [row for row in recording.outcomes() if row["status"] == "applied"]
    # 100 and 200 have commands, 240 a keyframe, and the others neither.
    for step in (0, 99, 100, 150, 199, 200, 240, 399, 600):
        state = recording.state(step)
        assert state.hash == recording[step].hash
        simulation = catenary.Simulation(recording.path)
        simulation.restore(state)
        for snapshot in recording[step + 1 : step + 121]:
            for row in rows:
                if row["step"] == snapshot.step:
                    simulation.apply(catenary.Action.from_dict(row))
            simulation.step()
            assert simulation.hash == snapshot.hash, (step, snapshot.step)
    for missing in (601, 2**63):
        with pytest.raises(KeyError, match="no step"):
            recording.state(missing)


def recorded(path: Path) -> catenary.Recording | None:
    try:
        return catenary.open(path)
    except catenary.RecordingError:
        return None


def test_a_slice_leaves_out_steps_that_were_not_recorded(
    start_node: StartNode, start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    path = tmp_path / "sparse.mcap"
    node = start_node("rope", "--every", "7", "--paused")
    recorder = start("recorder", "record", "-o", str(path))
    end = time.monotonic() + DEADLINE
    while node.status()["reader_count"] < 1:
        assert time.monotonic() < end
    node.step(70)
    while (part := recorded(path.with_name("sparse.mcap.part"))) is None or part.last_step < 70:
        assert time.monotonic() < end
    recorder.send_signal(signal.SIGINT)
    recorder.communicate(timeout=DEADLINE)
    recording = catenary.open(path)
    assert recording.scene_name == "rope"
    assert [one.step for one in recording[20:60]] == [21, 28, 35, 42, 49, 56]
    with pytest.raises(KeyError, match="no step 20"):
        recording[20]
    assert len(recording) == len(list(recording)) < recording.last_step - recording.first_step
    simulation = catenary.Simulation("rope")
    simulation.step(20)
    assert recording.state(20).hash == simulation.hash, "between two snapshots"


def test_unreadable_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(catenary.RecordingError, match="missing.mcap: .*No such file"):
        catenary.open(tmp_path / "missing.mcap")
    text = tmp_path / "text.mcap"
    text.write_text("plain text")
    with pytest.raises(catenary.RecordingError, match="text.mcap"):
        catenary.open(text)


def sparse_record(size: int) -> bytes:
    """Begins a record that readers skip. Its content is a hole in the file, which takes no space on the disk."""
    return struct.pack("<BQ", 0x80, size)


def test_ctrl_c_ends_the_reading_of_a_large_file(
    simulate: Simulate, interrupt: Interrupt, tmp_path: Path
) -> None:
    data = simulate("pendulum", "--steps", "2", "--compression", "none").read_bytes()
    size = 1 << 42  # Reading it takes minutes.
    header_end = next(at for at, opcode, _ in records(data, MAGIC) if opcode != 1)
    data_end = next(at for at, opcode, _ in records(data, MAGIC) if opcode == 15)
    for at, setup, call in (
        (header_end, "", "catenary.open(path)"),
        (data_end, "recording = catenary.open(path)", "recording.steps()"),
        (data_end, "recording = catenary.open(path)", "recording.outcomes()"),
    ):
        path = tmp_path / "large.mcap"
        path.write_bytes(data[:at] + sparse_record(size))
        os.truncate(path, at + 9 + size)
        assert interrupt(call, f"path = {str(path)!r}\n{setup}") == "interrupted\n", call
