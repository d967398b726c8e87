"""What all shells share: finding a stage, calling it, and checking what it returns."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from roboloc.validation import as_array


class MissingStageError(NotImplementedError):
    """A stage was not supplied, or is not written yet."""


class Shell:
    """Hold what supplies the stages.

    Parameters
    ----------
    stages : mapping or object, optional
        A mapping from names to functions, or anything with attributes so named.
    """

    notebooks: Mapping[str, str] = MappingProxyType({})
    """The notebook in which each stage is written, where there is one."""

    def __init__(self, stages: Any = None) -> None:
        self._stages = stages

    def _call(self, name: str, results: dict[str, tuple], *arguments: Any) -> tuple[np.ndarray, ...]:
        """Call a stage and return its results as arrays that nobody else holds.

        A letter in the shapes of `results` stands for any size, the same wherever it stands in this call.
        """
        given = self._stages
        stage = given.get(name) if isinstance(given, Mapping) else getattr(given, name, None)
        if stage is None:
            raise MissingStageError(f"stage {name}: not supplied")
        try:
            values = stage(*arguments)
        except NotImplementedError as error:
            raise MissingStageError(f"stage {name}: not written yet{self._where(name)}") from error
        if values is None:
            raise MissingStageError(
                f"stage {name}: returns None: not written yet, or without return{self._where(name)}"
            )
        if len(results) == 1:
            values = (values,)
        if not isinstance(values, tuple | list) or len(values) != len(results):
            got = f"{len(values)} values" if isinstance(values, tuple | list) else type(values).__name__
            raise ValueError(f"stage {name}: expected {', '.join(results)}, got {got}")
        sizes: dict[str, int] = {}
        found = []
        for (key, letters), value in zip(results.items(), values, strict=True):
            shape = tuple(sizes.get(letter, letter) for letter in letters)
            array = as_array(f"stage {name}: {key}", _filled(value, shape), shape).copy()
            sizes |= {e: size for e, size in zip(letters, array.shape, strict=True) if isinstance(e, str)}
            found.append(array)
        return tuple(found)

    def _where(self, name: str) -> str:
        """Say in which notebook a stage is written, where that is known."""
        known = name in self.notebooks
        return f" (it is written in the notebook {self.notebooks[name]})" if known else ""


def _filled(value: Any, shape: tuple) -> Any:
    """Return an empty list, of which NumPy cannot tell the shape, as the array of no entries that it means."""
    if isinstance(value, tuple | list) and not len(value) and shape and shape[0] in {0, "K"}:
        return np.zeros(tuple(0 if isinstance(size, str) else size for size in shape))
    return value
