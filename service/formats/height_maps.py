"""Height maps, as those of GelSight and DIGIT: by how much the elements under them moved along the normal.

A map is an image of the surface from behind: x along its columns, y along its rows, both from its middle, z away from
the camera. By how much a pixel rose since rest is averaged over each element's rectangle, where it was seen.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from service.formats import rest as rests
from service.formats.members import Members
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray

if TYPE_CHECKING:
    from scipy.sparse import csr_array

LEAST_SEEN = 0.5
"""Share of an element's area whose height is known, at rest and in a frame, under which it is not observed there."""


@dataclass(frozen=True, slots=True, eq=False)
class Elements:
    """Centres ``position`` [n, m, 3] m of rectangles from a map's middle, and their ``sides`` along x and y, m."""

    position: FloatArray
    sides: tuple[float, float]

    @classmethod
    def dividing(cls, pixels: tuple[int, int], pixel: float, grid: tuple[int, int]) -> "Elements":
        """All of a map of rows and columns of ``pixels``, a ``pixel`` m wide, in as many parts as the grid says."""
        height, width = (pixel * count / parts for count, parts in zip(pixels, grid, strict=True))
        y, x = (side * (np.arange(n) - 0.5 * (n - 1)) for side, n in zip((height, width), grid, strict=True))
        return cls(np.stack(np.broadcast_arrays(x, y[:, None], 0.0), axis=-1), (width, height))

    @property
    def area(self) -> float:
        """Of each, m²."""
        return self.sides[0] * self.sides[1]

    def shares(self, pixels: tuple[int, int], pixel: float) -> "csr_array":
        """Shares of the elements' areas that lie on each pixel, [n · m, rows · columns]."""
        from scipy.sparse import csr_array  # few files need it

        values, columns, ends = [np.empty(0)], [np.empty(0, dtype=np.int64)], [0]
        for x, y in self.position[..., :2].reshape(-1, 2):
            row, column = _shares(y, self.sides[1], pixels[0], pixel), _shares(x, self.sides[0], pixels[1], pixel)
            i, j = np.flatnonzero(row), np.flatnonzero(column)
            values.append(np.outer(row[i], column[j]).ravel())
            columns.append((i[:, None] * pixels[1] + j).ravel())
            ends.append(ends[-1] + len(i) * len(j))
        shape = (len(ends) - 1, pixels[0] * pixels[1])
        return csr_array((np.concatenate(values), np.concatenate(columns), ends), shape=shape)


def _shares(middle: float, side: float, count: int, pixel: float) -> FloatArray:
    """Of the interval about ``middle`` m, the share that lies on each of so many pixels, [count]."""
    edge = pixel * (np.arange(count + 1) - 0.5 * count)
    return np.asarray(np.diff(np.clip(edge, middle - 0.5 * side, middle + 0.5 * side)) / side)


def maps_of(height: NDArray[np.floating], pixels: tuple[int, int] | None) -> FloatArray:
    """Maps [t, rows, columns] m, NaN where nothing is seen, of ones that may be flat; raises ``InvalidInput``."""
    if height.ndim == 2 and pixels is not None and height.shape[1] == pixels[0] * pixels[1]:
        height = height.reshape(len(height), *pixels)
    if height.ndim != 3 or not height.size or pixels not in (None, height.shape[1:]):
        wanted = "[frames, rows, columns]" if pixels is None else f"[frames, {pixels[0]}, {pixels[1]}]"
        raise InvalidInput(
            "height", f"of shape {list(height.shape)}", f"{wanted}, or flat with `pixels` in the mapping"
        )
    return np.where(np.isfinite(height), height, np.nan)


def frame_at_rest(rest: str | None, height: FloatArray, members: Members) -> int:
    """The frame that ``rest`` names, the first where it names none; of the least contact that in which the surface
    stands highest, where neither contact nor force is known. Raises ``InvalidInput`` for what is none.
    """
    load = rests.load_of(members)
    if load is None and rest == rests.LEAST_CONTACT:
        always = np.isfinite(height).all(axis=0)
        if not always.any():
            raise InvalidInput("rest", f"{rest}, with no pixel seen in all frames", rests.ALLOWED)
        load = -height[:, always].mean(axis=1)
    return rests.frame_of(rest or rests.FIRST, len(height), load, np.empty(0))


def rise(height: FloatArray, zero: FloatArray, shares: "csr_array") -> tuple[FloatArray, BoolArray]:
    """Mean rise [t, e] m of elements since the map ``zero`` [rows, columns] m, and which were seen [t, e]."""
    risen = (height - zero).reshape(len(height), -1)
    known = np.isfinite(risen)
    area = (shares @ known.T.astype(np.float64)).T
    total = (shares @ np.where(known, risen, 0.0).T).T
    seen = area >= LEAST_SEEN
    return np.divide(total, area, out=np.zeros_like(total), where=seen), seen
