"""A scene of an independent solver, seen by a sensor that measures no forces."""

from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from slipcore import GraspLog
from slipcore.forces.operator import response

SCENES = Path(__file__).parents[2] / "data" / "contact"
Pressed = Callable[..., GraspLog]
GELS = 16
"""Whose tables are kept, of up to 7 MB each; a service keeps two."""


@pytest.fixture(scope="session", autouse=True)
def gels_tabulated_once() -> Iterator[None]:
    """Tests of many gels and lattices by turns would tabulate each several times."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(response, "_splines", lru_cache(maxsize=GELS)(response._splines.__wrapped__))
        yield


@pytest.fixture(scope="session")
def pressed() -> Pressed:
    """A sphere pressed with up to 10 N and sheared on a bonded layer of 5 mm (see the scenes' README), and its forces.

    Of it: some ``frames`` (0 to 7), with ``noise`` m, the ``axes`` that are seen, and a ``crop`` of the lattice.
    """
    outward = np.array([1.0, 1.0, -1.0])
    with np.load(SCENES / "cond1_layer5c_forces.npz") as forces:
        force = forces["f"].transpose(0, 2, 1, 3) * outward
    with np.load(SCENES / "cond1_layer5c.npz") as scene:
        moved = 1e-3 * scene["u"].transpose(0, 2, 1, 3) * outward
        x, y = np.meshgrid(1e-3 * scene["x"], 1e-3 * scene["y"], indexing="ij")
    position = np.stack((x, y, np.zeros_like(x)), axis=-1)

    def make(frames: list[int], noise: float = 0.0, axes: int = 3, crop: slice = slice(None)) -> GraspLog:
        seen = moved[frames][:, crop, crop] + noise * np.random.default_rng(4).standard_normal(
            (len(frames), *position[crop, crop].shape)
        )
        seen[..., axes:] = 0.0
        return GraspLog(
            time=0.1 * np.arange(len(frames)),
            position=position[crop, crop],
            displacement=seen,
            element_area=0.75e-3**2,
            force=force[frames][:, crop, crop],
        )

    return make
