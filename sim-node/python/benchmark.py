"""Measures the module beside nodes that it starts: `python benchmark.py [FOLDER OF THE PROGRAMS]`."""

from __future__ import annotations

import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import catenary

REPOSITORY = Path(__file__).resolve().parents[2]
PROGRAMS = Path(sys.argv[1]) if len(sys.argv) > 1 else REPOSITORY / "target" / "release"
CLOTH = """
version = 1
[solver]
rate_hz = 60
[[generate]]
shape = "cloth"
columns = {n}
rows = {n}
spacing = 0.01
"""


@contextmanager
def node(*arguments: str) -> Iterator[catenary.Node]:
    os.environ["CATENARY_DOMAIN"] = f"bench-{os.getpid()}"
    command = [str(PROGRAMS / "sim-node"), "run", *arguments]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        with catenary.attach(timeout=60) as attached:
            yield attached
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()
        for file in Path("/dev/shm").glob(f"bench-{os.getpid()}_*"):
            file.unlink()
        shutil.rmtree(f"/tmp/catenary-{os.getuid()}-bench-{os.getpid()}", ignore_errors=True)


def percentiles(times: list[float]) -> str:
    cuts = statistics.quantiles(times, n=100)
    return f"p50 {cuts[49] * 1e6:.1f} us, p99 {cuts[98] * 1e6:.1f} us"


def read(attached: catenary.Node) -> tuple[float, int, int]:
    """Reads the newest snapshot with four views. Returns the time that it took, the step, and the particles."""
    start = time.perf_counter()
    snapshot = attached.latest()
    arrays = (snapshot.positions, snapshot.velocities, snapshot.inverse_masses, snapshot.flags)
    return time.perf_counter() - start, snapshot.step, len(arrays[0])


def measure_snapshots(attached: catenary.Node, count: int) -> None:
    polled: list[float] = []
    woken: list[float] = []
    _, last, particles = read(attached)
    while len(polled) < count:
        taken, step, _ = read(attached)
        if step != last:
            polled.append(taken)
        last = step
    period = 1 / attached.topology().rate
    for _ in range(count):
        time.sleep(period)  # the caches forget
        woken.append(read(attached)[0])
    print(f"snapshot of {particles} particles with 4 views, polling:  {percentiles(polled)}")
    print(f"snapshot of {particles} particles with 4 views, sleeping: {percentiles(woken)}")


def measure_lockstep(attached: catenary.Node, count: int) -> None:
    with attached.lockstep() as steps:
        next(steps)
        start = time.perf_counter()
        for _ in range(count):
            next(steps)
        rate = count / (time.perf_counter() - start)
    print(f"lockstep on the curtain: {rate:.0f} turns a second")


def measure_steps(count: int) -> None:
    best_many, best_single = float("inf"), float("inf")
    simulation = catenary.Simulation("curtain")
    for _ in range(5):
        start = time.perf_counter()
        simulation.step(count)
        best_many = min(best_many, (time.perf_counter() - start) / count)
        start = time.perf_counter()
        for _ in range(count):
            simulation.step(1)
        best_single = min(best_single, (time.perf_counter() - start) / count)
    many, single = best_many * 1e6, best_single * 1e6
    print(f"step(1) on the curtain: {single:.2f} us; a step of step({count}): {many:.2f} us")


def main() -> None:
    measure_steps(20_000)
    with node("curtain") as attached:
        measure_snapshots(attached, 1000)
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "cloth.toml"
        scene.write_text(CLOTH.format(n=316))
        with node(str(scene)) as attached:
            measure_snapshots(attached, 200)
    with node("curtain", "--as-fast-as-possible") as attached:
        measure_lockstep(attached, 20_000)


if __name__ == "__main__":
    main()
