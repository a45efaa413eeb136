"""Simulate a grasp with known truth to an accuracy, and score a detector against that truth.

python examples/simulate_to_an_accuracy.py
"""

import numpy as np

import slipcore
from slipcore.contact import Finger, Press, Scene, simulate
from slipcore.contact.effects import ForceNoise, MarkerNoise, SensorSampling, TangentialLoad

scene = Scene(
    "pulled",
    effects=(
        TangentialLoad((2.5, 0.0), start=0.5, duration=1.0),
        MarkerNoise(1e-6),
        ForceNoise(2e-3),
        SensorSampling(points=(12, 12), pitch=1.2e-3, frame_rate=20.0),
    ),
    finger=Finger(radius=15e-3, young_modulus=1e6, poisson_ratio=0.49),
    friction=0.4,
    press=Press(force=10.0, duration=0.5),
    duration=1.5,
)
log = simulate(scene, accuracy=0.05)
found = slipcore.detect_slip(log, lookahead=2)
wrong = np.nanmax(np.abs(found.stick_ratio - log.truth.stick_ratio)[log.time > 0.5])
print(f"simulated by {log.metadata['tier']} in {float(log.metadata['seconds']):.2f} s")
print(f"{log.truth.stick_ratio[-1]:.2f} of the contact sticks at the end; the detector is at most {wrong:.2f} away")
