"""The proof of recordings."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path

import catenary
import pytest
from conftest import Interrupt
from edits import Editor

Simulate = Callable[..., Path]


def test_a_recording_is_proved_whole_and_in_parts(simulate: Simulate) -> None:
    path = simulate("curtain", "--steps", "600")
    proof = catenary.verify(path)
    assert proof.is_identical and proof.verdict == "identical" and proof.end == "complete"
    assert (proof.first_step, proof.last_identical_step, proof.steps_identical) == (0, 600, 600)
    assert (proof.gaps, proof.lost, proof.step, proof.what, proof.particle) == ([], {}, None, None, None)
    assert any("measured times" in what for what in proof.not_covered)
    assert str(proof) == "600 steps bit-identical (0..=600)"
    part = catenary.verify(path, start=300, stop=401, threads=2)
    # The last complete state before step 300 is that of step 240.
    assert (part.first_step, part.last_identical_step) == (240, 400)
    assert part.is_identical and part.end == "not reached"
    with pytest.raises(ValueError, match="`start` is 700, but the last step of .*run.mcap is 600"):
        catenary.verify(path, start=700)
    with pytest.raises(ValueError, match="`stop` is 300"):
        catenary.verify(path, start=300, stop=300)
    with pytest.raises(ValueError, match=r"`start` is -1 \(allowed: 0 to "):
        catenary.verify(path, start=-1)


@pytest.fixture
def edited(simulate: Simulate, tmp_path: Path) -> Editor:
    commands = tmp_path / "commands.jsonl"
    commands.write_text(
        '{"step": 50, "kind": "pin", "particle": 160}\n{"step": 60, "kind": "unpin", "particle": 160}\n'
    )
    arguments = ("curtain", "--steps", "300", "--commands", str(commands), "--compression", "none")
    return Editor(simulate(*arguments))


def test_the_first_difference_is_named(edited: Editor, tmp_path: Path) -> None:
    (cloud,) = [one for one in edited.messages if (one.topic, one.step) == ("/particles", 100)]
    place = len(cloud.data) - 32 * (168 - 90)
    (x,) = struct.unpack_from("<f", cloud.data, place)
    cloud.data = cloud.data[:place] + struct.pack("<f", x + 0.001) + cloud.data[place + 4 :]
    path = edited.write(tmp_path / "changed.mcap")
    proof = catenary.verify(path)
    assert (proof.verdict, proof.is_identical) == ("diverged", False)
    assert (proof.step, proof.particle, proof.field) == (100, 90, "position x")
    assert (proof.last_identical_step, proof.steps_identical) == (99, 99)
    assert proof.what is not None and f"simulated {x:.5f}"[:-1] in proof.what
    recording = catenary.open(path)
    assert recording.state(99).hash == recording[99].hash
    with pytest.raises(catenary.RecordingError, match="changed.mcap: step 100 cannot be simulated"):
        recording.state(100)


def test_missing_outcomes_are_a_gap(edited: Editor, tmp_path: Path) -> None:
    edited.messages = [one for one in edited.messages if (one.topic, one.step) != ("/outcomes", 50)]
    proof = catenary.verify(edited.write(tmp_path / "missing.mcap"))
    assert (proof.verdict, proof.is_identical) == ("outcome_log_incomplete", False)
    # Each command has a keyframe, so that the simulation goes on.
    assert (proof.step, proof.particle, proof.gaps) == (50, None, [(50, 50)])
    assert proof.last_identical_step == 300


def test_an_unfinished_recording_is_identical_only_as_far_as_it_goes(
    edited: Editor, tmp_path: Path
) -> None:
    proof = catenary.verify(edited.write(tmp_path / "unfinished.mcap"))
    assert (proof.verdict, proof.is_identical) == ("identical", False)
    assert proof.end.startswith("truncated after byte ")


def test_what_cannot_be_proved_raises(edited: Editor, tmp_path: Path) -> None:
    missing = tmp_path / "missing.mcap"
    with pytest.raises(catenary.RecordingError, match="missing.mcap: .*No such file"):
        catenary.verify(missing)
    missing.write_text("plain text")
    with pytest.raises(catenary.RecordingError, match="missing.mcap: is not an MCAP file"):
        catenary.verify(missing)
    edited.messages = [one for one in edited.messages if one.topic != "/keyframe"]
    path = edited.write(tmp_path / "keyless.mcap")
    with pytest.raises(catenary.RecordingError, match="keyless.mcap: has no snapshot with a keyframe"):
        catenary.verify(path)
    with pytest.raises(catenary.RecordingError, match="keyless.mcap: has no complete state up to"):
        catenary.open(path).state(10)


def test_ctrl_c_ends_a_simulation_of_a_recording(
    simulate: Simulate, interrupt: Interrupt, tmp_path: Path
) -> None:
    editor = Editor(simulate("pendulum", "--steps", "1", "--compression", "none"))
    seconds = 16_000_000
    step = 240 * seconds
    for one in (one for one in editor.messages if one.step == 1):
        one.step, one.log_time = step, seconds * 10**9
        if one.topic == "/steps":
            row = json.loads(one.data) | {"step": step, "scene_step": step, "snapshot_index": step}
            one.data = json.dumps(row, separators=(",", ":")).encode()
        else:
            # The time of the cloud: whole seconds as a varint.
            varint = bytes(seconds >> shift & 127 | 128 for shift in (0, 7, 14)) + bytes([seconds >> 21])
            one.data = b"\n\x05\x08" + varint + one.data[2 + one.data[1] :]
    path = editor.write(tmp_path / "endless.mcap")
    for call in (f"catenary.verify({str(path)!r})", f"catenary.open({str(path)!r}).state(10**9)"):
        assert interrupt(call) == "interrupted\n", call
