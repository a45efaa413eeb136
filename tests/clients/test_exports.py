import configparser
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from stiction_client import (
    Contact,
    CoulombFriction,
    FrictionModel,
    InvalidArgument,
    Scale,
    Scales,
    cone_half_angle,
    conservative_friction,
    contactile_answer,
    dexnet_friction,
    drake_friction,
    friction_cone,
    graspit_friction,
    moveit_max_contact_force,
    mujoco_friction,
    mujoco_geom,
    physx_material,
    required_normal_force,
    sdf_surface,
    urdf_gazebo,
)
from stiction_client.exports.mujoco import MujocoPair, mujoco_pair

Make = Callable[..., FrictionModel]


def test_every_export_stands_on_the_conservative_quantile(make_model: Make) -> None:
    model = make_model()
    expected = float(model.predict(0.0, 0.1, 0.05))
    assert expected < float(model.predict(0.0, 0.1))
    assert conservative_friction(model, 0.1) == expected
    assert mujoco_friction(model, 0.1)[0] == expected
    assert drake_friction(model, 0.1).static_friction == expected
    assert np.hypot(*friction_cone(model, 0.1)[0, :2]) == pytest.approx(expected, rel=1e-15)


def test_a_smaller_quantile_promises_less(make_model: Make) -> None:
    assert conservative_friction(make_model(), 0.1, 1e-3) < conservative_friction(make_model(), 0.1, 0.05)


@pytest.mark.parametrize("quantile", [0.0, 0.51, 1.0, np.nan])
@pytest.mark.parametrize("export", [conservative_friction, mujoco_friction, mujoco_geom, drake_friction, friction_cone])
def test_a_quantile_that_is_not_conservative_is_refused(
    make_model: Make, export: Callable[..., Any], quantile: float
) -> None:
    with pytest.raises(InvalidArgument, match=r"quantile is .*; allowed: above 0, at most 0\.5"):
        export(make_model(), 0.1, quantile)


@pytest.mark.parametrize("export", [conservative_friction, mujoco_friction, mujoco_geom, drake_friction, friction_cone])
def test_a_model_too_uncertain_to_promise_friction_is_not_exported(
    make_model: Make, export: Callable[..., Any]
) -> None:
    with pytest.raises(InvalidArgument, match=r"friction coefficient at quantile 0\.05, .* is 0; allowed: above 0"):
        export(make_model(scale=1.0), 0.1)


def test_torsional_friction_is_that_of_a_hertzian_contact(make_model: Make) -> None:
    """Integrate μ p r over p ∝ √(1 − (r/a)²): the moment over μ F_N a."""
    r = (np.arange(200_000) + 0.5) / 200_000
    pressure = np.sqrt(1.0 - r**2)
    moment = (pressure * r * r).sum() / (pressure * r).sum()
    sliding, torsional, rolling = mujoco_friction(make_model(), 0.1, contact_radius=4e-3)
    assert torsional == pytest.approx(moment * sliding * 4e-3, rel=1e-6)  # midpoint rule with an edge of √
    assert rolling == 0.0
    assert mujoco_friction(make_model(), 0.1)[1] == 0.0


def test_the_mujoco_geom_is_xml_that_wins_over_the_object(make_model: Make) -> None:
    point = ElementTree.fromstring(f"<geom {mujoco_geom(make_model(), 0.1)}/>").attrib
    assert [float(value) for value in point["friction"].split()] == pytest.approx(
        mujoco_friction(make_model(), 0.1), rel=1e-8
    )
    assert (point["condim"], point["priority"]) == ("3", "1")
    assert 'condim="4"' in mujoco_geom(make_model(), 0.1, contact_radius=4e-3)


@pytest.mark.parametrize("radius", [-1e-3, np.nan, np.inf])
def test_a_contact_radius_that_cannot_be_is_refused(make_model: Make, radius: float) -> None:
    with pytest.raises(InvalidArgument, match="contact_radius"):
        mujoco_friction(make_model(), 0.1, contact_radius=radius)


