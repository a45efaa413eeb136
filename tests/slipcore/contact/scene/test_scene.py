"""Scene files, sampling and the log that comes out."""

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from slipcore.contact.effects import EFFECTS, FlatSurface, LoadPath, MarkerNoise, SensorSampling, TangentialLoad
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.scene import Finger, Press, Scene, library, simulate
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.contact.tiers.probe import contact_reach
from slipcore.contact.tiers.sampling import SensorGrid, sensor_grid
from slipcore.errors import InvalidInput
from slipcore.frames import FrictionLaw

TEXT = """
name = "sheared sphere"
friction = 0.5
duration = 1.5

[finger]
radius = 0.012

[press]
force = 5.0
duration = 0.5

[[effect]]
kind = "TangentialLoad"
force = [1.0, 0.0]
start = 0.5

[[effect]]
kind = "SensorSampling"
points = [10, 8]
"""


def test_a_scene_file_is_the_scene_written_in_python(tmp_path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(TEXT, encoding="utf-8")
    expected = Scene(
        "sheared sphere",
        (TangentialLoad((1.0, 0.0), start=0.5), SensorSampling((10, 8))),
        finger=Finger(radius=0.012),
        friction=0.5,
        press=Press(5.0, 0.5),
        duration=1.5,
    )
    assert Scene.from_toml(path) == expected


@pytest.mark.parametrize(
    ("entries", "named"),
    [
        ({"name": "a", "colour": 1}, "colour"),
        ({"name": "a", "finger": {"raduis": 1.0}}, "raduis"),
        ({"name": "a", "effect": [{"kind": "Magic"}]}, "Magic"),
        ({"name": "a", "effect": [{"kind": "Torsion", "twist": 1.0}]}, "twist"),
        ({"name": "a", "effect": [{"kind": "Torsion"}]}, "Torsion"),
        ({"name": "a", "friction": -0.1}, "friction"),
        ({"name": "a", "friction": "0.4"}, "friction of Scene is '0.4'; allowed: a number"),
        ({"name": "a", "friction": True}, "friction of Scene is True"),
        ({"name": 5}, "name of Scene is 5"),
        ({"friction": 0.4}, "name of Scene is missing"),
        ({"name": "a", "finger": "soft"}, "finger is 'soft'; allowed: a table"),
        ({"name": "a", "finger": {"poisson_ratio": -1}}, "poisson_ratio of the finger is -1; allowed: 0 to 0.5"),
        ({"name": "a", "finger": {"young_modulus": -1}}, "young_modulus of the finger is -1"),
        ({"name": "a", "press": 5}, "press is 5; allowed: a table"),
        ({"name": "a", "press": {"duration": -1}}, "press.duration is -1"),
        ({"name": "a", "effect": {"kind": "Torsion", "moment": 1e-3}}, r"under \[\[effect\]\]"),
        ({"name": "a", "effect": ["Torsion"]}, "effect is 'Torsion'; allowed: a table"),
        ({"name": "a", "effects": [{"kind": "Torsion", "moment": 1e-3}]}, "is effects; allowed: .* effect$"),
        ({"name": "a", "effect": [{"kind": "TangentialLoad", "force": [1, 0, 5]}]}, "force .*allowed: 2 numbers"),
        ({"name": "a", "effect": [{"kind": "SensorSampling", "points": [2.5, 20]}]}, "points .*a whole number"),
        ({"name": "a", "effect": [{"kind": "SphereSurface", "curvature": float("nan")}]}, "curvature of SphereSurface"),
    ],
)
def test_what_a_scene_file_cannot_mean_is_refused_by_name(entries: dict, named: str) -> None:
    with pytest.raises(InvalidInput, match=named):
        Scene.from_mapping(entries)


def test_a_missing_scene_names_the_library() -> None:
    with pytest.raises(InvalidInput, match="TOML"):
        Scene.from_toml("no_such_scene")


def test_a_misspelt_scene_is_told_the_likely_ones_alone() -> None:
    with pytest.raises(InvalidInput, match=r"table1_condition1.*did you mean") as refused:
        Scene.from_toml("tabel1_condition1")
    assert "household" not in str(refused.value)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"scene": "x"}, "scene is 'x'; allowed: SceneDescription"),
        ({"accuracy": "0.1"}, "accuracy is '0.1'; allowed: above 0"),
        ({"accuracy": True}, "accuracy is True; allowed: above 0"),
        ({"accuracy": 0.1, "tier": []}, "tier is .*; allowed: closed form"),
        ({"seconds": "1"}, "seconds is '1'; allowed: above 0 s"),
        ({"fidelity": 12}, "fidelity is 12; allowed: Fidelity or None"),
    ],
)
def test_a_request_that_means_nothing_is_refused_by_name(given: dict, told: str) -> None:
    with pytest.raises(InvalidInput, match=told):
        simulate(**{"scene": Scene("a"), **given})


