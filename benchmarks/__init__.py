"""Every speed or accuracy claim, as a ratio against a named baseline measured in the same run.

``python -m benchmarks`` runs all modules of this folder; ``python -m benchmarks motion`` runs one. To add a
benchmark, add a module with a tuple ``BENCHMARKS`` of functions that take no arguments and return a
:class:`benchmarks.harness.Result`. Results go to ``benchmarks/results.json``, which git ignores.

Rules: a baseline does the same work and is written as a competent user would write it; outputs are asserted
equal before anything is timed; variants are interleaved and the minimum of several rounds counts.
"""
