"""Draws the tables of a lesson: sim-node lesson euler --json | python plot.py euler.png"""

import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def numbers(table, name):
    """The numbers of a column; None for a word or an empty cell."""
    cells = [row[name] for row in table["rows"]]
    return [cell if isinstance(cell, (int, float)) else None for cell in cells]


def is_wide(values):
    """True for positive numbers that a linear axis would crowd."""
    known = [value for value in values if value is not None]
    return bool(known) and min(known) > 0 and max(known) > 30 * min(known)


tables = json.load(sys.stdin)
figure, axes = plt.subplots(len(tables), 1, figsize=(9, 5 * len(tables)), squeeze=False, layout="constrained")
for axis, table in zip(axes[:, 0], tables):
    # Rows have the first given number as their place, or else their name.
    given = [column["name"] for column in table["columns"] if column["origin"] == "given"]
    scale = next((name for name in given if None not in numbers(table, name)), None)
    places = numbers(table, scale) if scale else [str(row[given[0]]) for row in table["rows"]]
    every = []
    for column in table["columns"]:
        values = numbers(table, column["name"])
        if column["origin"] != "given" and any(value is not None for value in values):
            style = {"law": "--", "document": ":"}.get(column["origin"], "-")
            axis.plot(places, values, style, marker="o", markersize=4, label=f"{column['name']} ({column['origin']})")
            every += values
    axis.set_title(f"{table['name']}: {table['title']}", wrap=True, fontsize=9)
    axis.set_xlabel(scale or given[0])
    if scale and is_wide(places):
        axis.set_xscale("log")
    if is_wide(every):
        axis.set_yscale("log")
    axis.legend(fontsize=8)
figure.savefig(sys.argv[1], dpi=120)
