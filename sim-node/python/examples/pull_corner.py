"""Pulls a corner of the curtain for a second and plots its height. Run it beside `sim-node run curtain`."""

import sys

import catenary
import matplotlib.pyplot as plt

CORNER = 154  # the lowest particle on the left
node = catenary.attach(timeout=5)
x, y, z = node.latest().positions[CORNER].tolist()
grab = node.grab(CORNER, (x, y + 0.3, z + 0.4), over=0.25)
times, heights = [], []
for snapshot in node.snapshots():
    times.append(snapshot.time)
    heights.append(snapshot.positions[CORNER, 1])
    if snapshot.step == grab.step + 240:
        node.release(CORNER)
    if snapshot.step >= grab.step + 720:
        break
plt.plot(times, heights)
plt.xlabel("time (s)")
plt.ylabel("height of the corner (m)")
plt.savefig(sys.argv[1] if len(sys.argv) > 1 else "corner.png")