@pytest.mark.parametrize("seed", [-1, 1.5, True, "a", None])
def test_a_seed_is_a_whole_number_of_at_least_0(seed) -> None:
    scene = Scene("a", (MarkerNoise(1e-6),))
    for ask in (scene.plan, scene.explain, lambda seed: simulate(scene, seed=seed)):
        with pytest.raises(InvalidInput, match=f"seed is {seed!r}; allowed: a whole number, 0 or more"):
            ask(seed)
    assert scene.plan(np.int64(3)).seed == 3


def test_a_scene_has_a_name() -> None:
    with pytest.raises(InvalidInput, match=r"name of the scene is ' \\n'; allowed: one that is not blank"):
        Scene(" \n")


def test_a_sensor_has_two_frames_in_the_scene() -> None:
    scene = Scene("a", (SensorSampling((4, 4), 1e-3, 0.4),), press=Press(1.0, 0.5), duration=2.0)
    with pytest.raises(InvalidInput, match=r"frame_rate of SensorSampling is 0\.4 1/s; allowed: 0\.5 1/s or more"):
        simulate(scene)


def test_a_log_says_which_loads_the_end_of_its_scene_cuts_short() -> None:
    late = TangentialLoad((1.0, 0.0), start=9.0)
    fall = LoadPath((0.5, 1.5, 4.0), normal_force=(0.0, 0.0, -2.0))
    cut = Scene("a", (late, fall), press=Press(5.0, 2.0), duration=1.0)
    told = "after 1 s: normal_force at 2.5 on its way to 3, force_x at 0 on its way to 1"
    assert simulate(cut, fidelity=Fidelity(8)).metadata["cut short"] == told
    whole = Scene("a", (TangentialLoad((1.0, 0.0), 1.0, 0.5),), press=Press(5.0, 1.0), duration=1.5)
    assert "cut short" not in simulate(whole, fidelity=Fidelity(8)).metadata


def test_no_scene_of_the_library_is_cut_short() -> None:
    assert [name for name in library() if Scene.from_toml(name).plan().cut_short()] == []


def test_text_is_no_number_of_an_effect_or_a_fidelity() -> None:
    with pytest.raises(InvalidInput, match="scale of MarkerNoise is 'x'; allowed: a number"):
        MarkerNoise("x")
    with pytest.raises(InvalidInput, match="cells of Fidelity is 'x'; allowed: a whole number"):
        Fidelity(cells="x")


@pytest.mark.parametrize("kind", [kind for kind in EFFECTS.values() if fields(kind)])
def test_every_effect_refuses_text_by_name(kind: type) -> None:
    with pytest.raises(InvalidInput, match=f"of {kind.__name__} is"):
        Scene("a", (kind(*["x"] * len(fields(kind))),))


def test_a_shortened_scene_may_end_before_its_load_begins() -> None:
    Scene("a", (TangentialLoad((1.0, 0.0), start=2.0),), duration=2.0).plan(0)


def test_a_folder_or_a_number_is_no_scene_file(tmp_path) -> None:
    for wrong in (tmp_path, 5, None):
        with pytest.raises(InvalidInput, match="scene is"):
            Scene.from_toml(wrong)