def test_drake_gets_friction_at_rest_and_while_sliding(make_model: Make) -> None:
    model = make_model()
    friction = drake_friction(model, 0.1, sliding_velocity=0.003)
    assert friction.dynamic_friction == float(model.predict(0.003, 0.1, 0.05)) < friction.static_friction
    assert drake_friction(model, 0.1).dynamic_friction == float(model.predict(0.004, 0.1, 0.05))


def test_drake_never_gets_more_dynamic_than_static_friction(make_model: Make) -> None:
    friction = drake_friction(make_model((0.4, 20.0, 0.0)), 0.1)
    assert friction.dynamic_friction == friction.static_friction


def test_the_drake_element_is_xml_with_both_values(make_model: Make) -> None:
    friction = drake_friction(make_model(), 0.1)
    text = re.sub("drake:", "", friction.to_sdf())
    element = ElementTree.fromstring(text)
    assert float(element.findtext("mu_static") or "") == pytest.approx(friction.static_friction, rel=1e-8)
    assert float(element.findtext("mu_dynamic") or "") == pytest.approx(friction.dynamic_friction, rel=1e-8)


@pytest.mark.parametrize("edges", [3, 4, 8, 64])
def test_the_linearised_cone_lies_inside_the_true_one_and_fills_it(make_model: Make, edges: int) -> None:
    friction = conservative_friction(make_model(), 0.1)
    cone = friction_cone(make_model(), 0.1, edges=edges)
    assert cone.shape == (edges, 3)
    forces = np.random.default_rng(4).exponential(size=(20_000, edges)) @ cone
    ratio = np.linalg.norm(forces[:, :2], axis=1) / forces[:, 2]
    assert (ratio <= friction * (1.0 + 1e-14)).all()
    middle = np.linalg.norm((cone + np.roll(cone, 1, axis=0))[:, :2], axis=1) / 2.0
    np.testing.assert_allclose(middle, friction * np.cos(np.pi / edges), rtol=1e-13, atol=0)  # the documented loss


def test_a_cone_needs_three_edges(make_model: Make) -> None:
    with pytest.raises(InvalidArgument, match="edges is 2; allowed: 3 to 100000"):
        friction_cone(make_model(), 0.1, edges=2)


def test_physx_gets_friction_that_never_grows_with_sliding(make_model: Make) -> None:
    material = physx_material(make_model((0.4, 5.0, 0.0)), 0.1)
    assert material.dynamic_friction == material.static_friction
    falling = physx_material(make_model((0.4, -20.0, 0.0)), 0.1)
    assert (
        falling.dynamic_friction < falling.static_friction == conservative_friction(make_model((0.4, -20.0, 0.0)), 0.1)
    )
    lines = falling.to_usd().splitlines()
    assert lines[0] == f"float physics:staticFriction = {falling.static_friction:.9g}"
    assert lines[2] == 'uniform token physxMaterial:frictionCombineMode = "min"'


def test_descriptions_of_robots_are_xml_with_the_conservative_value(make_model: Make) -> None:
    expected = conservative_friction(make_model(), 0.1)
    for text in (sdf_surface(make_model(), 0.1), urdf_gazebo(make_model(), "finger", 0.1)):
        numbers = [float(entry.text or "") for entry in ElementTree.fromstring(text).iter() if entry.text]
        assert numbers == pytest.approx([expected, expected], rel=1e-8)  # nine digits are written


def test_dexnet_s_sigma_is_the_variance_of_an_observation(make_model: Make) -> None:
    model = make_model(covariance=np.zeros((3, 3)), scatter_degrees_of_freedom=np.inf)
    told = dexnet_friction(model, 0.1)
    assert told["friction_coef"] == float(model.predict(0.0, 0.1))
    assert told["sigma_friction_coef"] == pytest.approx(model.scale**2, rel=1e-9)


