"""Controllers in lockstep with a node."""

from __future__ import annotations

import random
import re
import subprocess
import sys
import time
from pathlib import Path

import catenary
import numpy as np
import pytest
from conftest import DEADLINE, StartNode


def damp(node: catenary.Node, rng: random.Random) -> list[np.uint64]:
    """Damps the pendulum by its pivot, and wastes random amounts of time."""
    hashes: list[np.uint64] = []
    with node.lockstep() as steps:
        node.resume()
        for snapshot in steps:
            target = snapshot.velocities[1] * np.float32(-0.05)
            if hashes:
                steps.move(0, target)
            else:
                steps.grab(0, target)
            hashes.append(snapshot.hash)
            sum(range(rng.randrange(20_000)))
            if len(hashes) == 120:
                break
    return hashes


def test_the_same_controller_gives_the_same_states_in_every_run(start_node: StartNode) -> None:
    runs = []
    for seed, speed in enumerate([["--as-fast-as-possible"], [], ["--as-fast-as-possible"]]):
        node = start_node("pendulum", "--paused", *speed, name=f"run-{seed}")
        runs.append(damp(node, random.Random(seed)))
    assert runs[0] == runs[1] == runs[2]
    assert len(set(runs[0])) > 100, "the pendulum moves"


def test_each_turn_sees_the_commands_of_the_turn_before(start_node: StartNode) -> None:
    node = start_node("curtain", "--as-fast-as-possible")
    target = np.zeros(3, np.float32)
    with node.lockstep() as steps:
        for turn, snapshot in enumerate(steps):
            if turn > 0:
                assert snapshot.positions[90] == pytest.approx(target)
                assert [one.step for one in steps.outcomes] == [snapshot.step]
            if turn == 50:
                break
            target = np.array([turn / 100, 0.2, 0.3], np.float32)
            if turn == 0:
                steps.grab(90, target, over=0)
            else:
                steps.move(90, target, over=0)


def test_a_member_takes_part_at_every_fourth_step(start_node: StartNode) -> None:
    node = start_node("curtain")
    with node.lockstep(every=4) as steps:
        seen = [snapshot.step for snapshot, _ in zip(steps, range(20))]
    assert seen == list(range(seen[0], seen[0] + 80, 4))


def test_a_member_takes_part_at_the_first_step_after_its_period_that_is_published(
    start_node: StartNode,
) -> None:
    node = start_node("curtain", "--every", "3")
    with node.lockstep(every=4) as steps:
        seen = [snapshot.step for snapshot, _ in zip(steps, range(20))]
    assert seen == list(range(seen[0], seen[0] + 120, 6)) and seen[0] % 3 == 0


def test_a_rejected_command_raises_at_the_next_snapshot(start_node: StartNode) -> None:
    node = start_node("curtain")
    with node.lockstep() as steps:
        next(steps)
        steps.pin(1000)
        with pytest.raises(catenary.Rejected, match=r"no such particle.*\(allowed: 0 to 167\)"):
            next(steps)
        assert next(steps).step > 0, "the membership goes on"


def test_a_request_within_a_turn_names_the_remedy(start_node: StartNode) -> None:
    node = start_node("curtain")
    with node.lockstep() as steps:
        next(steps)
        with pytest.raises(catenary.Error, match="use the methods of the lockstep"):
            node.pin(90)
        assert not next(steps).flags[90], "it was not sent"
    assert node.pin(3).is_applied, "the client has left the lockstep"
    with pytest.raises(catenary.Error, match="with node.lockstep"):
        next(steps)
    with pytest.raises(ValueError, match="every"):
        node.lockstep(every=0)


def test_a_rejected_last_command_is_not_lost(start_node: StartNode) -> None:
    node = start_node("curtain")
    with pytest.raises(catenary.Rejected, match="no such particle"):
        with node.lockstep() as steps:
            next(steps)
            steps.pin(1000)


EPISODES = """
import sys, catenary
every = int(sys.argv[1])
node = catenary.attach()
with node.lockstep(every=every) as steps:
    for episode in range(20):
        steps.reset()
        hashes = []
        for turn, snapshot in zip(range(400 // every), steps):
            assert snapshot.scene_step == every * turn, snapshot
            hashes.append(snapshot.hash_hex)
            target = (0.2 + turn * every / 2000, 0.2, 0.3)
            (steps.move if turn else steps.grab)(90, target)
        print(*hashes)
"""


