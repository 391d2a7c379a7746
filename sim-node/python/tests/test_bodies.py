"""Rigid bodies of this program in a simulation and in a node."""

from pathlib import Path

import catenary
import pytest
from conftest import StartNode

MASS = 0.5
INERTIA = (0.01, 0.02, 0.015)
SCENE = f"""
version = 1
gravity = [0, 0, 0]
[solver]
rate_hz = 240
substeps = 4
[[particle]]
position = [0.2, 0.101, 0]
velocity = [0, -2, 0]
mass = 0.25
[[collider]]
shape = "box"
center = [0, 0, 0]
half_extents = [0.3, 0.1, 0.3]
body = {{ mass = {MASS}, inertia = {list(INERTIA)} }}
"""
# A hit at the arm (0.2, 0.1, 0), without a bounce.
IMPULSE = -2 / (1 / 0.25 + 1 / MASS + 0.2**2 / INERTIA[2])


def require_hit(forces: catenary.Forces) -> None:
    assert forces.colliders.impulse[0] == pytest.approx([0, IMPULSE, 0], rel=1e-3, abs=1e-6)
    assert forces.colliders.angular_impulse[0, 2] == pytest.approx(0.2 * IMPULSE, rel=1e-3)


def test_a_particle_gives_a_body_the_impulse_of_the_closed_form() -> None:
    simulation = catenary.Simulation(toml=SCENE, forces=True)
    simulation.drive_body(0, (0, 0, 0))
    simulation.step()
    require_hit(simulation.forces())


def test_the_motion_and_the_wrench_of_a_body_move_its_collider_for_a_step() -> None:
    text = SCENE.replace("velocity = [0, -2, 0]\n", "")
    simulation = catenary.Simulation(toml=text.replace("0.101", "9"))
    simulation.drive_body(
        0,
        (0, 1, 0),
        velocity=(0, 0, 2.4),
        angular_velocity=(0, 24, 0),
        force=(MASS * 240, 0, 0),
        torque=(0, 0, 0),
    )
    simulation.step()
    center = simulation.colliders()[0]["center"]
    # The velocity for the step, and the force in four substeps.
    assert center == pytest.approx([(1 + 2 + 3 + 4) / 4 / 4 / 240, 1, 0.01], abs=1e-5)
    rotation = simulation.colliders()[0]["rotation"]
    assert rotation[1] == pytest.approx(0.05, abs=1e-3)
    simulation.step()
    assert simulation.colliders()[0]["center"] == pytest.approx(center), "it stands"


def test_a_node_drives_a_body_in_lockstep(start_node: StartNode, tmp_path: Path) -> None:
    scene = tmp_path / "box.toml"
    scene.write_text(SCENE)
    node = start_node(str(scene), "--paused", "--as-fast-as-possible", forces=True)
    with node.lockstep() as turns:
        node.resume()
        for snapshot in turns:
            if snapshot.step == 1:
                assert snapshot.forces is not None
                require_hit(snapshot.forces)
                break
            turns.drive_body(0, (0, 0, 0))
