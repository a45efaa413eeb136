"""What is proposed of a scene, on either side of each limit, reckoned by hand."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from slipcore.contact.effects import FiniteLayer
from slipcore.contact.plan.plan import SamplingPlan
from slipcore.contact.scene import explain as explaining
from slipcore.contact.scene.explain import EffectReport, Measured
from slipcore.contact.tiers.accuracy import Difference


def whole(**changes: Any) -> Measured:
    """With μ = 0.4 and a gel of ν = 0.5, 10 mm thick, pressed by 2 N at the origin of the sensor."""
    row, column = np.mgrid[-1:2, -1:2]
    force = np.zeros((2, 3, 3, 3))
    force[1, 1, 1] = [0.5, 0.0, -2.0]
    own = {"thickness": 1e-2, "friction": 0.4, "poisson_ratio": 0.5, "coupled": False, "laws": (), "present": (),
           "driven": (), "sampling": None, "stick_ratio": [1.0, 0.5], "force": force} | changes  # fmt: skip
    plan = SimpleNamespace(
        problem=SimpleNamespace(coupled=own["coupled"], spread=(), velocity_laws=own["laws"]),
        poisson_ratio=own["poisson_ratio"],
        sampling=own["sampling"],
        drives=lambda channel: channel in own["driven"],
    )
    scene = SimpleNamespace(
        finger=SimpleNamespace(thickness=own["thickness"]),
        friction=own["friction"],
        present=lambda: own["present"],
        plan=lambda: plan,
    )
    log = SimpleNamespace(
        force=own["force"],
        position=1e-3 * np.stack([row, column, 0 * row], axis=-1),
        truth=SimpleNamespace(stick_ratio=np.array(own["stick_ratio"])),
    )
    return cast("Measured", SimpleNamespace(scene=scene, plan=plan, log=log))


@pytest.fixture(autouse=True)
def reach(monkeypatch: pytest.MonkeyPatch) -> None:
    """A contact of 1 mm radius."""
    monkeypatch.setattr(explaining, "contact_reach", lambda _plan: 1e-3)


@pytest.mark.parametrize(
    ("thickness", "said"), [(12.6e-3, ""), (12.4e-3, "1 mm and the gel is 12 mm thick (ratio 0.081)")]
)
def test_a_base_counts_from_a_twelfth_of_the_thickness_on(thickness: float, said: str) -> None:
    proposal = explaining._base(whole(thickness=thickness))
    assert (proposal is not None) == bool(said)
    assert proposal is None or said in proposal.reason
    assert explaining._base(whole(thickness=thickness, present=(FiniteLayer(1e-2),))) is None


@pytest.mark.parametrize(("ratio", "said"), [(0.49, False), (0.4, True)])
def test_a_compressible_gel_wants_coupling_from_a_tenth_of_friction_on(ratio: float, said: bool) -> None:
    """Dundurs' β is (1 − 2ν)/(2 − 2ν): 0.0196 and 0.167, of 0.4."""
    proposal = explaining._coupling(whole(poisson_ratio=ratio))
    assert (proposal is not None) == said
    assert proposal is None or "β = 0.17 at ν = 0.4 against a rigid object, 0.42 of μ" in proposal.reason
    assert explaining._coupling(whole(poisson_ratio=ratio, coupled=True)) is None
    assert explaining._coupling(whole(poisson_ratio=ratio, friction=0.0)) is None


def test_a_layer_wants_coupling_whatever_its_gel() -> None:
    proposal = explaining._coupling(whole(present=(FiniteLayer(1e-2),)))
    assert proposal is not None
    assert "0.29 μp₀" in proposal.reason


@pytest.mark.parametrize(("pull", "said"), [(0.039, False), (0.041, True), (-0.041, True)])
def test_a_contact_off_the_centre_wants_its_moment_from_a_twentieth_of_frictions_on(pull: float, said: bool) -> None:
    """Pulled 1 mm off the origin: against 0.4 · 2 N · 1 mm."""
    force = np.zeros((2, 3, 3, 3))
    force[1, 1, 2] = [pull, 9.0, -2.0]
    force[0, 1, 1] = [0.0, 0.0, -1.0]  # less, in the middle
    proposal = explaining._off_centre(whole(force=force))
    assert (proposal is not None) == said
    assert proposal is None or "lies 1 mm off the sensor's" in proposal.reason
    assert proposal is None or "a moment of 0.051 μF_N a" in proposal.reason
    for unneeded in ({"driven": ("moment",)}, {"driven": ("yaw",)}, {"friction": 0.0}, {"force": 0.0 * force}):
        assert explaining._off_centre(whole(**{"force": force, **unneeded})) is None


def test_sliding_wants_friction_by_velocity_unless_it_has_it() -> None:
    assert explaining._velocity(whole(stick_ratio=[1.0, 1e-9])) is None
    assert explaining._velocity(whole(stick_ratio=[np.nan, 0.0])) is not None
    assert explaining._velocity(whole(stick_ratio=[np.nan, 0.0], laws=(1,))) is None


@pytest.mark.parametrize(
    ("pitch", "said"), [(0.25e-3, ""), (0.26e-3, "3.8 sensor points"), (0.5e-3, "2.0 sensor points")]
)
def test_fewer_than_four_points_along_a_radius_are_too_few(pitch: float, said: str) -> None:
    proposal = explaining._resolution(whole(sampling=SamplingPlan((9, 9), pitch, 30.0)))
    assert (proposal is not None) == bool(said)
    assert proposal is None or proposal.reason.startswith(said)
    assert explaining._resolution(whole()) is None


@pytest.mark.parametrize(("change", "said"), [(0.9e-3, "more than 0.09 %"), (1.1e-3, ""), (None, "")])
def test_an_effect_may_be_left_out_that_changes_less_than_a_thousandth(change: float | None, said: str) -> None:
    difference = None if change is None else Difference(0.0, change, 0.5 * change)
    proposal = explaining._superfluous(EffectReport("Drift", "", "", 0.0, 0, difference, "a note"))
    assert (proposal is not None) == bool(said)
    assert proposal is None or said in proposal.reason


def test_a_change_is_told_in_per_cent_or_why_there_is_none() -> None:
    report = EffectReport("Drift", "", "", 0.0, 0, Difference(0.0312, 0.0154, 0.2), "")
    assert explaining._changed(report) == "stick ratio 0.031, displacement 1.5 %, force 20 % different"
    assert explaining._changed(EffectReport("Drift", "", "", 0.0, 0, None, "a note")) == "a note"
