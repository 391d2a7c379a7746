"""Reading a node and sending commands to it."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path

import catenary
import numpy as np
import pytest
import xxhash
from conftest import DEADLINE, Interrupt, StartNode


def test_the_snapshots_of_a_node_come_one_by_one_with_their_hash(start_node: StartNode) -> None:
    node = start_node("curtain")
    snapshots = node.snapshots()
    previous = next(snapshots)
    for _ in range(100):
        snapshot = next(snapshots)
        assert snapshot.snapshot_index == previous.snapshot_index + 1
        assert snapshot.step == previous.step + 1
        assert snapshot.time == pytest.approx(snapshot.step / 240)
        assert snapshot.run_id == previous.run_id
        particles = np.empty((len(snapshot), 8), np.float32)
        particles[:, 0:3] = snapshot.positions
        particles[:, 3] = snapshot.inverse_masses
        particles[:, 4:7] = snapshot.velocities
        particles.view(np.uint32)[:, 7] = snapshot.flags
        assert xxhash.xxh3_64_intdigest(particles.tobytes()) == snapshot.hash
        previous = snapshot


def test_arrays_are_views_that_cannot_be_written_and_outlive_their_snapshot(
    start_node: StartNode,
) -> None:
    node = start_node("curtain", "--paused")
    snapshot = node.latest()
    positions = snapshot.positions
    assert positions.shape == (168, 3) and positions.strides == (32, 4)
    owner: object = positions.base
    assert not positions.flags.owndata and owner is snapshot
    assert positions.ctypes.data == snapshot.positions.ctypes.data
    assert snapshot.velocities.ctypes.data == positions.ctypes.data + 16
    for array in (positions, snapshot.velocities, snapshot.inverse_masses, snapshot.flags):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
        with pytest.raises(ValueError):
            array.flags.writeable = True
    before = positions.copy()
    del snapshot
    node.close()
    assert np.array_equal(positions, before), "the memory stays mapped"


def test_a_program_that_keeps_the_newest_snapshots_is_told_so(start_node: StartNode) -> None:
    node = start_node("curtain")
    held = []
    deadline = time.monotonic() + DEADLINE
    with pytest.raises(catenary.TooManySnapshots, match="holds 4 snapshots.*copy"):
        while time.monotonic() < deadline:
            held.append(node.latest().positions)
    step = node.status()["step"]
    held.clear()
    assert node.latest().step >= step


def test_a_program_that_holds_too_many_snapshots_is_told_so(start_node: StartNode) -> None:
    node = start_node("curtain")
    held = []
    with pytest.raises(catenary.TooManySnapshots, match="holds 4 snapshots.*copy"):
        for snapshot in node.snapshots():
            held.append(snapshot.positions)
    assert len(held) == 4
    copy, values = snapshot.copy(), snapshot.positions.copy()
    held.clear()
    del snapshot
    assert node.next_snapshot(DEADLINE) is not None
    assert np.array_equal(copy.positions, values)


def test_everything_that_a_node_publishes_can_be_read(start_node: StartNode) -> None:
    node = start_node("carried-cloth", "--paused")
    node.cut(5)
    node.step()
    snapshot, topology, surface = node.latest(), node.topology(), node.surface()
    assert topology.ends.shape == (len(topology), 2) and topology.ends.max() < len(snapshot)
    a, b = snapshot.positions[topology.ends[:, 0]], snapshot.positions[topology.ends[:, 1]]
    assert np.linalg.norm(b - a, axis=1) == pytest.approx(topology.rest_lengths, rel=0.02)
    assert surface.shape[1] == 3 and surface.max() < len(snapshot)
    assert snapshot.torn_count == 1
    assert {catenary.CONSTRAINT_KINDS[kind] for kind in topology.kinds} >= {"structural"}
    simulation = catenary.Simulation(toml=node.scene())
    assert simulation.topology().scene_hash == topology.scene_hash
    assert node.parameters() == simulation.parameters()
    assert node.status()["particle_count"] == len(snapshot)
    assert [collider["shape"] for collider in node.colliders()] == ["box", "plane"]
    assert node.torn().tolist() == [5]


def test_commands_return_their_outcome_or_raise_with_the_reason(start_node: StartNode) -> None:
    node = start_node("curtain", "--paused")
    outcome = node.grab(90, (0.5, 0.2, 0.3), over=0.1)
    assert outcome.is_applied and outcome.client_id == node.client_id
    node.step(30)
    snapshot = node.latest()
    assert snapshot.positions[90] == pytest.approx([0.5, 0.2, 0.3])
    assert snapshot.flags[90] == catenary.GRABBED
    node.move(90, np.array([0.5, 0.3, 0.3]), over=0.0)
    node.release(90)
    node.pin(95)
    node.unpin(95)
    node.cut(0)
    node.cut_radius((0, 0, 0), 0.1)
    node.cut_segment((-1, 0.31, 0), (1, 0.31, 0))
    node.push((0, 0, 0), 1.0, (0, 0, 0.001), limit=0.01)
    node.set(gravity=(0, -1, 0), damping=0.5, tear_force=None)
    node.mark("here")
    node.step()
    assert node.parameters()["gravity"] == [0, -1, 0]
    assert node.torn()[0] == 0 and node.torn().size > 14
    rejected: list[tuple[Callable[[], object], str]] = [
        (lambda: node.pin(168), "unknown_particle"),
        (lambda: node.cut(0), "already_torn"),
        (lambda: node.move(3, (0, 0, 0)), "not_grabbed"),
        (lambda: node.set(dampness=1), "unknown_parameter"),
        (lambda: node.set(damping=float("nan")), "non_finite"),
        (lambda: node.set(damping=-1), "out_of_range"),
        (lambda: node.move_anchor(0, (0, 0, 0)), "unknown_anchor"),
        (lambda: node.move_collider(1, (0, 0, 0)), "unknown_collider"),
        (lambda: node.rewind(to_step=10**9), "out_of_range"),
    ]
    for command, reason in rejected:
        with pytest.raises(catenary.Rejected) as error:
            command()
        assert error.value.reason == reason
        assert error.value.outcome is not None and error.value.outcome.reason == reason


def test_a_rejection_names_the_allowed_values(start_node: StartNode) -> None:
    node = start_node("curtain", "--paused")
    simulation = catenary.Simulation("curtain")
    rejected: list[tuple[catenary.Action, str]] = [
        (catenary.Action.pin(168), "0 to 167"),
        (catenary.Action.cut(596), "0 to 595"),
        (catenary.Action.move_collider(1, (0, 0, 0)), "0"),
        (catenary.Action.set("dampness", 1), "gravity, damping, .*"),
        (catenary.Action.set("damping", float("nan")), "finite numbers"),
        (catenary.Action.set("damping", -1), "a number >= 0, or off for 0"),
        (catenary.Action.grab(3, (0, 0, 0), 3601), "coordinates within 1e7, .* over 0 to 3600 s"),
    ]
    for action, allowed in rejected:
        message = rf"^rejected.*: .* \(allowed: {allowed}\): {{"
        with pytest.raises(catenary.Rejected, match=message):
            node.request(action)
        with pytest.raises(catenary.Rejected, match=message):
            simulation.apply(action)
    with pytest.raises(catenary.Rejected, match="none, because there is none"):
        catenary.Simulation("rope").apply(catenary.Action.move_collider(0, (0, 0, 0)))


def test_many_commands_are_sent_before_the_first_answer(start_node: StartNode) -> None:
    node = start_node("curtain", "--paused")
    with pytest.raises(catenary.Rejected, match="no such particle"):
        with node.batch() as batch:
            for particle in range(160, 170):
                batch.pin(particle)
    assert [outcome.is_applied for outcome in batch.outcomes] == [True] * 8 + [False] * 2
    with node.batch() as long:
        for index in range(3000):
            long.grab(20, (0, 0, index / 1000)) if index == 0 else long.move(20, (0, 0, 0))
    assert len(long.outcomes) == 3000
    sequences = [outcome.sequence for outcome in batch.outcomes]
    assert sequences == sorted(sequences)


def test_a_path_whose_first_command_is_refused_appends_nothing_to_the_motion_under_way(
    start_node: StartNode,
) -> None:
    node = start_node("drop-box", "--paused")
    first = node.move_collider(0, (1, 0, 0), over=1.0)
    path = [(index + 10, 2e7 if index == 0 else 0, 0, 0) for index in range(12)]
    with pytest.raises(catenary.Rejected) as error:
        node.follow("collider", 0, path)
    assert error.value.reason == "out_of_range"
    assert node.mark("end").index == first.index + 2


def test_the_outcome_of_a_long_path_is_that_of_its_first_command(start_node: StartNode) -> None:
    node = start_node("drop-box")
    outcome = node.follow("collider", 0, [(1 + index, 0.01 * index, 0, 0) for index in range(400)])
    assert not outcome.command.get("append")
    assert node.mark("end").index == outcome.index + 100


def test_a_wrong_path_names_its_point() -> None:
    wrong: list[tuple[list[list[float]], str]] = [
        ([], r"a path of 0 points \(allowed: 1 to 2048\)"),
        ([[0, 0, 0, 0], [1, 0, 0]], r"point 1 of the path: 3 numbers \(allowed: 4,"),
        ([[0, 0, 0, 0], [0, 0, 0, 0]], "point 1 of the path: the time 0 is not after 0"),
        ([[3601, 0, 0, 0]], "point 0 of the path: the time 3601 is out of range"),
        ([[0, 0, float("nan"), 0]], "point 0 of the path: a number is not finite in 32 bits"),
    ]
    for path, fault in wrong:
        with pytest.raises(ValueError, match=fault):
            catenary.Action.follow("collider", 0, path)


def test_a_scene_that_cannot_be_loaded_is_refused_with_its_cause(
    start_node: StartNode, tmp_path: Path
) -> None:
    node = start_node("rope", "--paused")
    with pytest.raises(catenary.SceneError, match="nofile.toml: cannot read the scene"):
        node.load("./nofile.toml")
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("version = 1\n[solver]\nrate = 60\n")
    with pytest.raises(catenary.SceneError, match="wrong.toml:3: solver.rate: unknown key"):
        node.load(wrong)
    with pytest.raises(catenary.SceneError, match="no built-in scene 'curtian'"):
        node.load("curtian")
    wrong.write_text("version = 1\n")
    assert node.load(wrong).is_applied


def test_a_paused_node_has_a_complete_state(start_node: StartNode) -> None:
    node = start_node("curtain")
    with pytest.raises(catenary.Rejected, match=r"the node runs; pause\(\) pauses it"):
        node.step(3)
    node.pause()
    assert node.state().hash == node.latest().hash


def test_states_are_taken_restored_and_rewound(start_node: StartNode) -> None:
    node = start_node("curtain", "--paused")
    node.grab(90, (0.5, 0.2, 0.3), over=0.25)
    node.step(40)
    state, hash_then = node.state(), node.latest().hash
    assert state.hash == hash_then
    node.step(100)
    later = node.latest().hash
    outcome = node.restore(state)
    assert outcome.command["contents"] == "state"
    assert node.latest().hash == hash_then, "also while paused"
    node.step(100)
    assert node.latest().hash == later
    step = node.latest().step
    assert node.rewind(back_steps=50).command["to_step"] == step - 50
    still = node.latest()
    node.set_motion(still.positions + np.float32(0.5), 0 * still.velocities)
    moved = node.latest()
    assert moved.positions == pytest.approx(still.positions + 0.5)
    assert not moved.velocities.any()
    node.restore(still)
    assert np.array_equal(node.latest().positions, still.positions)
    for wrong in (np.zeros((168, 2)), np.zeros((3, 168)), np.zeros(3)):
        with pytest.raises(ValueError, match="shape"):
            node.set_motion(wrong, wrong)
    with pytest.raises(TypeError, match="State"):
        node.restore(still.positions)  # type: ignore[arg-type]
    other = catenary.Simulation("rope").state()
    with pytest.raises(catenary.Rejected) as error:
        node.restore(other)
    assert error.value.reason == "invalid_state"


def test_a_load_of_another_rate_begins_a_run_and_reading_goes_on(start_node: StartNode) -> None:
    node = start_node("curtain")
    run_id = node.latest().run_id
    rate = node.topology().rate
    other = next(n for n in catenary.scene_names() if catenary.Simulation(n).rate != rate)
    assert node.load(other).begins_run
    for snapshot in node.snapshots():
        if snapshot.run_id != run_id:
            break
    assert node.topology().rate != rate
    assert node.topology().ends.max() < len(node.latest()), "the snapshot of the new scene"
    with pytest.raises(catenary.SceneError, match="no built-in scene 'nix'"):
        node.load("nix")


def test_the_loop_ends_with_the_node_and_reads_the_next_one(
    start_node: StartNode, processes: list[subprocess.Popen[str]]
) -> None:
    node = start_node("curtain")
    first = node.latest().run_id
    for count, snapshot in enumerate(node.snapshots()):
        assert snapshot.run_id == first
        if count == 20:
            processes[0].kill()
    assert not node.is_running
    with pytest.raises(catenary.NotRunning):
        end = time.monotonic() + DEADLINE
        while time.monotonic() < end:
            node.latest()
    with pytest.raises(catenary.NotRunning):
        node.pin(3)
    start_node("curtain")
    assert node.next_snapshot(DEADLINE).run_id != first  # type: ignore[union-attr]
    assert node.pin(3).is_applied


def test_each_loop_sees_every_snapshot(start_node: StartNode) -> None:
    node = start_node("curtain", "--paused")
    node.step(5)
    first, second = node.snapshots(), node.snapshots()
    assert next(first).step == next(second).step == 5, "the newest one, although it was read"
    for step in range(6, 30):
        node.step()
        assert node.latest().step == step
    assert [next(first).step for _ in range(24)] == list(range(6, 30))
    assert [next(second).step for _ in range(24)] == list(range(6, 30))


def test_rejections_cross_processes(start_node: StartNode) -> None:
    node = start_node("curtain")
    with pytest.raises(catenary.Rejected) as error:
        node.pin(1000)
    copy = pickle.loads(pickle.dumps(error.value))
    assert (str(copy), copy.reason) == (str(error.value), "unknown_particle")


def test_a_missing_node_is_named(domain: str) -> None:
    with pytest.raises(catenary.NotRunning, match=f"no node runs as 'sim' in domain '{domain}'"):
        catenary.attach()
    with pytest.raises(ValueError, match="valid name"):
        catenary.attach("a b")
    with pytest.raises(ValueError, match="timeout"):
        catenary.attach(timeout=-1.0)


def test_a_stopped_node_is_named_after_the_timeout(
    start_node: StartNode, processes: list[subprocess.Popen[str]]
) -> None:
    node = start_node("curtain")
    node.latest()
    processes[0].send_signal(signal.SIGSTOP)
    action = catenary.Action.pin(3)
    with pytest.raises(catenary.Timeout, match="does not answer"):
        node.request(action, timeout=0.2)
    assert isinstance(catenary.Timeout(), TimeoutError)


def test_ctrl_c_ends_a_wait(start_node: StartNode, interrupt: Interrupt) -> None:
    start_node("curtain", "--paused")
    setup = "node = catenary.attach(); node.latest()"
    endless = "catenary.Simulation('curtain').step(10**12)"
    for call in ("node.next_snapshot()", "list(node.snapshots())", endless):
        assert interrupt(call, setup) == "interrupted\n", call


def test_ctrl_c_ends_a_wait_for_a_stopped_node(
    start_node: StartNode, processes: list[subprocess.Popen[str]], interrupt: Interrupt
) -> None:
    start_node("curtain", "--paused")
    setup = (
        "node = catenary.attach(); state = node.state(); node.topology(); still = node.latest().copy()"
    )
    for call in (
        "node.restore(state, timeout=1e6)",
        "node.set_motion(still.positions, still.velocities, timeout=1e6)",
        "node.lockstep(timeout=1e6).__enter__()",
    ):
        stop = lambda: processes[0].send_signal(signal.SIGSTOP)
        assert interrupt(call, setup, stop) == "interrupted\n", call
        processes[0].send_signal(signal.SIGCONT)


def test_a_forked_process_cannot_use_the_node_and_does_not_disturb_it(
    start_node: StartNode,
) -> None:
    node = start_node("curtain")
    positions = node.latest().positions
    child = os.fork()
    if child == 0:
        try:
            node.latest()
        except catenary.Error as error:
            os._exit(0 if "fork" in str(error) else 2)
        os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert positions.shape == (168, 3)
    assert node.next_snapshot(DEADLINE) is not None


def test_several_threads_share_a_node(start_node: StartNode) -> None:
    node = start_node("curtain", "--rate", "1000")
    errors = []

    def use(particle: int) -> None:
        try:
            for _ in range(30):
                node.pin(particle)
                node.latest().positions.sum()
                node.unpin(particle)
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=use, args=(particle,)) for particle in range(20, 28)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(DEADLINE)
    assert not errors


def test_published_at_is_on_the_clock_of_time_monotonic(start_node: StartNode) -> None:
    node = start_node("curtain")
    before = time.monotonic()
    for snapshot in node.snapshots():
        if snapshot.published_at >= before:
            break
    assert before <= snapshot.published_at <= time.monotonic()

