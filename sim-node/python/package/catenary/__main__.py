"""`python -m catenary` says what to do next."""

from catenary import __version__

if __name__ == "__main__":
    print(
        f"""Catenary {__version__} is installed. Start a node and its page, each in a terminal:

    sim-node                 simulates the scene drape until Ctrl-C
    viewer-bridge            shows it at http://127.0.0.1:8080/

Then read the state in Python, or simulate without a node:

    python -c 'import catenary; print(catenary.attach().latest().positions)'
    python -c 'import catenary; simulation = catenary.Simulation("curtain"); simulation.step(240); print(simulation.hash_hex)'

`sim-node --help`, `recorder --help` and `help(catenary)` list the rest."""
    )
