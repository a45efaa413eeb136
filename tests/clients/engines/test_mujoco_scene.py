"""What ``check_scene`` says of a contact alone, against the load at which the whole scene lets its object slip."""

import json
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from service import cli
from stiction_client import InvalidArgument
from stiction_client.exports import HOLDING_OPTION

mujoco = pytest.importorskip("mujoco", reason="mujoco-core is not installed")

from stiction_client.mujoco_scene import PairCheck, check_scene  # noqa: E402 - needs MuJoCo

GRIP, FRICTION = 8.0, 0.5
PAD = 'type="box" size=".005 .01 .01"'
BOX = 'type="box" size=".02 .02 .02"'
LIKE_PADS = 'friction=".5 .005 .0001"'

Scene = Callable[..., Path]


def jaw(name: str, side: int, pad: str) -> str:
    return (
        f'<body pos="{0.03 * side} 0 .1"><joint name="{name}" type="slide" axis="{-side} 0 0" damping="5"/>'
        f'<geom name="{name}_pad" mass=".1" {LIKE_PADS} {pad}/></body>'
    )


def grasp(option: str, target: str, pad: str, contact: str, asset: str, mass: float) -> str:
    """Two jaws with a motor each, and between them an object that is held up until the jaws have closed."""
    return f"""<mujoco>{option}<asset>{asset}</asset><worldbody>{jaw("left", -1, pad)}{jaw("right", 1, pad)}
    <body name="object" pos="0 0 .1"><freejoint/><geom name="object" mass="{mass}" {target}/></body></worldbody>
    <contact>{contact}</contact>
    <actuator><motor joint="left"/><motor joint="right"/></actuator>
    <keyframe><key name="closed" ctrl="{GRIP} {GRIP}"/></keyframe></mujoco>"""


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Scene:
    """Writes a grasp, whose parts can be exchanged, to a file."""
    monkeypatch.chdir(tmp_path)  # where MuJoCo writes its warnings

    def make(
        option: str = HOLDING_OPTION,
        target: str = f"{BOX} {LIKE_PADS}",
        pad: str = PAD,
        contact: str = "",
        asset: str = "",
        mass: float = 0.1,
    ) -> Path:
        path = tmp_path / "grasp.xml"
        path.write_text(grasp(option, target, pad, contact, asset, mass))
        return path

    return make


def falls(model: Any, load: float) -> bool:
    """Whether the whole scene lets the object go faster than 10 mm/s under ``load`` N, its weight aside."""
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_step(model, data, 250)
    data.xfrc_applied[model.body("object").id, 2] = -load
    mujoco.mj_step(model, data, 150)
    before = data.body("object").xpos[2]
    mujoco.mj_step(model, data, 100)
    return bool((before - data.body("object").xpos[2]) / (100 * model.opt.timestep) > 0.01)


def slip_load(path: Path) -> float:
    """The load, N, at which the object really slips out of the whole grasp."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.gravity[:] = 0.0
    low, high = 0.0, 4.0 * GRIP
    while high - low > 1e-3 * GRIP:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if falls(model, middle) else (middle, high)
    return 0.5 * (low + high)


def checked(path: Path, **options: Any) -> tuple[PairCheck, PairCheck]:
    left, right = check_scene(path, keyframe="closed", seconds=0.5, **options).pairs
    return left, right


def pairs(friction: str) -> str:
    values = f"{friction} .005 .0001 .0001"
    return "".join(f'<pair geom1="{side}_pad" geom2="object" friction="{values}"/>' for side in ("left", "right"))


OVERRIDE = HOLDING_OPTION.replace("/>", ' o_friction=".7 .7 .005 .0001 .0001"><flag override="enable"/></option>')
RULES = {
    "max": ({"target": BOX}, 1.0),
    "priority": ({"target": f'{BOX} friction=".3" priority="1"'}, 0.3),
    "pair": ({"target": f'{BOX} priority="1"', "contact": pairs(".4 .4")}, 0.4),
    "override": ({"option": OVERRIDE}, 0.7),
}


@pytest.mark.parametrize("rule", RULES)
def test_the_rule_that_decides_is_told_and_the_pair_slips_where_the_whole_grasp_does(scene: Scene, rule: str) -> None:
    parts, friction = RULES[rule]
    path = scene(**parts)  # type: ignore[arg-type]
    for pair in checked(path):
        assert (pair.rule, pair.friction) == (rule, friction)
        assert pair.normal_force == pytest.approx(GRIP, rel=1e-3)
        assert pair.held.friction == pytest.approx(friction, rel=0.02)
        assert pair.held.creep < 1e-6
        assert pair.advised is None
    assert slip_load(path) == pytest.approx(sum(p.held.friction * p.normal_force for p in checked(path)), rel=0.02)


def test_with_the_default_solver_less_than_half_is_held_and_the_settings_that_mend_it_are_told(scene: Scene) -> None:
    """Object and finger say 0.5; both, alone and in the whole grasp, creep faster than 10 mm/s from 0.2 on."""
    path = scene(option="")
    for pair in checked(path):
        assert pair.held.friction < 0.5 * FRICTION
        assert pair.held.creep > 0.01
        assert pair.advised is not None
        assert pair.advised.friction == pytest.approx(FRICTION, rel=0.02)
        assert any(HOLDING_OPTION in line for line in pair.advice)
    assert slip_load(path) == pytest.approx(2.0 * checked(path)[0].held.friction * GRIP, rel=0.02)


@pytest.mark.parametrize("mass", [0.005, 10.0])
def test_the_object_s_mass_is_the_scene_s(scene: Scene, mass: float) -> None:
    """On it depends how fast the default solver's contact creeps, and so from which load on it slips."""
    path = scene(option='<option gravity="0 0 0" cone="elliptic"/>', mass=mass)
    assert slip_load(path) == pytest.approx(2.0 * checked(path)[0].held.friction * GRIP, rel=0.02)


