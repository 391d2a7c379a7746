"""Measures the module beside nodes that it starts: `python benchmark.py [FOLDER OF THE PROGRAMS]`."""

from __future__ import annotations

import json
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
import numpy as np

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


def views(snapshot: catenary.Snapshot) -> tuple[object, ...]:
    return snapshot.positions, snapshot.velocities, snapshot.inverse_masses, snapshot.flags


def read(attached: catenary.Node) -> tuple[float, int]:
    """Reads the newest snapshot with four views. Returns the time that it took, and the step."""
    start = time.perf_counter()
    snapshot = attached.latest()
    _arrays = views(snapshot)
    return time.perf_counter() - start, snapshot.step


def measure_polling(attached: catenary.Node, count: int) -> list[float]:
    times: list[float] = []
    _, last = read(attached)
    while len(times) < count:
        taken, step = read(attached)
        if step != last:
            times.append(taken)
        last = step
    return times


def measure_sleeping(attached: catenary.Node, count: int) -> tuple[list[float], list[float]]:
    """Reads after a sleep, which leaves the caches to other programs. For comparison, makes four slices of an
    array after the same sleep, as NumPy alone would."""
    period = 1 / attached.topology().rate
    own = np.zeros((len(attached.latest()), 8), np.float32)
    times: list[float] = []
    slices: list[float] = []
    for _ in range(count):
        time.sleep(period)
        times.append(read(attached)[0])
        time.sleep(period)
        start = time.perf_counter()
        _arrays = own[:, 0:3], own[:, 4:7], own[:, 3], own[:, 7]
        slices.append(time.perf_counter() - start)
    return times, slices


def measure_waiting(attached: catenary.Node, count: int) -> tuple[list[float], list[float]]:
    """Waits for each snapshot. Returns the times from its publication to its reception, and to four views."""
    received: list[float] = []
    viewed: list[float] = []
    attached.latest()
    for _ in range(count):
        snapshot = attached.next_snapshot()
        assert snapshot is not None
        received_at = time.monotonic()
        _arrays = views(snapshot)
        viewed_at = time.monotonic()
        received.append(received_at - snapshot.published_at)
        viewed.append(viewed_at - snapshot.published_at)
    return received, viewed


def measure_rust_reader(scene: str) -> str:
    """Measures a reader in Rust that waits for each snapshot, from the publication to its reception."""
    command = [str(PROGRAMS / "sim-node"), "bench", scene, "--readers", "1", "--duration", "500ms", "--json"]
    report = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    latency = next(row["latency"] for row in report["latencies"] if row["wait"] == "event")
    return f"p50 {latency['p50_ns'] / 1000:.1f} us, p99 {latency['p99_ns'] / 1000:.1f} us"


def measure_snapshots(scene: str, count: int) -> None:
    with node(scene) as attached:
        print(f"a snapshot of {len(attached.latest())} particles:")
        print(f"  read with 4 views, polling           {percentiles(measure_polling(attached, count))}")
        sleeping, slices = measure_sleeping(attached, count)
        print(f"  read with 4 views, after a sleep     {percentiles(sleeping)}")
        print(f"  4 slices by NumPy, after a sleep     {percentiles(slices)}")
        received, viewed = measure_waiting(attached, count)
    print(f"  publication to a waiting reader      {percentiles(received)}")
    print(f"  publication to its 4 views           {percentiles(viewed)}")
    print(f"  publication to a reader in Rust      {measure_rust_reader(scene)}")


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
    measure_snapshots("curtain", 1000)
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "cloth.toml"
        scene.write_text(CLOTH.format(n=316))
        measure_snapshots(str(scene), 200)
    with node("curtain", "--as-fast-as-possible") as attached:
        measure_lockstep(attached, 20_000)


if __name__ == "__main__":
    main()
