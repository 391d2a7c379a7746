"""The examples do what they say."""

from __future__ import annotations

import re
import subprocess
import sys
import types
from pathlib import Path
from typing import Any

import catenary
import conftest
import nbformat
import numpy as np
import pytest
from conftest import DEADLINE, REPOSITORY, StartNode
from nbclient import NotebookClient

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
PROGRAMS = REPOSITORY / "examples"


def run(path: str | Path, *arguments: object) -> str:
    command = [sys.executable, str(EXAMPLES / path), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_no_example_is_longer_than_a_screen() -> None:
    for path in EXAMPLES.glob("*.py"):
        lines = len(path.read_text().splitlines())
        assert lines <= (30 if path.name == "to_ros2.py" else 25), path


def test_the_corner_is_pulled_and_its_height_plotted(start_node: StartNode, tmp_path: Path) -> None:
    node = start_node("curtain")
    picture = tmp_path / "corner.png"
    run("pull_corner.py", picture)
    assert picture.read_bytes().startswith(b"\x89PNG")
    flags = node.latest().flags
    assert not (flags & catenary.GRABBED).any(), "the corner was released"


def test_the_mass_is_held_still(start_node: StartNode) -> None:
    start_node("pendulum", "--as-fast-as-possible")
    (speed,) = re.findall(r"moves at ([\d.]+) m/s", run("hold_still.py"))
    assert float(speed) < 0.01


def test_a_softer_curtain_hangs_lower() -> None:
    heights = [float(y) for y in re.findall(r"y = (-?[\d.]+) m", run("sweep.py"))]
    assert len(heights) == 5 and heights == sorted(heights, reverse=True)


def test_snapshots_reach_rerun(start_node: StartNode, tmp_path: Path) -> None:
    start_node("curtain")
    file = tmp_path / "live.rrd"
    run("to_rerun.py", file, 50)
    rerun = Path(sys.executable).with_name("rerun")
    stats = subprocess.run(
        [rerun, "rrd", "verify", file], capture_output=True, text=True, timeout=DEADLINE
    )
    assert stats.returncode == 0, stats.stderr
    assert file.stat().st_size > 50 * 168 * 12


def test_a_controller_pulls_a_point_to_its_height(start_node: StartNode) -> None:
    node = start_node("curtain", "--as-fast-as-possible")
    # A gust would push it by up to 20 mm, depending on when the controller ends.
    node.set({"wind.drag": 0})
    (distance,) = re.findall(r"is ([\d.]+) mm", run(PROGRAMS / "pull" / "pull.py"))
    assert float(distance) < 10


def test_the_python_on_the_page_for_robotics_runs_beside_the_curtain(start_node: StartNode) -> None:
    start_node("curtain")
    page = (REPOSITORY / "docs" / "robotics.md").read_text()
    blocks = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    assert len(blocks) == 1
    for block in blocks:
        done = subprocess.run(
            [sys.executable, "-c", block], capture_output=True, text=True, timeout=DEADLINE
        )
        assert done.returncode == 0, done.stderr
        assert float(done.stdout.replace("]", " ").split()[-1]) > 0.29, "it arrived"


def test_the_python_of_the_first_steps_reads_the_node_and_the_recording(
    start_node: StartNode, tmp_path: Path
) -> None:
    """The lines `python3 -c '...'`, beside the node and the recording of the page."""
    start_node("drape")
    with catenary.Simulation("drape", record=str(tmp_path / "run.mcap")) as simulation:
        simulation.step(24)
    page = (REPOSITORY / "docs" / "first-steps.md").read_text()
    programs = re.findall(r"^python3 -c '([^']*)'", page, re.MULTILINE)
    outputs = [
        subprocess.run(
            [sys.executable, "-c", program],
            cwd=tmp_path,
            capture_output=True,
            check=True,
            text=True,
            timeout=DEADLINE,
        ).stdout
        for program in programs
    ]
    assert len(outputs) == 2
    assert len(outputs[0].strip(" []\n").split()) == 3, "the mean of x, y and z"
    assert outputs[1].endswith(", 1176, 3)\n")


def test_a_tray_carries_its_cloth(start_node: StartNode) -> None:
    start_node(str(PROGRAMS / "carry" / "tray.toml"), "--as-fast-as-possible")
    (distance,) = re.findall(r"is ([\d.]+) m ", run(PROGRAMS / "carry" / "carry.py"))
    assert float(distance) < 0.1, "the tray has moved by a metre"


def test_the_stretch_of_a_rope_falls_with_iterations_and_the_square_of_substeps() -> None:
    rows = re.findall(r"(\d+) +(\d+) +([\d.]+) %", run(PROGRAMS / "lesson" / "rope.py"))
    stretch = {(int(substeps), int(passes)): float(number) for substeps, passes, number in rows}
    assert stretch[1, 4] / stretch[1, 16] == pytest.approx(4, rel=0.05)
    assert stretch[4, 1] / stretch[16, 1] == pytest.approx(16, rel=0.05)


@pytest.mark.parametrize("name", ["euler", "iterations", "stiffness", "f32", "dissipation"])
def test_each_lesson_is_drawn(name: str, tmp_path: Path) -> None:
    lesson = [str(conftest.PROGRAMS / "sim-node"), "lesson", name, "--json"]
    tables = subprocess.run(lesson, capture_output=True, check=True, timeout=DEADLINE).stdout
    picture = tmp_path / "lesson.png"
    draw = [sys.executable, str(PROGRAMS / "lesson" / "plot.py"), str(picture)]
    subprocess.run(draw, input=tables, check=True, timeout=DEADLINE)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_the_notebook_runs() -> None:
    notebook = nbformat.read(EXAMPLES / "free_fall.ipynb", as_version=4)  # type: ignore[no-untyped-call]
    NotebookClient(notebook, timeout=60, kernel_name="python3").execute()
    outputs = [out for cell in notebook.cells for out in cell.get("outputs", [])]
    difference, against = (out["data"]["text/plain"] for out in outputs[-2:])
    assert float(re.findall(r"([\d.e-]+) m", difference)[0]) < 1e-4
    found, predicted = re.findall(r"(-?[\d.]+) m", against)
    assert found == predicted


class Interrupted(Exception):
    """Ends the loop of the example."""


def test_the_ros_2_example_publishes_the_particles(
    start_node: StartNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Runs it with stand-ins for the parts of rclpy that it uses, which pip cannot install."""
    node = start_node("curtain", "--paused")
    clouds: list[Any] = []

    class Message:
        def __init__(self, **fields: Any) -> None:
            self.header = types.SimpleNamespace()
            self.__dict__.update(fields)

    class RosNode:
        def __init__(self, name: str) -> None: ...

        def create_publisher(self, kind: type, topic: str, depth: int) -> Any:
            return types.SimpleNamespace(publish=clouds.append)

        def create_timer(self, period: float, callback: Any) -> None:
            self.callback = callback

        def get_clock(self) -> Any:
            return types.SimpleNamespace(now=lambda: types.SimpleNamespace(to_msg=lambda: 0))

    def spin(ros_node: RosNode) -> None:
        ros_node.callback()
        raise Interrupted

    modules: dict[str, dict[str, Any]] = {
        "rclpy": {"init": lambda: None, "spin": spin},
        "rclpy.node": {"Node": RosNode},
        "sensor_msgs": {},
        "sensor_msgs.msg": {"PointCloud2": Message, "PointField": Message},
    }
    for name, members in modules.items():
        module = types.ModuleType(name)
        module.__dict__.update(members)
        monkeypatch.setitem(sys.modules, name, module)
    code = compile((EXAMPLES / "to_ros2.py").read_text(), "to_ros2.py", "exec")
    with pytest.raises(Interrupted):
        exec(code, {"__name__": "__main__"})
    (cloud,) = clouds
    names = [field.name for field in cloud.fields]
    types_ = {7: "<f4", 6: "<u4"}
    dtype = np.dtype([(field.name, types_[field.datatype]) for field in cloud.fields])
    assert dtype.itemsize == cloud.point_step == 32 and len(names) == 8
    assert [field.offset for field in cloud.fields] == [dtype.fields[name][1] for name in names]  # type: ignore[index]
    points = np.frombuffer(cloud.data, dtype)
    snapshot = node.latest()
    assert np.array_equal(np.stack([points["x"], points["y"], points["z"]], 1), snapshot.positions)
    assert np.array_equal(points["flags"], snapshot.flags)
    assert cloud.width == len(snapshot) and cloud.row_step == len(cloud.data)
