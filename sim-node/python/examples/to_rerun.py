"""Shows a running node in Rerun, or writes a file for it: `to_rerun.py [FILE.rrd [SNAPSHOTS]]`."""

import sys
from itertools import islice

import catenary
import rerun as rr

rr.init("catenary", spawn=len(sys.argv) == 1)
if len(sys.argv) > 1:
    rr.save(sys.argv[1])
count = int(sys.argv[2]) if len(sys.argv) > 2 else None
node = catenary.attach(timeout=5)
ends = node.topology().ends
for snapshot in islice(node.snapshots(), count):
    rr.set_time("step", sequence=snapshot.step)
    rr.set_time("time", duration=snapshot.time)
    rr.log("particles", rr.Points3D(snapshot.positions, radii=0.01))
    rr.log("constraints", rr.LineStrips3D(snapshot.positions[ends]))
