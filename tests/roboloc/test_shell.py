import pytest

from roboloc.filters.shell import NOTEBOOKS, MissingStageError, Shell


def unwritten(*_arguments):
    """Stand for a released cell."""
    raise NotImplementedError


@pytest.mark.parametrize("stage", [unwritten, lambda: None])
def test_an_unwritten_stage_names_its_notebook(stage):
    """A student whose filter stops is told where the missing function is written."""
    with pytest.raises(MissingStageError, match="in the notebook motion-model"):
        Shell({"compute_dynamics": stage})._call("compute_dynamics", {"g": (3,)})


def test_a_stage_of_no_notebook_is_only_missing():
    """A name that no notebook writes gets no pointer."""
    assert "helper" not in NOTEBOOKS
    with pytest.raises(MissingStageError, match=r"not written yet$"):
        Shell({"helper": unwritten})._call("helper", {})