MESH = '<mesh name="block" vertex="{}"/>'.format(
    " ".join(f"{x} {y} {z}" for x in (-0.02, 0.02) for y in (-0.02, 0.02) for z in (-0.03, 0.02))
)
SHAPES = {
    "sphere on box": {"pad": 'type="sphere" size=".008"'},
    "box on cylinder": {"target": f'type="cylinder" size=".02 .03" {LIKE_PADS}'},
    "capsule on ellipsoid": {
        "pad": 'type="capsule" size=".006 .01"',
        "target": f'type="ellipsoid" size=".02 .02 .03" {LIKE_PADS}',
    },
    "box on mesh": {"asset": MESH, "target": f'type="mesh" mesh="block" {LIKE_PADS}'},
}


@pytest.mark.parametrize("shape", SHAPES)
def test_friction_is_measured_on_any_shape(scene: Scene, shape: str) -> None:
    for pair in checked(scene(**SHAPES[shape])):
        assert pair.held.friction == pytest.approx(FRICTION, rel=0.02)


def test_between_the_edges_of_a_pyramid_less_is_held(scene: Scene) -> None:
    """A pyramidal cone has the written friction along its edges only; an impratio of 1000 leaves no creep to tell."""
    stiff = '<option gravity="0 0 0" cone="pyramidal" impratio="1000"/>'
    pair, _ = checked(scene(option=stiff, target=f'{BOX} friction="1 .005 .0001"', pad=f"{PAD}"))
    assert pair.held.friction == pytest.approx(math.sqrt(0.5), rel=0.05)


def test_a_pair_that_parts_before_the_end_keeps_the_friction_it_had(tmp_path: Path) -> None:
    """The engine writes the contacts of a step over those of the one before."""
    (tmp_path / "bounces.xml").write_text(
        """<mujoco><worldbody><geom name="floor" type="plane" size="2 2 .1" friction=".1 .005 .0001"/>
        <body pos="0 0 .08"><freejoint/><geom name="bounces" size=".05" friction=".9 .005 .0001" solref="-20000 -1"/>
        </body><body pos=".5 0 .0499"><freejoint/><geom name="rests" size=".05" friction=".3 .005 .0001"/></body>
        </worldbody></mujoco>"""
    )
    found = check_scene(tmp_path / "bounces.xml", seconds=0.14).pairs
    assert {pair.geoms: pair.friction for pair in found} == {("floor", "bounces"): 0.9, ("floor", "rests"): 0.3}


def test_adhesion_adds_to_what_is_held(scene: Scene) -> None:
    adhesive = pairs(".5 .5").replace("/>", ' adhesion="0.5"/>')
    pair, _ = checked(scene(contact=adhesive))
    assert pair.held.friction == pytest.approx(FRICTION * (GRIP + 4 * 0.5) / GRIP, rel=0.02)  # four corners


def test_the_friction_that_is_wanted_comes_as_a_pair_that_then_holds_it(scene: Scene) -> None:
    (left, right), wanted = checked(scene(target=BOX), friction=0.45), 0.45
    lines = [next(line for line in pair.advice if "<pair" in line) for pair in (left, right)]
    mended = scene(target=BOX, contact="".join(line[line.index("<pair") :] for line in lines))
    for pair in checked(mended, friction=wanted):
        assert pair.rule == "pair"
        assert pair.held.friction == pytest.approx(wanted, rel=0.02)
        assert pair.advice == ()


WEIGHTLESS = '<option gravity="0 0 0"/>'
SMOOTH = {"option": WEIGHTLESS, "contact": pairs(".5 .5").replace("<pair", '<pair condim="1"')}


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        (SMOOTH, 'condim="1" has no friction'),
        ({"pad": 'type="sphere" size=".008"'}, "turns freely about its normal"),
        ({"target": f'{BOX} friction="1000"'}, "no material has a friction of 1e+03"),
        ({"option": OVERRIDE}, 'take <flag override="enable"/> out'),
        ({"target": f'{BOX} priority="1"'}, "only a pair is safe"),
    ],
)
def test_what_is_wrong_with_a_pair_is_advised(scene: Scene, parts: dict[str, str], said: str) -> None:
    lines = checked(scene(**parts))[0].advice
    assert sum(said in line for line in lines) == 1


