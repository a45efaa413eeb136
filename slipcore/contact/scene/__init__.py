"""What users of the simulator call: scenes, their simulation and their explanation."""

from slipcore.contact.plan.description import Finger, Press
from slipcore.contact.scene.scene import LIBRARY, Scene, library
from slipcore.contact.scene.simulate import simulate

__all__ = ["LIBRARY", "Finger", "Press", "Scene", "library", "simulate"]
