"""Friction models of two public records: `python -m benchmarks.estimators.friction_records [--output FOLDER]`.

Rock gouge under a velocity step (Giacomel et al., 2024, MIT) and a reciprocating friction bench at 200 Hz
(FrictionModels.jl, MIT), read from `../shared/data` beside the project. Prints the fitted models, writes pictures.
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import savgol_filter

import estimators
from slipcore.samples import FrictionSamples

DATA = Path(__file__).parents[3] / "shared" / "data"
AREA = 1e-4
"""m²; taken for both records, which do not state theirs: forces of the rock are stresses on one square centimetre."""
ROCKS = {"sepiolite": "velstep3_TR2_exp013_sepiolite", "basalt": "velstep4_BRAVA_expb819_basalt"}


def samples_of(time: np.ndarray, v: np.ndarray, f_n: np.ndarray, mu: np.ndarray) -> FrictionSamples:
    """One contact, observed over time."""
    one = np.ones(len(mu))
    return FrictionSamples(mu, v, f_n, mu * f_n, time, np.zeros(len(mu), dtype=np.int64), one, AREA)


def rock(name: str) -> FrictionSamples:
    """Load-point velocity from a smoothed displacement; friction and normal stress as recorded."""
    time, displacement, mu, stress = np.loadtxt(DATA / "rock_velstep" / f"{ROCKS[name]}.txt.gz", skiprows=1).T
    even = np.arange(time[0], time[-1], np.median(np.diff(time)))
    smooth = savgol_filter(np.interp(even, time, displacement), 101, 1, deriv=1, delta=even[1] - even[0])
    v = np.maximum(np.interp(time, even, smooth) * 1e-6, 0.0)
    return samples_of(time, v, stress * 1e6 * AREA, mu)


def bench(*, from_middle: bool = False) -> FrictionSamples:
    """Sliding parts of the loaded record: the position moves at more than half of its usual speed.

    ``from_middle``: only the second half of each stroke, well beyond the elastic ramp after a reversal.
    """
    path = DATA / "friction_bench_200hz" / "test_data_2.txt.gz"
    time, normal, position, friction = np.loadtxt(path, skiprows=1).T
    rate = savgol_filter(position, 21, 1, deriv=1, delta=0.005) * 1e-3
    v, loaded = np.abs(rate), normal > 0.9 * np.median(normal)
    sliding = loaded & (v > 0.5 * np.median(v[loaded]))
    if from_middle:
        middle = 0.5 * (position[loaded].min() + position[loaded].max())
        sliding &= rate * (position - middle) > 0.0
    mu = np.abs(friction) / np.where(loaded, normal, 1.0)
    return samples_of(time[sliding], v[sliding], normal[sliding] * 1e-6, mu[sliding])


def table(name: str, data: FrictionSamples, methods: tuple[str, ...]) -> dict[str, estimators.FrictionModel]:
    """Fit by each method and print a line a method."""
    v, f_n = data.tangential_velocity, data.normal_force
    print(
        f"\n## {name}: {len(data)} samples, v {v.min():.3g} to {v.max():.3g} m/s, "
        f"f_n {f_n.min():.5g} to {f_n.max():.5g} N\n"
    )
    print(
        "| method | μ at the median v and f_n | β₁, s/m | σ | known: β₀, β₁, β₂ | remark |\n|---|---|---|---|---|---|"
    )
    models = {method: estimators.fit(data, method=method, accuracy=0.05) for method in methods}
    for method, model in models.items():
        told = model.diagnostics
        known = ", ".join("yes" if flag else "no" for flag in model.identifiable)
        slope = f"{model.coefficients[1]:.4g} ± {0.5 * float(np.diff(model.interval()[1])[0]):.2g}"
        moved = told.get("prior_sensitivity_beta1")
        pull = "" if moved is None else f"a prior twice as wide moves β₁ by {moved:.2g} sd"
        remark = told.get("chosen_because", pull)
        level = float(model.predict(np.median(v), np.median(f_n)))
        print(f"| {method} | {level:.4f} | {slope} | {model.scale:.4f} | {known} | {remark} |")
    return models


def picture(name: str, data: FrictionSamples, model: estimators.FrictionModel, path: Path) -> None:
    """Friction over time and over velocity, with the model's mean and 5 to 95 % band."""
    figure = Figure(figsize=(10.0, 4.0), layout="constrained")
    over_time, over_velocity = figure.subplots(1, 2, sharey=True)
    shown = slice(None, None, max(len(data) // 4000, 1))
    v, f_n = data.tangential_velocity[shown], data.normal_force[shown]
    over_time.plot(data.time[shown], data.friction_coefficient[shown], ".", markersize=1, color="0.5")
    over_time.plot(data.time[shown], model.predict(v, f_n), "C0-", linewidth=1)
    over_time.set_xlabel("time, s")
    over_time.set_ylabel("friction coefficient")
    across, middle = np.linspace(v.min(), v.max(), 200), np.median(f_n)
    over_velocity.plot(v * 1e6, data.friction_coefficient[shown], ".", markersize=1, color="0.5", label="samples")
    over_velocity.plot(across * 1e6, model.predict(across, middle), "C0-", label="fitted mean")
    low, high = model.predict(across, middle, 0.05), model.predict(across, middle, 0.95)
    over_velocity.fill_between(across * 1e6, low, high, alpha=0.25, label="5 to 95 % in a new record")
    over_velocity.set_xlabel("velocity, µm/s")
    over_velocity.legend(loc="best", markerscale=6)
    figure.suptitle(f"{name}: {model.method}")
    figure.savefig(path, dpi=120)


def main() -> None:
    """Both records, if they are at hand."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--output", type=Path, default=Path("benchmark-output"))
    output = parser.parse_args().output
    if not DATA.is_dir():
        parser.exit(1, f"the records are not at hand: no folder {DATA}\n")
    output.mkdir(parents=True, exist_ok=True)
    for name in ROCKS:
        data = rock(name)
        models = table(f"rock gouge, {name}", data, ("ols", "robust", "conjugate"))
        picture(f"Rock gouge under a velocity step, {name}", data, models["ols"], output / f"records-{name}.png")
    data = bench()
    models = table("friction bench", data, ("ols", "robust", "conjugate", "auto"))
    picture("Reciprocating friction bench", data, models["robust"], output / "records-bench.png")


if __name__ == "__main__":
    main()
