"""Height maps, as those of GelSight and DIGIT: by how much the elements under them moved along the normal.

A map is an image of the surface from behind: x along its columns, y along its rows, both from its middle, z away from
the camera. By how much a pixel rose since rest is averaged over each element's rectangle, where it was seen.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.formats import rest as rests
from service.formats.members import Members
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray

LEAST_SEEN = 0.5
"""Share of an element's area whose height is known, at rest and in a frame, under which it is not observed there."""

ROUNDING = 1e-9
"""Of a share: of markers on the edge of a map all are observed, or none."""

LARGEST_RISE = 0.1
"""m, of a pixel; more is no height of a gel, and of what stands beside it in a sum too little is left."""


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

    def corners(self, pixels: tuple[int, int], pixel: float) -> FloatArray:
        """Rows and columns of their corners on a map, in pixels from its edge and none beyond, [2, 4, n · m].

        First the one of least row and column, then the others around.
        """
        x, y = np.moveaxis(self.position[..., :2].reshape(-1, 2), -1, 0) / pixel
        wide, high = (0.5 * side / pixel for side in self.sides)
        rows = np.stack([y - high, y - high, y + high, y + high]) + 0.5 * pixels[0]
        columns = np.stack([x - wide, x + wide, x + wide, x - wide]) + 0.5 * pixels[1]
        return np.stack([np.clip(rows, 0, pixels[0]), np.clip(columns, 0, pixels[1])])


def maps_of(height: NDArray[np.floating], pixels: tuple[int, int] | None) -> NDArray[np.floating]:
    """Maps [t, rows, columns] m, NaN where nothing is seen, of ones that may be flat; raises ``InvalidInput``."""
    if height.ndim == 2 and pixels is not None and height.shape[1] == pixels[0] * pixels[1]:
        height = height.reshape(len(height), *pixels)
    if height.ndim != 3 or not height.size or pixels not in (None, height.shape[1:]):
        wanted = "[frames, rows, columns]" if pixels is None else f"[frames, {pixels[0]}, {pixels[1]}]"
        raise InvalidInput(
            "height", f"of shape {list(height.shape)}", f"{wanted}, or flat with `pixels` in the mapping"
        )
    return height


def frame_at_rest(rest: str | None, height: NDArray[np.floating], members: Members) -> int:
    """The frame that ``rest`` names, the first where it names none; of the least contact that in which the surface
    stands highest, where neither contact nor force is known. Raises ``InvalidInput`` for what is none.
    """
    load = rests.load_of(members)
    if load is None and rest == rests.LEAST_CONTACT:
        always = np.ones(height.shape[1:], dtype=bool)
        for each in height:
            always &= np.isfinite(each)
        if not always.any():
            raise InvalidInput("rest", f"{rest}, with no pixel seen in all frames", rests.ALLOWED)
        load = np.array([-each[always].mean(dtype=np.float64) for each in height])
    return rests.frame_of(rest or rests.FIRST, len(height), load, np.empty(0))


def rise(height: NDArray[np.floating], frame: int, elements: Elements, pixel: float) -> tuple[FloatArray, BoolArray]:
    """Mean rise [t, e] m of elements since a ``frame`` of ``height`` [t, rows, columns] m, and which were seen [t, e].

    A map at a time, by its sums over all that lies before each of their corners. Raises ``InvalidInput`` for numbers
    that are no height of a surface.
    """
    corners = elements.corners((height.shape[1], height.shape[2]), pixel)
    pixels = elements.area / pixel**2
    mean, share = np.empty((2, len(height), corners.shape[-1]))
    for t, each in enumerate(height):
        with np.errstate(invalid="ignore"):  # infinite in both
            risen = each.astype(np.float64) - height[frame]
        known = np.isfinite(risen)
        if (largest := np.max(np.abs(risen), where=known, initial=0.0)) > LARGEST_RISE:
            value = f"{largest:g} m (is it in m?) from that at rest in frame {t}"
            raise InvalidInput("height", value, f"at most {LARGEST_RISE:g} m; NaN where nothing is seen")
        share[t] = _sum_within(corners, known.astype(np.float64)) / pixels
        mean[t] = _sum_within(corners, np.where(known, risen, 0.0)) / pixels
    seen = share >= LEAST_SEEN - ROUNDING
    return np.divide(mean, share, out=np.zeros_like(mean), where=seen), seen


def _sum_within(corners: FloatArray, values: FloatArray) -> FloatArray:
    """Of ``values`` [rows, columns], weighted by how much of each pixel lies within the corners, [e]."""
    from scipy.ndimage import map_coordinates  # few files need it

    before = np.pad(values.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    first, right, opposite, below = map_coordinates(before, corners, order=1)
    return np.asarray(first - right + opposite - below)
