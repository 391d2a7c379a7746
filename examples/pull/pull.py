"""A controller at 60 Hz pulls a corner of the curtain until a point beside it is at a height.

Run it beside `sim-node run curtain`. It joins the lockstep at every fourth step of the node's 240 Hz.
"""

import catenary

CORNER, POINT = 154, 157  # the lowest row, left end and three columns from it
HEIGHT = 0.3  # m
GAIN = 3.0  # speed of the corner, per metre of error, in 1/s

node = catenary.attach(timeout=5)
with node.lockstep(every=4) as steps:
    first = next(steps)
    hand = first.positions[CORNER].copy()
    steps.grab(CORNER, hand)
    for snapshot in steps:
        error = HEIGHT - snapshot.positions[POINT, 1]
        hand[1] += GAIN * error / 60
        steps.move(CORNER, hand, over=1 / 60)
        if snapshot.step >= first.step + 10 * 240:
            break
node.release(CORNER)
print(f"the point is {abs(error) * 1000:.1f} mm from its height")
