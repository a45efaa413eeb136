"""How long the planner's answer takes: `python -m benchmarks.planner [--output FOLDER] [--page docs/client.md]`.

CPU time of one grasp as plain numbers and of arrays of them, with load and torque on two round fingers. Beside it
SciPy's vectorised root finder (Chandrupatla's method) on the same function from a bracket, which gives the smallest
force alone, and the floor: one evaluation of the function. Writes planner.json and planner.png.
"""

import time
from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.optimize import elementwise

from benchmarks.pages import options, picture_folder, save, table, write
from stiction_client import Contact, Cost, Domain, FrictionModel, antipodal, required_normal_force
from stiction_client.elementwise import Number
from stiction_client.holding import LoadedContact
from stiction_client.quantile import FrictionQuantile

Array = NDArray[np.float64]

GRASPS = (1, 10, 100, 1_000, 10_000, 100_000)
RUNS, BATCH = 15, 100
TIPS = antipodal(Contact.round(6e-5, at_force=5.0))
MODEL = FrictionModel(
    material="paper",
    method="ols",
    version=1,
    coefficients=np.array([0.41, -0.8, -0.35]),
    covariance=np.array([[2e-5, 1e-4, -8e-5], [1e-4, 1e-2, -3e-4], [-8e-5, -3e-4, 4e-3]]),
    scale=0.021,
    n=5120,
    degrees_of_freedom=11.0,
    scatter_degrees_of_freedom=5117.0,
    domain=Domain((1e-5, 0.004), (0.002, 0.3)),
    identifiable=np.ones(3, bool),
    element_area=1e-6,
    cost=Cost(0.0),
)

QUANTILE = FrictionQuantile.of(MODEL, 0.0, 1e-3)


def main() -> None:
    """Measure, draw and write."""
    arguments = options(__doc__).parse_args()
    alone = seconds(lambda: required_normal_force(MODEL, 1.5, contacts=TIPS, torque=2e-3), BATCH)
    rows = [measured(grasps) for grasps in GRASPS]
    save(draw(rows, alone), picture_folder(arguments) / "planner.png")
    columns = ("grasps at once", "Stiction, ms", "SciPy, ms", "one evaluation, ms")
    one = ["1, as plain numbers", 1e3 * alone, "", 1e3 * seconds(lambda: surplus(1.5, 1.5, 2e-3), BATCH)]
    tables = {"planner": table(columns, [one, *(list(row.values()) for row in rows)])}
    print(tables["planner"])
    write({"one_grasp_ms": 1e3 * alone, "rows": rows}, tables, arguments, "planner.json")


def measured(grasps: int) -> dict[str, float]:
    """Milliseconds of CPU time for so many grasps at once, the methods in turn."""
    generator = np.random.default_rng(grasps)
    load, torque = generator.uniform(0.05, 4.0, grasps), generator.uniform(0.0, 0.01, grasps)
    peer, ours = bracketed(load, torque), answer(load, torque)
    np.testing.assert_allclose(peer(), ours(), rtol=1e-9)  # its tolerance
    x = np.full(grasps, 1.5)
    return {
        "grasps": grasps,
        "stiction_ms": 1e3 * seconds(ours),
        "scipy_ms": 1e3 * seconds(peer),
        "one_evaluation_ms": 1e3 * seconds(lambda: surplus(x, load, torque)),
    }


def answer(load: Array, torque: Array) -> Callable[[], Array]:
    """Our answer."""
    return lambda: required_normal_force(MODEL, load, contacts=TIPS, torque=torque).normal_force


def surplus(x: Number, load: Number, torque: Number) -> Number:
    """What friction leaves over on one finger, as a function of the cube root of its force."""
    contact = TIPS.contact
    unit = MODEL.element_area / contact.area * contact.pressure_square * 5.0 ** (2.0 / 3.0)
    moment = 0.5 * torque / (contact.torque_arm / 5.0 ** (1.0 / 3.0))
    return LoadedContact(QUANTILE, 0.5 * load, moment, unit, 3).surplus(x)[0]


def bracketed(load: Array, torque: Array) -> Callable[[], Array]:
    """SciPy's answer, from a bracket that holds all roots."""
    ends = np.full(load.size, 0.05), np.full(load.size, 3.0)
    return lambda: np.asarray(elementwise.find_root(surplus, ends, args=(load, torque)).x ** 3)


def seconds(call: Callable[[], object], batch: int = 1) -> float:
    """CPU time of one run: the median of several batches of them, after a run that doesn't count."""
    call()
    times = []
    for _ in range(RUNS):
        began = time.process_time()
        for _ in range(batch):
            call()
        times.append((time.process_time() - began) / batch)
    return float(np.median(times))


def draw(rows: list[dict[str, float]], alone: float) -> Figure:
    """Milliseconds over the number of grasps."""
    figure = Figure(figsize=(5.5, 3.6), layout="constrained")
    axes = figure.subplots()
    grasps = [row["grasps"] for row in rows]
    axes.plot(grasps, [1e3 * alone * count for count in grasps], ":", color="tab:blue", label="Stiction, one by one")
    labels = {
        "stiction_ms": "Stiction, as arrays",
        "scipy_ms": "SciPy, as arrays",
        "one_evaluation_ms": "one evaluation",
    }
    for (name, label), style in zip(labels.items(), ("o-", "s-", "--"), strict=True):
        axes.plot(grasps, [row[name] for row in rows], style, label=label, markersize=4)
    axes.set(xscale="log", yscale="log", xlabel="grasps", ylabel="CPU time, ms", ylim=(1e-3, 1e4))
    axes.legend(frameon=False, fontsize=8)
    return figure


if __name__ == "__main__":
    main()
