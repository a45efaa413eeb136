"""The same against a service: upload a grasp, wait for the fit, plan from the model that it stored.

stiction serve &
STICTION_URL=http://127.0.0.1:8000 python examples/use_a_service.py
"""

from slipcore.contact import tangential_ramp
from stiction_client import FrictionClient, required_normal_force

log = tangential_ramp(friction=0.4, points=12, pitch=1e-3, marker_noise=1e-6, force_noise=2e-3, seed=1)
with FrictionClient() as client:  # the address is that of STICTION_URL, the access key that of STICTION_KEY
    client.ensure_material("felt")
    receipt = client.upload(log, material="felt")
    client.wait(receipt.job).raise_for_status()
    model = client.model("felt")
grip = required_normal_force(model, tangential_load=1.5, contact_area=6e-5, slip_probability=0.01)
print(f"version {model.version} of {model.n} samples: press with {grip.normal_force:.2f} N to bear 1.5 N")
