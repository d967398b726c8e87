"""A process of the pool: `python -m autograder.pool_process` executes jobs from its standard input."""

from __future__ import annotations

import os
import sys
import threading

from .pool import load, serve

if __name__ == "__main__":
    sink = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever a test prints past its recorder must not stand among the results
    # What executes is imported while the first job's sandbox starts, which takes as long.
    threading.Thread(target=load, daemon=True).start()
    serve(sys.stdin.buffer, sink)
