import pytest

from roboloc.filters import Ekf
from roboloc.filters.shell import MissingStageError, Shell


def unwritten(*_arguments):
    """Stand for a released cell."""
    raise NotImplementedError


@pytest.mark.parametrize("stage", [unwritten, lambda *_: None])
def test_an_unwritten_stage_names_its_notebook(stage):
    """A student whose filter stops is told where the missing function is written."""
    with pytest.raises(MissingStageError, match="in the notebook motion-model"):
        Ekf([0], [[1]], [[1, 0], [0, 1]], stages={"compute_dynamics": stage}).transition_model([1, 0], 0.1)


def test_a_stage_of_no_notebook_is_only_missing():
    """A name that no notebook writes gets no pointer."""
    with pytest.raises(MissingStageError, match=r"not written yet$"):
        Shell({"odd": unwritten})._call("odd", {"g": (1,)})
