"""What all benchmarks share: the result, the timer, the report."""

import argparse
import gc
import importlib
import json
import pkgutil
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from math import log
from pathlib import Path
from statistics import linear_regression

FOLDER = Path(__file__).parent
RESULTS = FOLDER / "results.json"


@dataclass(frozen=True)
class Result:
    """One claim.

    Parameters
    ----------
    name : str
        What is claimed.
    ratio : float
        Measured: the baseline's time, or error, over ours; larger is better.
    target : float
        The least ratio that keeps the claim.
    baseline : str
        What we are compared with.
    """

    name: str
    ratio: float
    target: float
    baseline: str

    @property
    def kept(self) -> bool:
        """Whether the claim holds in this run."""
        return self.ratio >= self.target


def best_times(variants: Sequence[Callable[[], object]], rounds: int = 30) -> list[float]:
    """Return the shortest time [s] of each variant, the variants taking turns.

    Parameters
    ----------
    variants : sequence of callable
        Each does the same work once. One untimed round warms them up.
    rounds : int
        How often each is timed.
    """
    for variant in variants:
        variant()
    best = [float("inf")] * len(variants)
    collecting = gc.isenabled()
    gc.disable()
    try:
        for _ in range(rounds):
            for i, variant in enumerate(variants):
                start = time.perf_counter()
                variant()
                best[i] = min(best[i], time.perf_counter() - start)
    finally:
        if collecting:
            gc.enable()
    return best


def fitted_exponent(sizes: Sequence[float], times: Sequence[float]) -> float:
    """Return the p for which times grow as sizes**p: the slope of the line of least squares on logarithmic axes.

    Parameters
    ----------
    sizes : sequence of float
        Two different sizes at least, positive.
    times : sequence of float
        The time of each size, positive.
    """
    x, y = ([log(value) for value in values] for values in (sizes, times))
    return linear_regression(x, y).slope


def modules() -> list[str]:
    """Return the names of the modules of this folder that hold benchmarks."""
    return sorted({module.name for module in pkgutil.iter_modules([str(FOLDER)])} - {"__main__", "harness"})


def save(results: list[Result], path: Path = RESULTS) -> None:
    """Write the results as one JSON list; results of other names that are there already stay."""
    names = {result.name for result in results}
    old = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    kept = [entry for entry in old if entry["name"] not in names]
    entries = sorted(kept + [asdict(result) for result in results], key=lambda entry: entry["name"])
    path.write_text(json.dumps(entries, indent=2) + "\n", encoding="utf-8")


def main(arguments: Sequence[str]) -> int:
    """Run the named modules, print and save their results; return 1 if a ratio misses its target."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Measure every speed claim.")
    parser.add_argument("names", nargs="*", help=f"which to run, of: {', '.join(modules())} (default: all)")
    names = parser.parse_args(arguments).names
    unknown = sorted(set(names) - set(modules()))
    if unknown:
        parser.error(f"no benchmark {', '.join(unknown)}; there are: {', '.join(modules())}")
    results = []
    for name in names or modules():
        for benchmark in importlib.import_module(f"benchmarks.{name}").BENCHMARKS:
            result = benchmark()
            results.append(result)
            verdict = "kept" if result.kept else "MISSED"
            print(f"{verdict:6}  {result.ratio:10.3g}  (target {result.target:g})  {result.name}", flush=True)
            print(f"        against {result.baseline}", flush=True)
    save(results)
    return 0 if all(result.kept for result in results) else 1
