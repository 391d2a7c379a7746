"""Hangs a curtain of several compliances, one process each, and prints how far it sags."""

from concurrent.futures import ProcessPoolExecutor

import catenary


def lowest(compliance: float) -> float:
    simulation = catenary.Simulation("curtain")
    simulation.set(compliance=compliance)
    simulation.step(5 * simulation.rate)
    return float(simulation.positions[:, 1].min())


if __name__ == "__main__":
    compliances = [0.0, 1e-4, 1e-3, 1e-2, 1e-1]
    with ProcessPoolExecutor() as pool:
        for compliance, y in zip(compliances, pool.map(lowest, compliances)):
            print(f"compliance {compliance:.4f} m/N: the lowest particle hangs at y = {y:.4f} m")
