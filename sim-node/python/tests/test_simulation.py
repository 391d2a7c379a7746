"""The solver in this process."""

from __future__ import annotations

import copy
import json
import os
import pickle
import subprocess
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import catenary
import numpy as np
import pytest
from conftest import DEADLINE, PROGRAMS, StartNode

ABC: Any = "abc"


def test_a_simulation_has_the_bits_of_a_node(start_node: StartNode) -> None:
    node = start_node("curtain", "--paused")
    simulation = catenary.Simulation("curtain", threads=2)
    assert simulation.hash == node.latest().hash
    for target in (node, simulation):
        target.grab(90, (0.5, 0.2, 0.3), over=0.1)
        target.set(gravity=(1, -9, 0))
        target.cut_radius((0, 0, 0), 0.05)
    for count in (1, 2, 40):
        node.step(count)
        simulation.step(count)
        snapshot = node.latest()
        assert (simulation.step_count, simulation.hash) == (snapshot.step, snapshot.hash)
        assert np.array_equal(simulation.positions, snapshot.positions)
        assert np.array_equal(simulation.velocities, snapshot.velocities)
    assert np.array_equal(simulation.torn(), node.torn())
    simulation.step(10)
    node.restore(simulation.state())
    assert node.latest().hash == simulation.hash


def test_a_state_continues_in_another_simulation_and_after_pickling() -> None:
    first = catenary.Simulation("curtain")
    first.grab(90, (0.5, 0.2, 0.3), over=0.25)
    first.step(30)
    state = pickle.loads(pickle.dumps(first.state()))
    assert state.hash == first.hash
    second = catenary.Simulation("curtain")
    second.restore(state)
    assert second.hash == first.hash and second.step_count == 1
    first.step(100)
    second.step(100)
    assert second.hash == first.hash
    with pytest.raises(catenary.StateError, match="scene"):
        catenary.Simulation("rope").restore(state)


def test_the_energy_of_a_bend_follows_from_its_fields() -> None:
    # Two parts of 1 m at a right angle: the second difference of their ends is (-1, 1, 0).
    simulation = catenary.Simulation(
        toml="""
        version = 1
        [[particle]]
        position = [1, 0, 0]
        [[particle]]
        position = [0, 0, 0]
        [[particle]]
        position = [0, 1, 0]
        [[bend]]
        particles = [0, 1, 2]
        rigidity = 0.5
        """
    )
    bends = simulation.bends()
    assert len(bends) == 1 and catenary.BEND_SHAPES[bends.shapes[0]] == "line"
    assert bends.blocks.tolist() == [-1] and bends.rests.tolist() == [0]
    positions = simulation.positions[bends.particles]
    curvature = (bends.coefficients[:, :, None] * positions).sum(axis=1)
    energies = (curvature**2).sum(axis=1) * bends.rigidities / (2 * bends.geometries)
    # |C|^2 EI / (2 s^3), in J.
    assert energies.tolist() == [2 * 0.5 / 2]


def test_a_hinge_has_no_energy_in_the_shape_in_which_it_rests() -> None:
    simulation = catenary.Simulation(
        toml="""
        version = 1
        [[generate]]
        shape = "obj"
        vertices = [[0, 0, 0.3], [0, 0, 0], [1, 0, 0], [0.2, 1, 0.1], [1.2, 1, -0.4]]
        faces = [[0, 1, 2], [1, 3, 2], [2, 3, 4]]
        bending = 2
        rest = "loaded"
        """
    )
    bends = simulation.bends()
    assert [catenary.BEND_SHAPES[shape] for shape in bends.shapes] == ["hinge"] * 2
    p = simulation.positions[bends.particles].astype(float)
    curvature = (bends.coefficients[:, :, None] * p).sum(axis=1)
    normals = [
        np.cross(p[:, 2] - p[:, 1], p[:, 0] - p[:, 1]),
        np.cross(p[:, 3] - p[:, 1], p[:, 2] - p[:, 1]),
    ]
    n = sum(normal / np.linalg.norm(normal, axis=1)[:, None] for normal in normals)
    n /= np.linalg.norm(n, axis=1)[:, None]
    assert np.abs(bends.rests).min() > 0.1
    assert bends.rests[:, None] * n == pytest.approx(curvature, abs=1e-5)