@pytest.mark.parametrize("every", [1, 4])
def test_episodes_repeat_bit_for_bit_in_every_process(start_node: StartNode, every: int) -> None:
    start_node("curtain", "--as-fast-as-possible")
    command = [sys.executable, "-c", EPISODES, str(every)]
    processes = [
        subprocess.run(command, check=True, capture_output=True, text=True, timeout=DEADLINE)
        for _ in range(2)
    ]
    episodes = [line for done in processes for line in done.stdout.splitlines()]
    assert len(episodes) == 40 and len(set(episodes)) == 1
    hashes = episodes[0].split()
    assert len(hashes) == 400 // every and len(set(hashes)) > 50, "the cloth moves"
    # So do they without a node.
    simulation = catenary.Simulation("curtain")
    for turn, expected in enumerate(hashes):
        assert simulation.hash_hex == expected, turn
        target = (0.2 + turn * every / 2000, 0.2, 0.3)
        (simulation.move if turn else simulation.grab)(90, target)
        simulation.step(every)


def test_the_episodes_of_the_readme_repeat_bit_for_bit(start_node: StartNode) -> None:
    start_node("curtain", "--as-fast-as-possible")
    readme = (Path(__file__).resolve().parents[1] / "README.md").read_text()
    first = re.findall(r"^```python\n(.*?)^```", readme, re.MULTILINE | re.DOTALL)[0]
    hashes: list[str] = []
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", first], check=True, capture_output=True, text=True, timeout=DEADLINE
        )
        hashes += done.stdout.split()
    assert len(hashes) == 40 and len(set(hashes)) == 1


def test_every_command_of_a_node_exists_in_the_lockstep(start_node: StartNode) -> None:
    node = start_node("carried-cloth", "--as-fast-as-possible")
    with node.lockstep(every=5) as steps:
        steps.reset()
        initial = next(steps).copy()
        assert initial.scene_step == 0 and steps.forces() is None
        assert steps.forces() is None, "those of the next step on"
        later = next(steps)
        assert later.step == initial.step + 5
        forces = steps.forces()
        assert forces is not None and forces.step == later.step and len(forces.anchors)
        moved, still = later.positions + np.float32(0.25), 0 * later.velocities
        steps.set_motion(moved, still)
        shown = next(steps)
        assert shown.step == later.step + 1, "a state in place is a turn"
        assert np.array_equal(shown.positions, moved)
        steps.restore(initial)
        assert np.array_equal(next(steps).positions, initial.positions)
        sequence = steps.rewind(to_step=later.step)
        assert next(steps).hash == later.hash
        (outcome,) = steps.outcomes
        assert outcome.sequence == sequence and outcome.is_applied
        state = catenary.Simulation("carried-cloth").state()
        steps.restore(state)
        assert next(steps).hash == state.hash == initial.hash
        steps.load("rope")
        rope = next(steps)
        assert rope.hash == catenary.Simulation("rope").hash
        steps.restore(state)
        with pytest.raises(catenary.Rejected, match="state"):
            next(steps)
        with pytest.raises(catenary.Error, match="methods of the lockstep"):
            node.set_motion(moved, still)


def test_a_load_at_another_rate_begins_a_run_in_lockstep(start_node: StartNode, tmp_path: Path) -> None:
    node = start_node("curtain", "--as-fast-as-possible")
    scene = tmp_path / "fall.toml"
    scene.write_text("version = 1\n[solver]\nrate_hz = 500\n[[particle]]\nposition = [0, 0, 0]\n")
    with node.lockstep() as steps:
        before = next(steps).run_id
        steps.load(scene)
        first = next(steps)
        assert first.run_id != before and first.step == 0
        assert [one.begins_run for one in steps.outcomes] == [True]
        assert next(steps).step == 1


@pytest.mark.parametrize(("published", "every", "period"), [(1, 1, 1), (3, 1, 3), (4, 3, 4)])
def test_a_member_that_answers_too_late_is_told_so(
    start_node: StartNode, published: int, every: int, period: int
) -> None:
    node = start_node("curtain", "--lockstep-timeout", "100ms", "--every", str(published))
    other = catenary.attach()
    with node.lockstep(every=every) as steps:
        next(steps)
        # Not the first one, at which the node may have published a step for a command.
        step = next(steps).step
        end = time.monotonic() + DEADLINE
        while (newest := other.latest().step) < step + 10 * period:
            assert time.monotonic() < end
        with pytest.raises(catenary.Error, match="did not wait for this member in") as raised:
            next(steps)
        count, turn = map(int, re.findall(r"in (\d+) of its turns before step (\d+)", str(raised.value))[0])
        assert turn >= newest
        assert turn == step + count * period


def test_a_member_that_answers_too_late_but_before_its_next_turn_is_told_so(start_node: StartNode) -> None:
    node = start_node("curtain", "--lockstep-timeout", "100ms", "--rate", "240")
    other = catenary.attach()
    with node.lockstep(every=480) as steps:
        step = next(steps).step
        end = time.monotonic() + DEADLINE
        while other.latest().step == step:
            assert time.monotonic() < end
        with pytest.raises(catenary.Error, match=f"in 1 of its turns before step {step + 480}:"):
            next(steps)
