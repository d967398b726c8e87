"""Print the table of four filters on one problem: EKF, UKF, particle filter and right-invariant EKF (ROB530).

Usage: ``python tools/four_filters.py [--runs N] [--seed S]``
"""

from __future__ import annotations

import argparse

import numpy as np

from roboloc_reference.comparison import compare, to_markdown
from roboloc_reference.contenders import four_filters
from roboloc_reference.scenarios import simulate


def main(arguments: list[str] | None = None) -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Print the table of four filters on one problem.")
    parser.add_argument("--runs", type=int, default=20, help="runs that each filter goes through")
    parser.add_argument("--seed", type=int, default=0, help="of the runs and of the particles")
    options = parser.parse_args(arguments)
    rng = np.random.default_rng(options.seed)
    scenarios = [simulate(rng) for _ in range(options.runs)]
    print(to_markdown(compare(scenarios, four_filters(rng))))


if __name__ == "__main__":
    main()