@pytest.mark.parametrize(
    ("entries", "named"),
    [
        ({"friction": "0.4"}, "friction of Scene"),
        ({"duration": "1"}, "duration of Scene"),
        ({"finger": 5}, "finger is 5"),
        ({"press": 10.0}, "press is 10.0"),
        ({"effects": None}, "effects is None"),
        ({"effects": ("Torsion",)}, "effect is 'Torsion'"),
        ({"effects": (FlatSurface,)}, "effect is <class"),
        ({"effects": (TangentialLoad((1.0, True)),)}, "force of TangentialLoad"),
    ],
)
def test_a_scene_in_python_is_refused_as_one_in_a_file(entries: dict, named: str) -> None:
    with pytest.raises(InvalidInput, match=named):
        Scene("a", **entries)


def test_points_are_cell_centres_and_elements_sums_of_cells() -> None:
    where = sensor_grid(SensorSampling((4, 3), pitch=1e-3).extend(Scene("s").plan()).sampling, 3e-3, 16)
    assert where.cells % 2 == 1
    assert where.pitch == pytest.approx(1e-3)
    position = where.position()
    np.testing.assert_allclose(position[:, 0, 0], [-1.5e-3, -0.5e-3, 0.5e-3, 1.5e-3], atol=1e-15)
    np.testing.assert_allclose(position[0, :, 1], [-1e-3, 0.0, 1e-3], atol=1e-15)
    x, y = where.grid.points()
    inside = (abs(x - 0.5e-3) < 0.5e-3) & (abs(y - 1e-3) < 0.5e-3)
    field = np.random.default_rng(0).normal(size=where.grid.shape)
    assert where.over_elements(field)[2, 2] == pytest.approx(field[inside].sum(), rel=1e-12)


def test_a_lattice_of_cells_is_the_grid() -> None:
    where = SensorGrid(Grid.square(6, 1.0), (6, 6), 1)
    field = np.arange(36.0).reshape(6, 6)
    np.testing.assert_array_equal(where.at_points(field), field.T)
    np.testing.assert_array_equal(where.over_elements(field), field.T)


def test_the_contact_is_found_wherever_it_ends() -> None:
    hertz = (0.75 * 10.0 * 15e-3 * (1 - 0.49**2) / 1e6) ** (1 / 3)
    assert contact_reach(Scene("hertz").plan()) == pytest.approx(hertz, rel=0.05)
    wide = Scene("punch", (FlatSurface((60e-3, 10e-3)),), finger=Finger(radius=np.inf))
    assert contact_reach(wide.plan()) == pytest.approx(30e-3, rel=0.05)
    with pytest.raises(InvalidInput, match="contact"):
        contact_reach(Scene("flat on flat", finger=Finger(radius=np.inf)).plan())


def test_the_log_is_in_the_frame_of_the_contract() -> None:
    log = simulate(
        Scene("s", (TangentialLoad((1.5, 0.0)), SensorSampling((8, 6), 1.5e-3, 10.0))), fidelity=Fidelity(cells=16)
    )
    assert log.grid == (8, 6)
    assert log.element_area == pytest.approx(2.25e-6)
    np.testing.assert_allclose(log.time, np.arange(21) / 10.0, rtol=1e-12)
    assert log.position[1, 0, 0] > log.position[0, 0, 0]
    np.testing.assert_allclose(log.force[-1].sum(axis=(0, 1)), [1.5, 0.0, -10.0], rtol=1e-4, atol=1e-9)
    assert log.displacement[-1, ..., 2].min() < -1e-4
    assert log.object_pose[-1, 0] > 0.0
    assert not log.truth.contact[0].any()
    assert np.isnan(log.truth.stick_ratio[0])
    assert 0.0 < log.truth.stick_ratio[-1] < 1.0
    assert log.metadata["tier"] == "boundary elements"


def test_without_a_sensor_every_cell_and_step_is_in_the_log() -> None:
    log = simulate(Scene("bare"), fidelity=Fidelity(cells=10))
    assert log.grid == (10, 10)
    assert len(log) == 61


def test_the_friction_that_a_log_tells_is_the_scenes_at_any_force_and_velocity() -> None:
    assert Scene("s", friction=0.37).plan().law == FrictionLaw((0.37, 0.0, 0.0))


@pytest.mark.parametrize("content", [b"garbage = [", b"\xff\xfe"])
def test_a_file_that_is_not_toml_is_refused_by_name(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "broken.toml"
    path.write_bytes(content)
    with pytest.raises(InvalidInput, match=r"broken\.toml"):
        Scene.from_toml(path)