def test_a_contact_without_friction_holds_nothing(scene: Scene) -> None:
    pair, _ = checked(scene(**SMOOTH))
    assert pair.friction == 0.0
    assert pair.held.friction < 1e-3


def test_a_shape_that_cannot_be_taken_out_is_left_out_by_name(tmp_path: Path) -> None:
    path = tmp_path / "hills.xml"
    path.write_text(
        """<mujoco><asset><hfield name="h" nrow="3" ncol="3" size="1 1 .1 .1" elevation="0 0 0 0 0 0 0 0 0"/></asset>
        <worldbody><geom name="hills" type="hfield" hfield="h"/>
        <geom name="table" type="box" size=".1 .1 .1" pos="3 0 -.1"/>
        <body pos="0 0 .05"><freejoint/><geom name="ball" size=".05"/></body>
        <body pos="3 0 .05"><freejoint/><geom name="box" type="box" size=".05 .05 .05"/></body></worldbody></mujoco>"""
    )
    check = check_scene(path)
    assert [pair.geoms for pair in check.pairs] == [("table", "box")]
    assert check.left_out == (
        "the shape of hills is hfield; allowed: plane, sphere, capsule, ellipsoid, cylinder, box, mesh",
    )


def test_flexible_bodies_are_left_out_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # where MuJoCo writes its warnings
    path = tmp_path / "cloth.xml"
    path.write_text(
        """<mujoco><worldbody><geom name="table" type="plane" size="1 1 .1"/>
        <flexcomp name="cloth" type="grid" count="3 3 1" spacing=".02 .02 .02" pos=".3 0 .02" dim="2" mass=".01"/>
        <body pos="0 0 .05"><freejoint/><geom name="box" type="box" size=".05 .05 .05"/></body></worldbody></mujoco>"""
    )
    check = check_scene(path, seconds=0.2)
    assert [pair.geoms for pair in check.pairs] == [("table", "box")]
    assert check.left_out == ("cloth is a flexible body",)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"keyframe": "open"}, "keyframe is 'open'; allowed: closed"),
        ({}, "what touches after 1 s is nothing; allowed: geoms that press"),
        ({"seconds": math.nan}, r"seconds is nan; allowed: 0\.1 to 1000 s"),
        ({"friction": 0.0}, "friction is 0.0; allowed: 1e-05 to 100"),
    ],
)
def test_what_cannot_be_is_named(scene: Scene, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidArgument, match=message):
        check_scene(scene(option=WEIGHTLESS), **options)


def test_a_file_that_mujoco_refuses_is_named(tmp_path: Path) -> None:
    (tmp_path / "no.xml").write_text("<mujoco><worldbody><geom/></worldbody></mujoco>")
    with pytest.raises(
        InvalidArgument, match=r"model no\.xml is refused: [^;]*size 0[^;]*; allowed: MJCF that MuJoCo loads"
    ):
        check_scene(tmp_path / "no.xml")


def test_a_scene_that_diverges_is_named_once_and_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "stiff.xml").write_text(
        """<mujoco><option timestep=".05"/><worldbody><geom type="plane" size="1 1 1"/><body pos="0 0 .1">
        <joint name="z" type="slide" axis="0 0 1"/><geom size=".1" mass="1"/></body></worldbody>
        <actuator><general joint="z" biastype="affine" biasprm="0 0 1e6"/></actuator></mujoco>"""
    )
    with pytest.raises(InvalidArgument, match="the scene is unstable"):
        check_scene(tmp_path / "stiff.xml")
    assert capfd.readouterr() == ("", "")
    assert [path.name for path in tmp_path.iterdir()] == ["stiff.xml"]
    assert mujoco.get_mju_user_warning() is None


def test_the_command_prints_a_table_with_advice(scene: Scene, capsys: pytest.CaptureFixture[str]) -> None:
    cli.app(["check-scene", str(scene(option="")), "--keyframe", "closed"], standalone_mode=False)
    text = capsys.readouterr().out
    assert "grasp.xml after 1 s: 2 pairs of geoms touch" in text
    assert "left_pad – object: the larger of left_pad (0.5) and object (0.5)" in text
    assert f"  put {HOLDING_OPTION} into the model" in text


def test_the_command_prints_json(scene: Scene, capsys: pytest.CaptureFixture[str]) -> None:
    cli.app(["check-scene", str(scene()), "--keyframe", "closed", "--json"], standalone_mode=False)
    told = json.loads(capsys.readouterr().out)
    assert told["scene"] == "grasp.xml"
    assert [pair["geoms"] for pair in told["pairs"]] == [["left_pad", "object"], ["right_pad", "object"]]
    assert told["pairs"][0]["held"]["friction"] == pytest.approx(FRICTION, rel=0.02)


def test_without_mujoco_the_command_says_what_to_install(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    path = scene()
    for name in [name for name in sys.modules if name.startswith("stiction_client.mujoco_scene")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delattr("stiction_client.mujoco_scene")
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(InvalidArgument, match=r"mujoco is not installed; allowed: mujoco-core, by the extra"):
        cli.app(["check-scene", str(path)], standalone_mode=False)
