"""The ways in which a sandbox starts that its tests try."""

import pytest

STARTS = ("as it is", "user")
"""As it starts here, and as it starts for a grader who is not root."""

UNFILTERED_TOO = pytest.mark.parametrize("either", [*STARTS, "without the filter"], indirect=True)
"""A test of one defence that must hold without the filter of system calls, too."""