def test_the_bending_of_a_block_has_the_bits_of_a_node(start_node: StartNode) -> None:
    node = start_node("two-flags", "--paused")
    simulation = catenary.Simulation("two-flags")
    plain = catenary.Simulation("two-flags")
    for target in (node, simulation):
        target.set(bending={1: 0.25})
        assert target.parameters()["bending_by_block"] == [{"block": 1, "value": 0.25}]
    assert np.array_equal(node.bends().particles, simulation.bends().particles)
    assert set(node.bends().blocks.tolist()) == {0, 1}
    node.step(30)
    simulation.step(30)
    plain.step(30)
    assert node.latest().hash == simulation.hash != plain.hash
    with pytest.raises(catenary.Rejected, match="generated block"):
        simulation.set(bending={2: 0.25})
    with pytest.raises(catenary.Rejected, match="no block"):
        simulation.set(damping={1: 0.25})
    simulation.set(bending=0.5)
    assert simulation.parameters()["bending_by_block"] == []


def test_motion_is_replaced_at_once_as_in_a_node(start_node: StartNode) -> None:
    node = start_node("carried-cloth", "--paused")
    simulation = catenary.Simulation("carried-cloth")
    for target in (node, simulation):
        target.pin(5)
        target.step(10)
    still = simulation.snapshot()
    for target in (node, simulation):
        target.set_motion(still.positions + np.float32(0.25), 0 * still.velocities)
    assert simulation.step_count == node.latest().step == 11
    assert simulation.hash == node.latest().hash
    assert simulation.positions == pytest.approx(still.positions + 0.25)
    assert simulation.state().hash == simulation.hash
    assert simulation.colliders() == node.colliders() != []
    for target in (node, simulation):
        target.step(20)
    assert simulation.hash == node.latest().hash
    simulation.restore(still)
    assert np.array_equal(simulation.positions, still.positions)
    with pytest.raises(ValueError, match="`positions` must have the shape"):
        simulation.set_motion(still.positions[:, :2], still.velocities)
    with pytest.raises(catenary.StateError, match="particles"):
        simulation.set_motion(still.positions[:5], still.velocities[:5])
    with pytest.raises(TypeError, match="State"):
        simulation.restore(still.positions)  # type: ignore[arg-type]


def test_the_friction_of_a_collider_changes_how_far_a_particle_slides(tmp_path: Path) -> None:
    scene = tmp_path / "slide.toml"
    scene.write_text("""
        version = 1
        [[particle]]
        position = [0, 0, 0]
        velocity = [1, 0, 0]
        [[collider]]
        shape = "plane"
        normal = [0, 1, 0]
        offset = 0
        friction = 0.5
        """)

    def slid(**values: dict[int, float]) -> float:
        simulation = catenary.Simulation(scene)
        simulation.set(**values)
        simulation.step(240)
        return float(simulation.positions[0, 0])

    # v^2 / (2 mu g), within 2 %; without friction, it slides on.
    assert slid(friction={0: 0.5}) == pytest.approx(1 / (2 * 0.5 * 9.81), rel=0.02)
    assert slid(friction={0: 0.0}) == pytest.approx(1.0, rel=0.02)
    with pytest.raises(catenary.Rejected, match="collider"):
        slid(friction={99: 0.5})
    with pytest.raises(TypeError, match="collider"):
        slid(friction={})


def test_a_reset_brings_the_initial_state_and_parameters_back() -> None:
    simulation = catenary.Simulation("curtain")
    initial = simulation.hash
    simulation.set(damping=0.9)
    simulation.pin(90)
    simulation.step(10)
    assert simulation.hash != initial
    simulation.reset()
    assert simulation.hash == initial and simulation.step_count == 11
    assert simulation.parameters() == catenary.Simulation("curtain").parameters()


