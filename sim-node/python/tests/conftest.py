"""Nodes and recordings for the tests. Each test has a domain of its own, and ends its own processes."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path

import catenary
import pytest

REPOSITORY = Path(__file__).resolve().parents[3]
PROGRAMS = Path(os.environ.get("CATENARY_PROGRAMS", REPOSITORY / "target" / "debug"))
DEADLINE = 60.0
NUMBERS = count()

StartNode = Callable[..., "catenary.Node"]
Interrupt = Callable[..., str]
SCRIPT = """
import catenary
{setup}
print("ready", flush=True)
input()
try:
    print("waiting", flush=True)
    {call}
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Name of a domain, which is also that of programs and examples that the test starts."""
    name = f"py-{os.getpid()}-{next(NUMBERS)}"
    monkeypatch.setenv("CATENARY_DOMAIN", name)
    yield name
    for file in Path("/dev/shm").glob(f"{name}_*"):
        file.unlink(missing_ok=True)
    shutil.rmtree(f"/tmp/catenary-{os.getuid()}-{name}", ignore_errors=True)


@pytest.fixture
def processes(domain: str) -> Iterator[list[subprocess.Popen[str]]]:
    """Processes that the test starts. They end with it."""
    running: list[subprocess.Popen[str]] = []
    yield running
    for process in reversed(running):
        if process.poll() is None:
            process.send_signal(signal.SIGCONT)
            process.send_signal(signal.SIGINT)
        process.communicate(timeout=DEADLINE)


@pytest.fixture
def start(processes: list[subprocess.Popen[str]]) -> Callable[..., subprocess.Popen[str]]:
    """Starts a program, such as `start("sim-node", "run", "curtain")`."""

    def start(program: str, *arguments: str) -> subprocess.Popen[str]:
        command = [str(PROGRAMS / program), *arguments]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        processes.append(process)
        return process

    return start


@pytest.fixture
def start_node(start: Callable[..., subprocess.Popen[str]]) -> Iterator[StartNode]:
    """Starts a node and attaches to it, such as `start_node("curtain", "--paused")`."""
    nodes: list[catenary.Node] = []

    def start_node(*arguments: str, name: str = "sim", forces: bool = False) -> catenary.Node:
        start("sim-node", "run", *arguments, "--name", name)
        nodes.append(catenary.attach(name, timeout=DEADLINE, forces=forces))
        return nodes[-1]

    yield start_node
    for node in nodes:
        node.close()


@pytest.fixture
def simulate(tmp_path: Path) -> Callable[..., Path]:
    """Makes a recording of a scene, such as `simulate("curtain", "--steps", "600")`."""

    def simulate(*arguments: str) -> Path:
        path = tmp_path / "run.mcap"
        command = [str(PROGRAMS / "recorder"), "simulate", *arguments, "-o", str(path)]
        subprocess.run(command, check=True, capture_output=True, timeout=DEADLINE)
        return path

    return simulate


@pytest.fixture
def interrupt(domain: str) -> Interrupt:
    """Sends Ctrl-C to a program in the middle of a call. Returns what it prints then.

    `prepare` is called between the lines of `setup` and the call.
    """

    def interrupt(call: str, setup: str = "", prepare: Callable[[], object] = lambda: None) -> str:
        code = SCRIPT.format(setup=setup, call=call)
        with subprocess.Popen(
            [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as child:
            assert child.stdin is not None and child.stdout is not None
            assert child.stdout.readline() == "ready\n"
            prepare()
            child.stdin.write("\n")
            child.stdin.flush()
            assert child.stdout.readline() == "waiting\n"
            child.send_signal(signal.SIGINT)
            try:
                return child.communicate(timeout=DEADLINE)[0]
            finally:
                child.kill()

    return interrupt
