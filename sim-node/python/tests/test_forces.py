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


def test_the_forces_of_a_node_are_those_of_the_step_of_a_snapshot(
    start_node: StartNode, rope: Path
) -> None:
    node = start_node(str(rope), "--paused")
    first = node.latest().copy()
    assert node.forces_of(first) is None
    with pytest.raises(catenary.Timeout, match="paused"):
        node.forces(timeout=0.0)
    node.step(STEPS)
    require_weight(node.forces())
    assert node.forces().step == STEPS
    node.step(1)
    snapshot = node.latest()
    forces = node.forces_of(snapshot)
    assert forces is not None and forces.step == snapshot.step == STEPS + 1
    require_weight(forces)
    assert node.forces_of(first) is None
    simulation = catenary.Simulation(rope, forces=True)
    simulation.step(STEPS + 1)
    assert np.array_equal(simulation.forces().impulses, forces.impulses)


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
    with pytest.raises(catenary.RecordingError, match="no forces of step 0"):
        recording.forces(0)
    with pytest.raises(KeyError, match=f"no step {STEPS + 1}"):
        recording.forces(STEPS + 1)


def test_a_recording_without_forces_names_the_option(simulate: Callable[..., Path]) -> None:
    recording = catenary.open(simulate("rope", "--steps", "20"))
    with pytest.raises(catenary.RecordingError, match="--forces"):
        recording.forces(10)
