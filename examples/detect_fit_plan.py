"""From a grasp to a grip force, without a service: detect slip, fit the friction model, plan the next grip.

    python examples/detect_fit_plan.py

The grasp is simulated with a friction coefficient of 0.4, which the fit should find again.
"""

import estimators
import slipcore
from slipcore.contact import tangential_ramp
from stiction_client import required_normal_force

log = tangential_ramp(friction=0.4, points=12, pitch=1e-3, marker_noise=1e-6, force_noise=2e-3, seed=1)
history = slipcore.detect_slip(log, lookahead=2)
samples = slipcore.collect_samples(log, history)
fitted = estimators.fit(samples)
expected, least = (float(fitted.predict(0.0, 0.05, quantile)) for quantile in (None, 0.05))
print(f"{fitted.n} samples; friction {expected:.3f}, at least {least:.3f} in 95 of 100 grasps")

grip = required_normal_force(fitted, tangential_load=1.5, contact_area=6e-5, slip_probability=0.01)
print(f"press with {grip.normal_force:.2f} N to bear 1.5 N")
