"""Why does a rigid rope stretch? Substeps against iterations, at the same work per step."""

import catenary

ROPE = """
version = 1
[solver]
rate_hz = 60
substeps = {substeps}
iterations = {iterations}
damping = 2.0
[[generate]]
shape = "rope"
from = [0, 0, 0]
to = [0, -2, 0]
count = 41
pinned = "first"
"""

print("substeps  iterations  stretch")
for substeps, iterations in ((1, 1), (1, 4), (1, 16), (1, 64), (4, 1), (16, 1), (64, 1)):
    rope = catenary.Simulation(toml=ROPE.format(substeps=substeps, iterations=iterations))
    rope.step(30 * rope.rate)  # half a minute: it hangs at rest
    length = -rope.positions[:, 1].min()
    print(f"{substeps:8}  {iterations:10}  {100 * (length / 2 - 1):6.2f} %")
