"""Frames of examples/lift_in_mujoco.py: `python -m benchmarks.planner.mujoco_lift [--page docs/planner.md]`.

The friction is that of a running service (STICTION_URL). MuJoCo's renderer needs PyOpenGL and a graphics library that
draws without a screen (MUJOCO_GL=egl or osmesa). Writes mujoco_lift.png and, as JSON, how far the box slips.
"""

import runpy
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from benchmarks.pages import options, picture_folder, save, write
from stiction_client import FrictionModel, required_normal_force

EXAMPLE = Path(__file__).parents[2] / "examples" / "lift_in_mujoco.py"
TIMES = (0.5, 0.8, 1.1, 1.5, 2.5)
"""s of the frames."""
SIDE = 320
"""Pixels of a frame."""
SHARES = (1.0, 0.8)
"""Of the friction that was planned with."""


def main() -> None:
    """Lift with the friction and with less, draw and write."""
    arguments = options(__doc__).parse_args()
    example = runpy.run_path(str(EXAMPLE))
    model = example["learnt"]()
    load = example["SURPLUS"] * example["MASS"] * 9.81
    force = required_normal_force(model, load, 0.01, contacts=example["TIPS"], normal_force_limit=30.0).normal_force
    figure = Figure(figsize=(2.0 * len(TIMES), 2.1 * len(SHARES)), layout="constrained")
    for axes, share in zip(figure.subplots(len(SHARES), len(TIMES)), SHARES, strict=True):
        for each, time, frame in zip(axes, TIMES, frames(example, model, force, share), strict=True):
            each.imshow(frame)
            each.set(xticks=[], yticks=[], title=f"{time:g} s" if share == SHARES[0] else "")
        axes[0].set_ylabel(f"{share:.0%} of the friction")
    save(figure, picture_folder(arguments) / "mujoco_lift.png")
    slips = {f"{share:g}": example["slipped"](example["scene"](model, force, share), force) for share in SHARES}
    print(f"{force:.2f} N; slips in m: {slips}")
    write({"normal_force": force, "slipped": slips}, {}, arguments, "mujoco_lift.json")


def frames(example: dict[str, Any], model: FrictionModel, force: float, share: float) -> list[NDArray[np.uint8]]:
    """The hand and the box at ``TIMES``, [SIDE, SIDE, 3] each."""
    scene, waiting, found = example["scene"](model, force, share), list(TIMES), []
    with mujoco.Renderer(scene, SIDE, SIDE) as renderer:
        for data in example["lift"](scene, force):
            if data.time >= waiting[0] - 1e-9:
                renderer.update_scene(data, "front")
                found.append(renderer.render())
                waiting = waiting[1:] or [np.inf]
    return found


if __name__ == "__main__":
    main()