def test_graspit_reads_the_friction_of_a_pair_of_its_materials(make_model: Make) -> None:
    """As World::readSettings does: by the numbers of the materials, the smaller first."""
    friction = graspit_friction(make_model((0.4, -20.0, 0.0)), ("rubber", "plastic"), 0.1)
    assert friction.static_friction == conservative_friction(make_model((0.4, -20.0, 0.0)), 0.1)
    assert friction.dynamic_friction < friction.static_friction
    assert friction.settings() == {
        "GraspIt/World/cof35": friction.static_friction,
        "GraspIt/World/kcof35": friction.dynamic_friction,
    }
    grows = graspit_friction(make_model((0.4, 5.0, 0.0)), ("wood", "wood"), 0.1)
    assert list(grows.settings()) == ["GraspIt/World/cof44", "GraspIt/World/kcof44"]
    assert grows.dynamic_friction == grows.static_friction


def test_graspit_s_lines_are_an_ini_file_of_qt(make_model: Make) -> None:
    friction = graspit_friction(make_model(), ("rubber", "plastic"), 0.1)
    read = configparser.ConfigParser()
    read.read_string(friction.to_ini())
    told = {f"graspit/{key}".replace("\\", "/"): float(value) for key, value in read["GraspIt"].items()}
    assert told == pytest.approx({key.lower(): value for key, value in friction.settings().items()}, rel=1e-8)


@pytest.mark.parametrize("materials", [("rubber", "cork"), ("rubber", "frictionless"), ("rubber",), ("wood",) * 3])
def test_graspit_has_no_other_materials(make_model: Make, materials: tuple[str, str]) -> None:
    with pytest.raises(InvalidArgument, match=r"materials is .*; allowed: two"):
        graspit_friction(make_model(), materials, 0.1)


def test_a_cone_s_half_angle_is_the_arc_tangent(make_model: Make) -> None:
    assert np.tan(cone_half_angle(make_model(), 0.1)) == pytest.approx(
        conservative_friction(make_model(), 0.1), rel=1e-15
    )


def test_moveit_and_contactile_are_told_what_the_planner_found(make_model: Make) -> None:
    bounded = required_normal_force(make_model((0.5, 0.0, -1.0), np.zeros((3, 3)), scale=0.0), 3.0, contact_area=6e-5)
    everywhere = make_model((0.4, 0.0, 0.0), np.zeros((3, 3)), normal_force_domain=(0.0, 1e15))
    unbounded = required_normal_force(everywhere, 3.0, contact_area=6e-5)
    assert moveit_max_contact_force(bounded) == bounded.feasible_interval[1]
    assert moveit_max_contact_force(unbounded) == 0.0
    assert contactile_answer(bounded) == {
        "friction_est": bounded.friction_coefficient,
        "target_grip_force": bounded.normal_force,
    }
    assert contactile_answer(None) == {"friction_est": -1.0, "target_grip_force": -1.0}


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -0.1])
@pytest.mark.parametrize("name", ["static_friction", "dynamic_friction"])
def test_drake_is_given_no_coefficient_that_is_none(name: str, value: float) -> None:
    """Drake takes NaN and infinity."""
    with pytest.raises(InvalidArgument, match=name):
        CoulombFriction(**{"static_friction": 0.4, "dynamic_friction": 0.3} | {name: value})
    with pytest.raises(InvalidArgument, match="dynamic_friction"):
        CoulombFriction(0.3, 0.4)


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0])
@pytest.mark.parametrize("name", ["sliding_velocity", "other_friction"])
def test_drake_s_friction_is_asked_for_with_finite_numbers(
    name: str, value: float, make_model: Callable[..., FrictionModel]
) -> None:
    with pytest.raises(InvalidArgument, match=name):
        drake_friction(make_model(), 0.1, **{name: value})


PAD = Contact(6e-5)


def test_a_pair_of_constant_friction_is_that_of_its_elements_under_the_grip(make_model: Make) -> None:
    model, finger = make_model(), Contact.round(6e-5, at_force=5.0)
    pair = mujoco_pair(model, ("a", "b"), 8.0, finger)
    element, elements = finger.element_force(8.0, 1e-6), float(finger.elements(8.0, 1e-6))
    friction = conservative_friction(model, float(element), contact_area=elements * 1e-6)
    assert (pair.geom1, pair.geom2, pair.adhesion) == ("a", "b", 0.0)
    assert pair.sliding == pytest.approx(friction)
    assert pair.torsional == pytest.approx(float(finger.arm(8.0)) * friction)


