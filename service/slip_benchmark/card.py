"""The data card that goes with a benchmark."""

from collections import Counter

from service.slip_benchmark.folder import Manifest
from service.slip_benchmark.kinds import KINDS, Kind, faults_of
from service.slip_benchmark.scenes import FORMAT, VERSION

LICENCE = "MIT"

_TEXT = """# Stiction slip benchmark

**This is simulation, not measurement.** {count} grasps were simulated by Stiction's contact mechanics (boundary
elements; pillars in closed form) and given faults of sensors. A method that does well here is shown to cope with that
mechanics and those faults, and with nothing else of a real sensor.

- Format: `{format}` version {version}, made by {made_by}. Licence: {licence}, as Stiction itself.
- Seal, the SHA-256 of the phrase: `{seal}`. Whoever has the phrase makes the same scenes again with
  `stiction benchmark make --phrase TEXT --scenes {count} --output FOLDER`. Scores on a phrase that was known before
  a method was finished say less.
- `inputs/NAME.npz`: what the sensor measures, a Stiction log without truth. `truth/NAME.npz`: what the simulator knows.
  `results/METHOD/NAME.npz`: predictions. `manifest.json`: kind, fault and hashes of each scene. Members, units and
  metrics: docs/slip-benchmark.md of Stiction.

| kind | scenes | what it measures | elements | frames a second |
| --- | --- | --- | --- | --- |
{kinds}

Faults, and how many scenes have each: {faults}. Beside a fault of its own a sensor has 1 µm of white noise of markers;
forces have white noise of 2 mN (lattice) or 10 mN (pillars) wherever markers have any.

What is drawn: friction 0.25 to 0.9 (pillars from 0.3), constant, falling with pressure, or scattered in place; gels of
0.4 to 1.5 MPa, ν 0.42 to 0.49, radius 10 to 25 mm, contact radius (Hertz) 3 to 5.5 mm, two in five bonded to a base 4
to 8 mm below, one in four with pressing and shear coupled; rigid planes, balls and cylinders; pulls, reversals,
wandering loads, twists, grips that loosen or tighten, slides and turns to gross slip, and presses alone.

What is left out: images, temperature, drift, wear, objects that roll, rock or are soft, friction that depends on speed.
"""


def data_card(manifest: Manifest) -> str:
    """The card of a benchmark, in Markdown."""
    kinds = Counter(scene.kind for scene in manifest.scenes)
    faults = Counter(scene.fault for scene in manifest.scenes)
    rows = [_row(KINDS[name], count) for name, count in sorted(kinds.items())]
    present = dict.fromkeys(fault.name for name in manifest.kinds for fault in faults_of(KINDS[name]))
    return _TEXT.format(
        count=len(manifest.scenes),
        format=FORMAT,
        version=VERSION,
        made_by=manifest.made_by,
        licence=manifest.licence,
        seal=manifest.seal,
        kinds="\n".join(rows),
        faults=", ".join(f"{name} ({faults[name]})" for name in present),
    )


def _row(kind: Kind, scenes: int) -> str:
    rows, columns = kind.points
    return f"| {kind.name} | {scenes} | {kind.says} | {rows} × {columns} | {kind.frame_rate:g} |"
