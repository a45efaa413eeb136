"""Two geoms of a scene alone: why they have their friction, how they move each other, and when they slip."""

import math
from typing import Any

import numpy as np
import pytest

from stiction_client import InvalidArgument

mujoco = pytest.importorskip("mujoco", reason="mujoco-core is not installed")

from stiction_client.mujoco_scene import bench as module  # noqa: E402 - needs MuJoCo
from stiction_client.mujoco_scene.bench import Bench  # noqa: E402
from stiction_client.mujoco_scene.rule import explanation, geom_name, pair_of, rule_of  # noqa: E402
from stiction_client.mujoco_scene.touching import _frame, touching  # noqa: E402

BALL = '<body pos="0 0 {height}"><freejoint/><geom {more} type="sphere" size=".1" mass="2"/></body>'


def scene(
    option: str = "", ball: str = 'name="ball"', floor: str = 'name="floor"', pair: str = "", height: float = 0.1
) -> Any:
    body = BALL.format(height=height, more=ball)
    world = f'<worldbody><geom {floor} type="plane" size="1 1 1"/>{body}</worldbody>'
    return mujoco.MjModel.from_xml_string(f"<mujoco>{option}{world}<contact>{pair}</contact></mujoco>")


PAIR = '<pair geom1="floor" geom2="ball" friction=".3 .3 .01 .01 .01"/>'


@pytest.mark.parametrize(
    ("given", "rule", "told"),
    [
        ({}, "max", "the larger of floor (1) and ball (0.5)"),
        ({"pair": PAIR}, "pair", "the pair element of floor and ball decides alone"),
        (
            {"floor": 'name="floor" priority="2"'},
            "priority",
            "floor (1) has priority 2, ball (0.5) only 0",
        ),
        ({"ball": 'name="ball" friction=".5" priority="1"'}, "priority", "ball (0.5) has priority 1, floor (1) only 0"),
        (
            {"option": '<option o_friction="1 1 1 1 1"><flag override="enable"/></option>', "pair": PAIR},
            "override",
            "o_friction of the option element overrides every geom and pair",
        ),
    ],
)
def test_friction_is_that_of_the_rule_that_stands_above_the_others(given: dict[str, str], rule: str, told: str) -> None:
    model = scene(**{"ball": 'name="ball" friction=".5"'} | given)  # type: ignore[arg-type]
    assert rule_of(model, 0, 1) == rule_of(model, 1, 0) == rule
    assert explanation(model, 0, 1) == told


def test_a_pair_is_found_in_either_order_and_a_geom_without_a_name_by_its_body() -> None:
    model = scene(pair=PAIR)
    assert (pair_of(model, 0, 1), pair_of(model, 1, 0), pair_of(model, 0, 0)) == (0, 0, None)
    assert pair_of(scene(), 0, 1) is None
    assert geom_name(scene(ball=""), 1) == "geom 1 of body ''"
    assert geom_name(model, 1) == "ball"


def test_what_lies_is_pressed_with_its_weight_and_does_not_move() -> None:
    model = scene()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 500)
    (touch,) = touching(model, data, 20)
    assert (touch.first, touch.second) == (0, 1)
    assert touch.frame[0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)
    assert touch.normal_force == pytest.approx(2.0 * 9.81, rel=1e-3)
    assert np.abs(touch.tangential_force).max() < 1e-6
    assert touch.speed < 1e-6
    assert touch.points == 1.0
    assert touching(scene(height=5.0), mujoco.MjData(scene(height=5.0)), 1) == []


def test_what_slides_is_told_with_its_speed_and_force() -> None:
    model = scene('<option gravity="0 0 -10"/>')
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 500)
    data.qvel[:] = [0.0, 3.0, 0.0, 0.0, 0.0, 0.0]
    (touch,) = touching(model, data, 1)
    assert touch.speed == pytest.approx(3.0, rel=0.05)
    assert np.linalg.norm(touch.tangential_force) == pytest.approx(touch.normal_force, rel=0.05)  # friction is 1


def test_the_frame_of_a_contact_is_square_and_keeps_its_tangent() -> None:
    normal = np.array([0.0, 0.6, 0.8])
    frame = _frame(normal, np.array([1.0, 0.5, 0.0]))
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), rtol=0.0, atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    assert frame[0].tolist() == normal.tolist()
    assert frame[1] @ [1.0, 0.5, 0.0] > 0.0
    assert frame[2] @ [1.0, 0.5, 0.0] == pytest.approx(0.0, abs=1e-12)


class Stiff(Bench):
    """It slips from a load on, whatever the angle; each look is counted."""

    def __init__(self, limit: float) -> None:
        super().__init__(None, np.eye(3), 1.0)
        object.__setattr__(self, "limit", limit)
        object.__setattr__(self, "loads", [])

    def speed(self, load: float, angle: float) -> float:  # noqa: ARG002
        self.loads.append(load)  # type: ignore[attr-defined]
        return 0.02 if load >= self.limit else 0.01  # type: ignore[attr-defined]


@pytest.mark.parametrize("limit", [0.3, 1.0, 2.0, 50.0, 100.0])
def test_the_least_load_that_slips_is_found_to_a_thousandth_of_the_expected_one(limit: float) -> None:
    bench = Stiff(limit)
    assert bench.slip_load(0.0, 1.0) == pytest.approx(limit, abs=1e-3)
    assert bench.slip_load(0.0, 2.0) == pytest.approx(limit, abs=2e-3)


def test_geoms_that_interlock_slip_under_no_load() -> None:
    bench = Stiff(1e9)
    assert bench.slip_load(0.0, 1.0) == math.inf
    assert max(bench.loads) == 100.0  # type: ignore[attr-defined]


def test_a_bench_weighs_as_both_bodies_do_together_and_has_no_gravity() -> None:
    model = scene()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 500)
    (touch,) = touching(model, data, 1)
    made = module.bench(model, data, touch)
    assert made.model.body_mass[1] == pytest.approx(2.0)
    assert not made.model.opt.gravity.any()
    assert made.model.opt.timestep == model.opt.timestep
    assert (made._steps(0.1), made._steps(1e-9)) == (50, 1)
    assert made.speed(0.1, 0.0) < 1e-3  # friction is 1
    assert made.speed(40.0, 0.0) == math.inf


def test_a_shape_that_cannot_be_taken_out_of_its_scene_is_named() -> None:
    field = '<mujoco><asset><hfield name="f" nrow="2" ncol="2" size="1 1 .1 .1"/></asset><worldbody>'
    field += '<geom name="ground" type="hfield" hfield="f"/><body pos="0 0 .1"><freejoint/><geom size=".1"/></body>'
    model = mujoco.MjModel.from_xml_string(field + "</worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with pytest.raises(InvalidArgument, match="the shape of ground is hfield; allowed: plane, sphere, capsule, ellips"):
        module._add_geom(None, None, model, data, 0, np.zeros(3))