@pytest.mark.parametrize("points", [1, 4])
def test_adhesion_makes_up_for_what_the_slope_lacks_shared_by_the_points(make_model: Make, points: int) -> None:
    """C(F) = (0.8 − 0.01 F) F: under 10 N it is 7 N, and its slope is 0.6."""
    falling = make_model((0.8, 0.0, -0.6), np.zeros((3, 3)), scale=0.0)
    pair = mujoco_pair(falling, ("a", "b"), 10.0, PAD, points=points, load_faithful=True)
    assert pair.sliding == pytest.approx(0.6)
    assert points * pair.adhesion == pytest.approx(7.0 / 0.6 - 10.0)


def test_a_pair_is_written_with_as_many_numbers_as_mujoco_reads() -> None:
    plain = ElementTree.fromstring(MujocoPair("a", "b", 0.5, 0.0, 0.0).to_xml()).attrib
    assert plain == {"geom1": "a", "geom2": "b", "condim": "3", "friction": "0.5 0.5 1e-05 1e-05 1e-05"}
    soft = ElementTree.fromstring(MujocoPair("a", "b", 0.5, 1e-3, 2.5).to_xml()).attrib
    assert (soft["condim"], soft["friction"], soft["adhesion"]) == ("4", "0.5 0.5 0.001 1e-05 1e-05", "2.5")


@pytest.mark.parametrize(
    ("name", "least", "most", "unit"), [("grip_force", 1e-9, 1e9, "N"), ("points", 1, 1000, "points")]
)
def test_a_pair_has_a_force_and_points_within_their_range(
    make_model: Make, name: str, least: float, most: float, unit: str
) -> None:
    sure = make_model((0.4, 0.0, 0.0), np.zeros((3, 3)), scale=0.0, normal_force_domain=(1e-12, 1e8))
    for value in (least, most):
        given = {"grip_force": 5.0, name: value}
        assert mujoco_pair(sure, ("a", "b"), contact=PAD, allow_unidentified=True, **given).geom1 == "a"  # type: ignore[arg-type]
    for value in (0.9 * least, 1.1 * most):
        given = {"grip_force": 5.0, name: value}
        with pytest.raises(InvalidArgument, match=rf"{name} is .*; allowed: .* to .* {unit}"):
            mujoco_pair(sure, ("a", "b"), contact=PAD, **given)  # type: ignore[arg-type]


def test_the_median_is_the_largest_quantile_that_is_exported(make_model: Make) -> None:
    model = make_model()
    assert conservative_friction(model, 0.1, 0.5) == pytest.approx(float(model.predict(0.0, 0.1)))


def test_scatter_averages_out_over_the_elements_of_the_contact_one_at_least(make_model: Make) -> None:
    scaled = replace(make_model(), scales=Scales(Scale(1e-4, np.inf), Scale(1e-4, np.inf), Scale(0.05, np.inf)))
    for area, elements in ((100e-6, 100.0), (1e-6, 1.0), (0.2e-6, 1.0)):
        expected = float(scaled.predict(0.0, 0.1, 0.05, of="contact", elements=elements))
        assert conservative_friction(scaled, 0.1, contact_area=area) == pytest.approx(expected)
    assert conservative_friction(scaled, 0.1) == conservative_friction(scaled, 0.1, contact_area=6e-5)


def test_a_cone_is_counted_around_its_normal_from_x(make_model: Make) -> None:
    friction = conservative_friction(make_model(), 0.1)
    along = friction * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    np.testing.assert_allclose(friction_cone(make_model(), 0.1, edges=4), np.c_[along, np.ones(4)], atol=1e-15)


def test_graspit_has_glass_and_no_pair_with_what_has_no_friction(make_model: Make) -> None:
    assert graspit_friction(make_model(), ("glass", "stone"), 0.1).materials == ("glass", "stone")
    with pytest.raises(InvalidArgument, match="materials is 'frictionless'; allowed: two of glass, metal, plastic"):
        graspit_friction(make_model(), ("frictionless", "stone"), 0.1)


