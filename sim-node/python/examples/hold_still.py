"""Brings a pendulum to rest by moving its pivot. Run it beside `sim-node run pendulum`.

The node waits for this controller at every step, so the result is the same at any speed.
"""

import catenary
import numpy as np

GAIN = 0.25  # displacement of the pivot against the mass, per speed of the mass, in seconds
node = catenary.attach(timeout=5)
rest = node.latest().positions[0].copy()
node.grab(0, rest)
with node.lockstep() as steps:
    for _, snapshot in zip(range(2400), steps):
        velocity = snapshot.velocities[1] * np.array([1, 0, 1], np.float32)
        steps.move(0, rest - GAIN * velocity, over=0.25)
print(f"the mass moves at {np.linalg.norm(snapshot.velocities[1]):.6f} m/s")
