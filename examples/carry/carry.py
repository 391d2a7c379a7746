"""Carries a cloth on a tray, in lockstep: run it beside `sim-node run ./examples/carry/tray.toml`."""

import math

import catenary

SECONDS = 6.0  # for half a circle

node = catenary.attach(timeout=5)
rate = node.topology().rate
settled = rate  # steps in which the cloth comes to rest
with node.lockstep() as steps:
    for count, snapshot in enumerate(steps):
        if count == settled + SECONDS * rate:
            break
        t = max(0.0, (count - settled) / rate)
        angle = math.pi * (1 - math.cos(math.pi * t / SECONDS)) / 2  # begins and ends at rest
        tray = (0.5 * math.sin(angle), 0.2 * (1 - math.cos(angle)), 0.5 * (1 - math.cos(angle)))
        steps.move_collider(0, tray)
center = snapshot.positions.mean(axis=0)
print(f"the middle of the cloth is {math.dist(center, tray):.3f} m from that of the tray")