@pytest.mark.parametrize(
    "export", [conservative_friction, drake_friction, physx_material, mujoco_friction, dexnet_friction]
)
@pytest.mark.parametrize(
    ("force", "message"),
    [
        (np.nan, r"^normal_force is nan; "),
        (-1.0, r"^normal_force is -1\.0; allowed: 0 to "),
        ("8 N", r"^normal_force is '8 N'; allowed: numbers: "),
        ([0.05, 0.06], r"^normal_force is \[0\.05, 0\.06\]; allowed: one number"),
        (1e9, r"^friction coefficient at quantile 0\.05, 1e\+09 N an element and 0 m/s is 0; allowed: above 0"),
    ],
)
def test_an_export_names_a_force_that_cannot_be(
    make_model: Make, export: Callable[..., object], force: Any, message: str
) -> None:
    with pytest.raises(InvalidArgument, match=message):
        export(make_model(), force, allow_unidentified=True)


@pytest.mark.parametrize("geoms", ["ab", ("a",), ("a", "a"), ("a", 1), ("", "b"), None])
def test_a_pair_is_of_two_geoms(make_model: Make, geoms: Any) -> None:
    with pytest.raises(InvalidArgument, match=r"^geoms is .*; allowed: the names of two geoms"):
        mujoco_pair(make_model(), geoms, 5.0, PAD, allow_unidentified=True)


def test_names_in_xml_are_written_as_xml(make_model: Make) -> None:
    name = 'left <"finger"> & thumb'
    assert ElementTree.fromstring(MujocoPair(name, "b", 0.5, 0.0, 0.0).to_xml()).attrib["geom1"] == name
    assert ElementTree.fromstring(urdf_gazebo(make_model(), name, 0.05)).attrib["reference"] == name


@pytest.mark.parametrize(
    "export",
    [conservative_friction, drake_friction, physx_material, mujoco_friction, mujoco_geom, dexnet_friction, sdf_surface],
)
def test_only_a_model_is_exported(export: Callable[..., object]) -> None:
    for model in (None, 0.4, "paper"):
        with pytest.raises(InvalidArgument, match=r"^model is .*; allowed: a FrictionModel"):
            export(model, 0.05)
    with pytest.raises(InvalidArgument, match=r"^model is None"):
        graspit_friction(None, ("glass", "stone"), 0.05)  # type: ignore[arg-type]
    with pytest.raises(InvalidArgument, match=r"^model is None"):
        mujoco_pair(None, ("a", "b"), 5.0, PAD)  # type: ignore[arg-type]


@pytest.mark.parametrize("wrong", [None, "1", True, [0.05], np.array([0.05, 0.06]), 1j])
def test_what_is_no_number_of_an_export_is_named(make_model: Make, wrong: Any) -> None:
    model = make_model()
    asked: dict[str, Callable[[], object]] = {
        "quantile": lambda: conservative_friction(model, 0.05, wrong),
        "contact_area": lambda: conservative_friction(model, 0.05, contact_area=wrong),
        "contact_radius": lambda: mujoco_friction(model, 0.05, contact_radius=wrong),
        "edges": lambda: friction_cone(model, 0.05, edges=wrong),
        "static_friction": lambda: CoulombFriction(wrong, 0.3),
        "grip_force": lambda: mujoco_pair(model, ("a", "b"), wrong, PAD),
        "contact": lambda: mujoco_pair(model, ("a", "b"), 5.0, wrong),
        "link": lambda: urdf_gazebo(model, 3 if isinstance(wrong, str) else wrong, 0.05),  # type: ignore[arg-type]
        "answer": lambda: moveit_max_contact_force(wrong),
    }
    for name, call in asked.items():
        with pytest.raises(InvalidArgument, match=f"^{name} is"):
            call()
    with pytest.raises(InvalidArgument, match=r"^materials is 3"):
        graspit_friction(model, 3, 0.05)  # type: ignore[arg-type]
    with pytest.raises(InvalidArgument, match=r"^answer is 3\.0"):
        contactile_answer(3.0)  # type: ignore[arg-type]
