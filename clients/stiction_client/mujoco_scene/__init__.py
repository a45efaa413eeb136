"""What the contacts of a MuJoCo scene really hold, measured in MuJoCo itself (extra ``mujoco``)."""

from stiction_client.mujoco_scene.check import PairCheck, SceneCheck, check_scene
from stiction_client.mujoco_scene.holding import Held
from stiction_client.mujoco_scene.rule import Rule

__all__ = ["Held", "PairCheck", "Rule", "SceneCheck", "check_scene"]
