"""Forces: at rest, the pin of a rope carries its other particles, and a floor all particles on it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import catenary
import numpy as np
import pytest
from conftest import StartNode

FREE_COUNT, MASS, GRAVITY, STEPS = 4, 0.25, 9.81, 1500
WEIGHT = FREE_COUNT * MASS * GRAVITY
ROPE = """
version = 1
name = "weights"
[solver]
rate_hz = 240
substeps = 8
damping = 5.0
[[generate]]
shape = "rope"
count = 5
from = [0.0, 2.0, 0.0]
to = [0.0, 1.0, 0.0]
mass = 0.25
pinned = "first"
[[collider]]
shape = "sphere"
center = [9.0, 0.0, 0.0]
radius = 0.5
"""


@pytest.fixture
def rope(tmp_path: Path) -> Path:
    path = tmp_path / "weights.toml"
    path.write_text(ROPE)
    return path


def require_weight(forces: catenary.Forces) -> None:
    """Requires that the pin carries the weight of the free particles, straight down.

    A position near 2 m is rounded by 1e-7 m, which in a substep of 1/1920 s is a velocity of 2e-4 m/s, so the
    force of a single step is off by about 1e-3. Over many steps that averages out.
    """
    assert forces.particles.tolist() == [0]
    assert forces.impulses.shape == (1, 3)
    assert forces.newtons(forces.impulses)[0] == pytest.approx([0, -WEIGHT, 0], rel=5e-3, abs=1e-3)
    assert forces.colliders.impulse.tolist() == [[0, 0, 0]]
    assert forces.colliders.angular_impulse.shape == (1, 3)
    assert forces.colliders.contacts.tolist() == [0]
    assert (len(forces.colliders), len(forces.anchors)) == (1, 0)
    assert forces.anchors.impulse.shape == forces.anchors.angular_impulse.shape == (0, 3)


def test_the_pin_of_a_rope_carries_its_weight_in_a_simulation(rope: Path) -> None:
    simulation = catenary.Simulation(rope, forces=True)
    without = catenary.Simulation(rope)
    for one in (simulation, without):
        one.step(STEPS)
    forces = simulation.forces()
    require_weight(forces)
    assert (forces.step, forces.rate) == (STEPS, 240)
    assert simulation.hash == without.hash
    simulation.reset()
    simulation.step(STEPS)
    require_weight(simulation.forces())


def test_a_simulation_without_forces_says_how_to_get_them(rope: Path) -> None:
    with pytest.raises(catenary.Error, match="forces=True"):
        catenary.Simulation(rope).forces()


def test_contacts_carry_the_weight_of_a_particle_on_a_floor() -> None:
    sphere = '"sphere"\ncenter = [9.0, 0.0, 0.0]\nradius = 0.5'
    scene = ROPE.replace(sphere, '"plane"\nnormal = [0.0, 1.0, 0.0]\noffset = 1.9')
    scene = scene.replace("to = [0.0, 1.0, 0.0]", "to = [1.0, 2.0, 0.0]")
    simulation = catenary.Simulation(toml=scene.replace('"first"', '"none"'), forces=True)
    simulation.step(STEPS)
    forces = simulation.forces()
    assert forces.colliders.contacts.tolist() == [5]
    down = forces.newtons(forces.colliders.impulse)[0, 1]
    assert down == pytest.approx(-5 * MASS * GRAVITY, rel=1e-3)
    assert forces.particles.shape == (0,)
    assert forces.impulses.shape == (0, 3)


def test_a_snapshot_of_a_node_comes_with_the_forces_of_its_step(
    start_node: StartNode, rope: Path
) -> None:
    node = start_node(str(rope), "--paused", forces=True)
    assert node.latest().forces is None, "no step has led to the initial state"
    with pytest.raises(catenary.Timeout, match="paused"):
        node.forces(timeout=0.0)
    simulation = catenary.Simulation(rope, forces=True)
    snapshots = node.snapshots()
    assert next(snapshots).forces is None
    for step in range(1, 5):
        node.step(1)
        simulation.step()
        expected = simulation.forces().impulses
        copy = node.latest().copy()
        for snapshot in (node.latest(), next(snapshots), copy, simulation.snapshot()):
            forces = snapshot.forces
            assert forces is not None
            assert (forces.step, forces.rate) == (step, 240)
            assert np.array_equal(forces.impulses, expected)
    node.step(STEPS)
    require_weight(node.forces())
    assert node.forces().step == STEPS + 4
    late = next(snapshots)
    assert 5 < late.step < STEPS, "the loop has missed snapshots"
    assert late.forces is not None and late.forces.step == late.step


def test_a_snapshot_without_forces_says_how_to_get_them(
    start_node: StartNode, rope: Path, simulate: Callable[..., Path]
) -> None:
    node = start_node(str(rope), "--paused")
    snapshots = [node.latest(), node.latest().copy()]
    for snapshot in snapshots:
        with pytest.raises(catenary.Error, match=r"attach\(..., forces=True\)"):
            _ = snapshot.forces
    with pytest.raises(catenary.Error, match=r"Simulation\(..., forces=True\)"):
        _ = catenary.Simulation(rope).snapshot().forces
    recording = catenary.open(simulate(str(rope), "--steps", "10"))
    with pytest.raises(catenary.RecordingError, match="--forces"):
        _ = recording[5].forces


def test_a_recording_has_the_forces_of_each_step_bit_for_bit(
    simulate: Callable[..., Path], rope: Path
) -> None:
    recording = catenary.open(simulate(str(rope), "--steps", str(STEPS), "--forces"))
    require_weight(recording.forces(STEPS))
    simulation = catenary.Simulation(rope, forces=True)
    for step in range(1, 40):
        simulation.step()
        assert recording.forces(step).step == step
        assert np.array_equal(recording.forces(step).impulses, simulation.forces().impulses)
        snapshot_forces = recording[step].forces
        assert snapshot_forces is not None and snapshot_forces.step == step
        assert np.array_equal(snapshot_forces.impulses, simulation.forces().impulses)
    with pytest.raises(catenary.RecordingError, match="no forces of step 0"):
        recording.forces(0)
    with pytest.raises(KeyError, match=f"no step {STEPS + 1}"):
        recording.forces(STEPS + 1)


class UnreadableForces(catenary.Recording):
    """A recording whose forces cannot be read."""

    def _forces(self, step: int) -> catenary.Forces | None:
        raise catenary.RecordingError(f"step {step} is damaged")


def test_arrays_leave_out_forces_only_where_none_were_recorded(
    simulate: Callable[..., Path], rope: Path
) -> None:
    path = simulate(str(rope), "--steps", "3", "--forces")
    forces = catenary.Recording(str(path)).to_numpy().forces
    assert forces is not None
    assert np.isnan(forces.fixed_impulses[0]).all() and np.isfinite(forces.fixed_impulses[1:]).all()
    with pytest.raises(catenary.RecordingError, match="step 0 is damaged"):
        UnreadableForces(str(path)).to_numpy()


def test_a_recording_without_forces_names_the_option(simulate: Callable[..., Path]) -> None:
    recording = catenary.open(simulate("rope", "--steps", "20"))
    with pytest.raises(catenary.RecordingError, match="--forces"):
        recording.forces(10)
