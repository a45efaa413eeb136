"""Displacement below the surface, against the surface's closed forms and Navier's equations."""

import numpy as np
import pytest

from slipcore import InvalidInput
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.elasticity.interior import Interior, wave_response
from slipcore.contact.reference.bonded_layer import BondedLayer, half_space_modes

K = np.array([10.0, 300.0, 2e3])
YOUNG, H = 1e6, 3e-3


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("thickness", [H, np.inf])
def test_at_the_surface_waves_are_those_of_the_closed_form(nu: float, thickness: float) -> None:
    layer = BondedLayer(H, YOUNG, nu)
    modes = layer.modes(K) if np.isfinite(thickness) else half_space_modes(K, layer.surface)
    found = wave_response(K * thickness, 0.0 * K, nu)
    scale = layer.surface.shear / K
    for value, expected in (
        (found.normal, modes.normal),
        (found.longitudinal, modes.longitudinal),
        (found.transverse, modes.transverse),
        (-found.spread, modes.coupling),
        (-found.lift, modes.coupling),
    ):
        np.testing.assert_allclose(scale * value, expected, rtol=1e-9, atol=1e-12 * scale.max())


def test_at_the_base_nothing_moves() -> None:
    for part in wave_response(K * H, K * H, 0.4):
        np.testing.assert_allclose(part, 0.0, atol=1e-15)


def test_far_above_its_base_a_layer_is_a_half_space_at_depth() -> None:
    x, y = np.array([0.3e-3, 1e-3]), np.array([0.2e-3, -2e-3])
    thick, free = (Interior(YOUNG, 0.4, h, 0.7e-3).responses(x, y) for h in (0.5, np.inf))
    for component, value in free.items():
        np.testing.assert_allclose(thick[component], value, rtol=0.02)


def test_a_volume_that_cannot_change_does_not() -> None:
    body, step, at = Interior, 1e-6, (0.8e-3, 0.5e-3)
    depth = 0.9e-3

    def moved(component: str, dx: float = 0.0, dy: float = 0.0, dz: float = 0.0) -> float:
        place = np.array([at[0] + dx]), np.array([at[1] + dy])
        responses = body(YOUNG, 0.5, H, depth + dz).responses(*place)
        return float(responses[component][0])  # type: ignore[literal-required]

    gradient = [
        (moved("xz", dx=step) - moved("xz", dx=-step)),
        (moved("yz", dy=step) - moved("yz", dy=-step)),
        (moved("nn", dz=step) - moved("nn", dz=-step)),
    ]
    assert abs(sum(gradient)) < 1e-5 * max(map(abs, gradient))


def test_deep_below_a_cell_only_its_force_counts() -> None:
    grid = Grid((30, 30), (1e-4, 1e-4))
    body = Interior(YOUNG, 0.3, np.inf, 2e-3)
    far = body.influences(grid)["nn"][20, 10] / grid.cell_area
    np.testing.assert_allclose(far, body.responses(np.array([1e-3]), np.array([2e-3]))["nn"][0], rtol=1e-3)
    surface = HalfSpace.from_young(YOUNG, 0.3).influence("nn", grid)
    shallow = Interior(YOUNG, 0.3, np.inf, 5e-6).influences(grid)["nn"]
    assert surface is not None
    np.testing.assert_allclose(shallow, surface, rtol=0.03)


@pytest.mark.parametrize("depth", [0.0, H, -1.0])
def test_a_depth_outside_the_body_is_refused(depth: float) -> None:
    with pytest.raises(InvalidInput, match="depth below the surface"):
        Interior(YOUNG, 0.3, H, depth)


@pytest.mark.parametrize(("modulus", "ratio", "name"), [(0.0, 0.3, "young_modulus"), (YOUNG, 0.51, "poisson_ratio")])
def test_a_body_that_cannot_be_is_refused(modulus: float, ratio: float, name: str) -> None:
    with pytest.raises(InvalidInput, match=name):
        Interior(modulus, ratio, H, 0.5 * H)
