"""Controllers in lockstep with a node."""

from __future__ import annotations

import random
import re
import time

import catenary
import numpy as np
import pytest
from conftest import DEADLINE, StartNode


def damp(node: catenary.Node, rng: random.Random) -> list[int]:
    """Damps the pendulum by its pivot, and wastes random amounts of time."""
    hashes: list[int] = []
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
    assert seen == list(range(seen[0], seen[0] + 80, 4)) and seen[0] % 4 == 0


def test_a_member_takes_part_at_the_published_multiples_of_its_period(
    start_node: StartNode,
) -> None:
    node = start_node("curtain", "--every", "3")
    with node.lockstep(every=2) as steps:
        seen = [snapshot.step for snapshot, _ in zip(steps, range(20))]
    assert seen == list(range(seen[0], seen[0] + 120, 6)) and seen[0] % 6 == 0


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


@pytest.mark.parametrize(("published", "every", "period"), [(1, 1, 1), (1, 4, 4), (3, 1, 3), (4, 6, 12)])
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
        assert turn == step + (count + 1) * period