def test_sixteen_simulations_run_in_sixteen_threads() -> None:
    def run(seed: int) -> np.uint64:
        simulation = catenary.Simulation("curtain")
        simulation.set(damping=seed % 4 / 4)
        for _ in range(20):
            simulation.step(50)
        return simulation.hash

    hashes = [np.uint64(0)] * 16

    def put(seed: int) -> None:
        hashes[seed] = run(seed)

    threads = [threading.Thread(target=put, args=(seed,)) for seed in range(16)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert hashes == [run(seed) for seed in range(4)] * 4


def test_the_interpreter_goes_on_while_a_simulation_steps() -> None:
    simulation = catenary.Simulation("curtain")
    thread = threading.Thread(target=simulation.step, args=(20_000,))
    thread.start()
    counted = 0
    while thread.is_alive():
        counted += 1
    assert counted > 10 and simulation.step_count == 20_000


def sweep(damping: float) -> float:
    simulation = catenary.Simulation("pendulum")
    simulation.set(damping=damping)
    simulation.step(240)
    return float(np.linalg.norm(simulation.velocities[1]))


def test_simulations_run_in_processes() -> None:
    dampings = [0.0, 0.5, 1.0]
    with ProcessPoolExecutor(2, mp_context=get_context("fork")) as pool:
        assert list(pool.map(sweep, dampings)) == [sweep(damping) for damping in dampings]


def test_a_simulation_with_threads_refuses_a_fork() -> None:
    simulation = catenary.Simulation("flag", threads=2)
    simulation.step()
    child = os.fork()
    if child == 0:
        try:
            simulation.step()
        except catenary.Error as error:
            os._exit(0 if "fork" in str(error) else 2)
        os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    simulation.step()


def test_a_state_waits_for_the_step_of_a_command() -> None:
    simulation = catenary.Simulation("curtain")
    simulation.cut(7)
    with pytest.raises(catenary.StateError, match="call `step"):
        simulation.state()
    simulation.step()
    assert simulation.state().hash == simulation.hash


def test_arrays_are_views_of_one_snapshot_that_no_step_changes() -> None:
    simulation = catenary.Simulation("curtain")
    positions, velocities = simulation.positions, simulation.velocities
    assert np.shares_memory(positions, simulation.positions), "one copy for each step"
    assert np.shares_memory(simulation.snapshot().positions, positions)
    for array in (positions, velocities):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
        with pytest.raises(ValueError, match="WRITEABLE"):
            array.flags.writeable = True
    kept = positions.copy()
    simulation.step(10)
    assert np.array_equal(positions, kept)
    assert not np.array_equal(simulation.positions, kept)
    simulation.reset()
    assert np.array_equal(simulation.positions, kept)


def test_hashes_are_numbers_of_numpy_and_text_of_json() -> None:
    simulation = catenary.Simulation("curtain")
    hashes = []
    for _ in range(64):
        simulation.step()
        hashes.append(simulation.hash)
    array = np.array(hashes)
    assert array.dtype == np.uint64 and array.tolist() == [int(one) for one in hashes]
    assert max(array) > np.iinfo(np.int64).max, "an int would not fit"
    for one in (simulation, simulation.snapshot(), simulation.state()):
        assert isinstance(one.hash, np.uint64)
        assert json.loads(json.dumps(one.hash_hex)) == f"{one.hash:016x}"
    assert simulation.state().scene_hash == simulation.topology().scene_hash
    # As the vectorized environments of Gymnasium collect `info`: an array of the type of the first value.
    info = np.zeros(2, dtype=type(simulation.hash))
    info[1] = simulation.hash
    assert info[1] == simulation.hash


class Environment(catenary.Simulation):
    """A simulation with attributes of its own."""

    goal = 0.0


COPIES: list[Callable[[Environment], Environment]] = [
    copy.copy,
    copy.deepcopy,
    lambda one: pickle.loads(pickle.dumps(one)),
    lambda one: pickle.loads(pickle.dumps(one, protocol=2)),
]


@pytest.mark.parametrize("make_copy", COPIES)
def test_a_copy_goes_on_with_the_same_bits(make_copy: Callable[[Environment], Environment]) -> None:
    first = Environment("carried-cloth", threads=2, forces=True)
    first.goal = 3.0
    first.set(damping=0.3, gravity=(1, -5, 0))
    first.grab(3, (0.5, 0.2, 0.3), over=0.25)
    first.cut_radius((0, 0, 0), 0.2)
    first.step(30)
    second = make_copy(first)
    assert isinstance(second, Environment) and second.goal == 3.0
    assert (second.hash, second.step_count) == (first.hash, 30)
    assert second.parameters() == first.parameters() and second.scene() == first.scene()
    assert np.array_equal(second.torn(), first.torn())
    for one in (first, second):
        one.move(3, (0.1, 0.4, 0.3))
        one.step(100)
    assert second.hash == first.hash
    assert np.array_equal(second.forces().impulses, first.forces().impulses)
    with pytest.raises(catenary.Rejected):
        first.pin(1_000_000)
    assert make_copy(first).hash == first.hash, "a rejected command changes nothing"
    first.pin(1)
    with pytest.raises(catenary.StateError, match="call `step"):
        make_copy(first)


def advance(simulation: catenary.Simulation) -> catenary.Simulation:
    simulation.step(100)
    return simulation


def test_simulations_go_to_other_processes_and_come_back() -> None:
    simulation = catenary.Simulation("curtain")
    simulation.step(5)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        (other,) = pool.map(advance, [simulation])
    simulation.step(100)
    assert (other.hash, other.step_count) == (simulation.hash, 105)


def test_the_energy_of_a_fall_turns_from_potential_to_kinetic() -> None:
    scene = "version = 1\n[solver]\nsubsteps = 64\n[[particle]]\nposition = [0, 3, 0]\nmass = 2\n"
    falling = catenary.Simulation(toml=scene)
    assert falling.energy() == pytest.approx({"kinetic": 0.0, "potential": 2 * 9.81 * 3, "elastic": 0.0})
    falling.step(falling.rate // 2)
    fall = 9.81 / 8
    expected = {"kinetic": 2 * 9.81 * fall, "potential": 2 * 9.81 * (3 - fall), "elastic": 0.0}
    assert falling.energy() == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("forces", [False, True])
def test_a_recorded_simulation_has_the_bytes_of_recorder_simulate(
    tmp_path: Path, simulate: Callable[..., Path], forces: bool
) -> None:
    path = tmp_path / "own.mcap"
    with catenary.Simulation("carried-cloth", record=path, forces=forces) as simulation:
        simulation.step(100)
        simulation.grab(3, (0.5, 0.2, 0.3), over=0.25)
        simulation.set(damping=0.3)
        with pytest.raises(catenary.Rejected):
            simulation.pin(10**6)
        simulation.step(250)
        simulation.cut_radius((0, 0, 0), 0.2)
        simulation.mark("here")
        simulation.reset()
        simulation.step(30)
        assert not path.exists(), "it gets its name when it is complete"
        simulation.cut(3)
    options = ["--forces"] if forces else []
    again = simulate("carried-cloth", "--steps", "381", "--commands", str(path), *options)
    assert path.read_bytes() == again.read_bytes()
    lines = [
        {"step": 101, "kind": "grab", "particle": 3, "target": [0.5, 0.2, 0.3], "over_s": 0.25},
        {"step": 101, "kind": "set", "parameter": "damping", "value": 0.3},
        {"step": 101, "kind": "pin", "particle": 10**6},
        {"step": 351, "kind": "cut_radius", "center": [0, 0, 0], "radius": 0.2},
        {"step": 351, "kind": "mark", "text": "here"},
        {"step": 351, "kind": "reset"},
    ]
    commands = tmp_path / "commands.jsonl"
    commands.write_text("\n".join(map(json.dumps, lines)))
    again.unlink()
    again = simulate("carried-cloth", "--steps", "381", "--commands", str(commands), *options)
    assert path.read_bytes() == again.read_bytes()
    assert catenary.verify(path).is_identical
    checked = subprocess.run([PROGRAMS / "recorder", "check", path], timeout=DEADLINE)
    assert checked.returncode == 0, "the checksums are right"


def test_a_recorded_simulation_can_be_restored_and_proved(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    simulation = catenary.Simulation("curtain", record=path, threads=2)
    simulation.step(20)
    state = simulation.state()
    simulation.step(20)
    simulation.restore(state)
    simulation.step(5)
    simulation.set_motion(simulation.positions, 0 * simulation.velocities)
    simulation.step(5)
    last = simulation.hash
    with pytest.raises(catenary.RecordingError, match="run.mcap"):
        catenary.Simulation("curtain", record=path)
    del simulation
    recording = catenary.open(path)
    assert (recording.last_step, recording[52].hash) == (52, last)
    assert recording[41].hash == state.hash
    assert catenary.verify(path).is_identical
    with pytest.raises(catenary.RecordingError, match=r"exists \(use overwrite=True to"):
        catenary.Simulation("curtain", record=path)
    catenary.Simulation("curtain", record=path, overwrite=True).close()
    assert catenary.open(path).last_step == 0


def test_a_recorded_simulation_refuses_a_fork(tmp_path: Path) -> None:
    simulation = catenary.Simulation("flag", record=tmp_path / "run.mcap")
    child = os.fork()
    if child == 0:
        try:
            simulation.step()
        except catenary.Error as error:
            os._exit(0 if "fork" in str(error) else 2)
        os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    simulation.close()
    assert catenary.open(tmp_path / "run.mcap").last_step == 0


def test_a_falling_particle_follows_the_closed_form() -> None:
    scene = 'version = 1\n[solver]\nrate_hz = 240\n[[particle]]\nposition = [0, 0, 0]\n'
    simulation = catenary.Simulation(toml=scene)
    simulation.step(240)
    # One substep after another: v = -g n h, y = -g h^2 n (n + 1) / 2.
    substeps = simulation.parameters()["substeps"]
    n, h = 240 * substeps, 1 / (240 * substeps)
    assert simulation.velocities[0, 1] == pytest.approx(-9.81 * n * h, rel=1e-4)
    assert simulation.positions[0, 1] == pytest.approx(-9.81 * h * h * n * (n + 1) / 2, rel=1e-4)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: catenary.Simulation("nix"), catenary.SceneError, "no built-in scene 'nix'"),
        (lambda: catenary.Simulation("./nix.toml"), catenary.SceneError, "nix.toml"),
        (lambda: catenary.Simulation(toml="version = 2"), ValueError, "version"),
        (lambda: catenary.Simulation("rope", threads=0), ValueError, "`threads` is 0 .*1 to 64"),
        (lambda: catenary.Simulation(), TypeError, "scene"),
        (lambda: catenary.Simulation("rope").step(-1), ValueError, "`count` is -1 .*0 to "),
        (lambda: catenary.Simulation("rope").pin(-1), ValueError, "`particle` is -1 .*0 to "),
        (lambda: catenary.Simulation("rope").pin(2**32), ValueError, "`particle` is 4294967296"),
        (lambda: catenary.Simulation("rope").cut(ABC), TypeError, "`constraint` must be a whole"),
        (lambda: catenary.Action.rewind(back_steps=-1), ValueError, "`back_steps` is -1"),
        (lambda: catenary.attach(client_id=-1), ValueError, "`client_id` is -1"),
        (lambda: catenary.Simulation("rope").grab(1, (1, 2)), TypeError, "3 numbers"),
        (lambda: catenary.Simulation("rope").grab(1, (1, 2, 3, 4)), TypeError, "3 numbers"),
        (lambda: catenary.Simulation("rope").grab(1, ABC), TypeError, "3 numbers"),
        (lambda: catenary.Simulation("rope").set(), TypeError, "at least one"),
        (lambda: catenary.Simulation("rope").set(damping=ABC), TypeError, "a number"),
        (lambda: catenary.Simulation("rope").set(damping=True), TypeError, "a number"),
        (lambda: catenary.Simulation("rope").set(stiffness={"x": 1}), ValueError, "kind"),
        (lambda: catenary.Simulation("rope").pin(10**6), catenary.Rejected, "no such particle"),
        (
            lambda: catenary.Simulation("rope").apply(catenary.Action.load("curtain")),
            catenary.Rejected,
            "no effect here",
        ),
        (lambda: catenary.Action.rewind(), ValueError, "to_step"),
        (lambda: catenary.Action.from_dict({"kind": "pim"}), ValueError, "pim"),
        (lambda: catenary.Action.from_dict({"kind": "gab"}), ValueError, r"did you mean 'grab'\?"),
        (
            lambda: catenary.Action.from_dict({"kind": "pin", "partcle": 1}),
            ValueError,
            r"did you mean 'particle'\?",
        ),
        (lambda: catenary.State(1, b"123", b""), ValueError, "bytes"),
        (lambda: catenary.State(1, b"", b"1234567"), catenary.StateError, "version"),
    ],
)
def test_misuse_raises(call: Callable[[], object], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call()


def test_actions_have_the_form_of_recordings() -> None:
    action = catenary.Action.grab(3, (1, 2, 3), 0.125)
    fields = {"kind": "grab", "particle": 3, "target": [1, 2, 3], "over_s": 0.125}
    assert action.to_dict() == fields
    assert catenary.Action.from_dict(fields) == action != catenary.Action.pin(3)


def test_every_kind_of_action_has_a_constructor() -> None:
    # A restore belongs to a state, which `Node.restore` gives to the node.
    missing = {kind for kind in catenary.Action.KINDS if not hasattr(catenary.Action, kind)}
    assert missing == {"restore"}
    assert catenary.Action("pin", particle=3) == catenary.Action.pin(3)
    with pytest.raises(ValueError, match=r"did you mean 'particle'\?"):
        catenary.Action("pin", partcle=3)


def test_the_scene_of_a_recording_runs(simulate: Callable[..., Path]) -> None:
    path = simulate("pendulum", "--steps", "100")
    simulation = catenary.Simulation(str(path))
    simulation.step(100)
    assert simulation.hash == catenary.open(path)[100].hash
