"""Run the benchmarks named on the command line, or all."""

import sys

from benchmarks.harness import main

sys.exit(main(sys.argv[1:]))
