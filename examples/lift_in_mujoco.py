"""Lift a box in MuJoCo with the friction that a service has learnt: what is planned holds; with 20 % less it slips.

stiction serve &
STICTION_URL=http://127.0.0.1:8000 python examples/lift_in_mujoco.py
"""

from collections.abc import Iterator

import mujoco
import numpy as np

from slipcore.contact import tangential_ramp
from stiction_client import Contact, FrictionClient, FrictionModel, antipodal, mujoco_pair, required_normal_force
from stiction_client.exports import HOLDING_OPTION

MASS, HEIGHT = 0.2, 0.1
"""kg of the box, and m by which it is lifted."""
CLOSED, UP, END = 0.5, 1.5, 2.5
"""s at which the fingers have closed, the hand is up, and the lift ends."""
SURPLUS = 1.1
"""Of the weight: the hand's acceleration is up to 6 % of gravity."""

TIPS = antipodal(Contact.round(6e-5, at_force=5.0))  # 60 mm² under 5 N

SCENE = """<mujoco>{option}<default><default class="arm">
  <geom type="capsule" size=".006" mass=".05" contype="0" conaffinity="0" rgba=".4 .43 .5 1"/></default></default>
<visual><global offwidth="640" offheight="640"/></visual>
<asset><texture type="skybox" builtin="gradient" rgb1="1 1 1" rgb2=".8 .85 .9" width="64" height="384"/></asset>
<worldbody>
  <light pos=".2 -.4 .8" dir="-.3 .5 -1"/>
  <camera name="front" pos="0 -.42 .12" xyaxes="1 0 0 0 0 1"/>
  <geom name="table" type="plane" size=".3 .3 .01" rgba=".75 .7 .62 1"/>
  <body name="box" pos="0 0 .03"><freejoint/>
    <geom name="box" type="box" size=".02 .02 .03" mass="{mass}" rgba=".82 .6 .3 1"/></body>
  <body name="hand" pos="0 0 .13"><joint name="lift" type="slide" axis="0 0 1" damping="50"/>
    <geom type="box" size=".06 .015 .01" mass=".5" contype="0" conaffinity="0" rgba=".4 .43 .5 1"/>
    <body pos="-.05 0 -.09"><joint name="left" type="slide" axis="1 0 0" damping="5"/>
      <geom class="arm" fromto="0 0 0 0 0 .08"/>
      <geom name="left" type="sphere" size=".012" mass=".02" rgba=".15 .15 .18 1"/></body>
    <body pos=".05 0 -.09"><joint name="right" type="slide" axis="-1 0 0" damping="5"/>
      <geom class="arm" fromto="0 0 0 0 0 .08"/>
      <geom name="right" type="sphere" size=".012" mass=".02" rgba=".15 .15 .18 1"/></body>
  </body>
</worldbody>
<contact>{pairs}</contact>
<actuator><position joint="lift" kp="5000" dampratio="1"/><motor joint="left"/><motor joint="right"/></actuator>
</mujoco>"""


def learnt() -> FrictionModel:
    """The material's friction, from four grasps as a sensor would have seen them: μ = 0.45, give or take 0.02."""
    frictions = 0.45 + 0.02 * np.random.default_rng(7).standard_normal(4)
    with FrictionClient() as client:  # the address is that of STICTION_URL, the access key that of STICTION_KEY
        client.ensure_material("lifted box")
        for seed, friction in enumerate(frictions):
            sensor = {"points": 12, "pitch": 1e-3, "marker_noise": 1e-6, "force_noise": 2e-3}
            log = tangential_ramp(friction=friction, seed=seed, **sensor)
            client.wait(client.upload(log, material="lifted box").job).raise_for_status()
        client.wait(client.fit("lifted box", method="hierarchical")).raise_for_status()
        return client.model("lifted box", method="hierarchical")


def scene(model: FrictionModel, force: float, share: float = 1.0) -> mujoco.MjModel:
    """The hand over the box; between fingertips and box ``share`` of the friction that the model promises."""
    pairs = ""
    for finger in ("left", "right"):
        pair = mujoco_pair(model, (finger, "box"), force, TIPS.contact, quantile=0.01)
        friction = [share * pair.sliding, share * pair.sliding, share * pair.torsional, 1e-5, 1e-5]
        pairs += f'<pair geom1="{finger}" geom2="box" condim="4" friction="{" ".join(map(str, friction))}"/>'
    return mujoco.MjModel.from_xml_string(SCENE.format(option=HOLDING_OPTION, mass=MASS, pairs=pairs))


def lift(model: mujoco.MjModel, force: float) -> Iterator[mujoco.MjData]:
    """Close the fingers with ``force`` N each, lift and hold: the scene at each of its steps."""
    data = mujoco.MjData(model)
    while data.time < END:
        share = min(max((data.time - CLOSED) / (UP - CLOSED), 0.0), 1.0)
        height = HEIGHT * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)  # of least jerk
        data.ctrl[:] = height, force, force
        mujoco.mj_step(model, data)
        yield data


def slipped(model: mujoco.MjModel, force: float) -> float:
    """How far, m, the box has come down between the fingers since they closed."""
    closed = apart = 0.0
    for data in lift(model, force):
        apart = float(data.body("hand").xpos[2] - data.body("box").xpos[2])
        closed = apart if data.time <= CLOSED else closed
    return max(apart - closed, 0.0)


def main() -> None:
    """Ask, plan, lift."""
    model = learnt()
    load = SURPLUS * MASS * 9.81
    force = required_normal_force(model, load, 0.01, contacts=TIPS, normal_force_limit=30.0).normal_force
    print(f"press each finger with {force:.2f} N")
    for share in (1.0, 0.8):
        down = slipped(scene(model, force, share), force)
        print(f"with {share:.0%} of that friction the box slips {1e3 * down:.1f} mm")


if __name__ == "__main__":
    main()
