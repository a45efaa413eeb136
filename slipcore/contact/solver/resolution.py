"""Whether a grid is fine and wide enough for a contact and its slip zone."""

from collections import Counter
from collections.abc import Iterable

import numpy as np

from slipcore.contact.defaults import STEP
from slipcore.frames import BoolArray


def unresolved(contact: BoolArray, at_limit: BoolArray, sheared: bool) -> tuple[str, ...]:
    """One sentence for each thing that the grid does not resolve; none without contact.

    ``contact``, ``at_limit`` [ny, nx]: cells that touch and, of them, those at the Coulomb limit; ``sheared``: whether
    there is any traction.
    """
    touching, slipping = int(contact.sum()), int(at_limit.sum())
    if not touching:
        return ()
    found = []
    if contact[[0, -1]].any() or contact[:, [0, -1]].any():
        found.append("the contact reaches the edge of the grid, beyond which there is none")
    radius = float(np.sqrt(touching / np.pi))
    if radius < STEP.contact_cells:
        found.append(f"the contact's radius spans {radius:.1f} cells, {STEP.contact_cells:g} or more are needed")
    width = slipping / _rim(contact)
    if sheared and width < STEP.slip_cells:
        found.append(f"the slip zone spans {width:.1f} cells, {STEP.slip_cells:g} or more are needed")
    return tuple(found)


def summary(steps: Iterable[tuple[str, ...]]) -> str:
    """What ``unresolved`` found, and in how many of the steps; "nothing" where that is all."""
    found = [[sentence.partition(" spans ")[0] for sentence in step] for step in steps]
    counts = Counter(kind for step in found for kind in step)
    return "; ".join(f"{kind}, in {count} of {len(found)} steps" for kind, count in counts.items()) or "nothing"


def _rim(contact: BoolArray) -> int:
    """Cells of the contact that have a neighbour outside it."""
    inside = np.pad(contact, 1)
    inner = inside[:-2, 1:-1] & inside[2:, 1:-1] & inside[1:-1, :-2] & inside[1:-1, 2:]
    return int((contact & ~inner).sum())
