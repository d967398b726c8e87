"""What a release says that the gradebook does not keep: in which order its cells stand, and those without a name."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path


@dataclass(frozen=True)
class Layout:
    """What the gradebook does not keep of a release.

    Attributes
    ----------
    order : tuple of str
        Grade ids as they follow each other; empty where that is not known.
    plain : tuple of str
        The code cells that nbgrader does not keep track of.
    """

    order: tuple[str, ...] = ()
    plain: tuple[str, ...] = ()


def read_layout(path: Path, recorded: Iterable[str] = ()) -> Layout:
    """Return what a released file says; where it is gone, what was recorded when it was made.

    Parameters
    ----------
    path : pathlib.Path
        The released file.
    recorded : sequence of str, optional
        Grade ids in their order, as they are on record.

    Returns
    -------
    Layout
        Empty where nothing is known.
    """
    if not path.is_file():
        return Layout(tuple(recorded))
    cells = json.loads(path.read_text(encoding="utf-8")).get("cells", [])
    ids = [cell.get("metadata", {}).get("nbgrader", {}).get("grade_id") for cell in cells]
    plain = [
        "".join(c["source"])
        for c, name in zip(cells, ids, strict=True)
        if not name and c["cell_type"] == "code"
    ]
    return Layout(tuple(filter(None, ids)), tuple(plain))
