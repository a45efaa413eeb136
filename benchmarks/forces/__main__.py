"""Forces found from displacement: `python -m benchmarks.forces [--only GROUP …] [--quick]`, with `--page
docs/accuracy-forces.md` for its page.

Presses whose forces are known (benchmarks/forces/scenes.py) are seen by simulated sensors, with depth and in the plane
alone, in several draws of noise. Each factor is varied against one case (20 × 20 markers on the surface of a layer of 5
mm, ν 0.49, a sphere, 1 µm of noise): gel and noise, contact, depth of the markers, lattice, the criterion that chooses
the prior's strength, and the gel's description, which is then wrong. It is also learnt from presses
(benchmarks/forces/presses.py), frames are followed as they come (benchmarks/forces/stream.py) and found by all of a log
(benchmarks/forces/over_time.py), displacement is cut at the end of a range (benchmarks/forces/saturation.py), an
independent solver's scenes are read (benchmarks/forces/references.py), grasps are taken to friction and slip with the
gripper's force alone (benchmarks/forces/friction.py), slip is found on other sensors (benchmarks/forces/slip.py), and
maps of height are read (benchmarks/forces/height_maps.py); and gels that are not alike thick everywhere are pressed on
(benchmarks/forces/uneven.py). In the plane the normal force on a half-space is given.
Peers are given the same displacements. Errors are those of resultants, of the field of forces on elements, and their
growth with noise; how often stated intervals of 95 % hold the truth is reported for each group.

`--export FOLDER` writes the cases on which peers are tried as `.npz`; `--external NAME=FOLDER` scores what another
method made of them: files of the same names, with `force` [t, n, m, 3] N. Writes forces-GROUP.json, prints a
table a group, and draws a picture of the peers.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: what is told is the CPU time of one thread
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import get_args

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.ndimage import uniform_filter

from benchmarks.forces import friction as gel_friction
from benchmarks.forces import height_maps as gel_height_maps
from benchmarks.forces import over_time as gel_over_time
from benchmarks.forces import presses as gel_presses
from benchmarks.forces import references as gel_references
from benchmarks.forces import saturation as gel_saturation
from benchmarks.forces import slip as gel_slip
from benchmarks.forces import stream as gel_stream
from benchmarks.forces import uneven as gel_uneven
from benchmarks.forces.peers import PEERS, export, imported, made
from benchmarks.forces.presses import calibrated, calibration_table
from benchmarks.forces.scenes import CONTACTS, LATTICES, Truth, anywhere, press, repeated, seen
from benchmarks.pages import options, picture_folder, save, table, write
from slipcore import GraspLog
from slipcore.forces import Gel, reconstruct
from slipcore.forces.inverse.strength import Criterion
from slipcore.frames import BoolArray, FloatArray

NOISES = (0.0, 1e-6, 3e-6, 10e-6)
GELS = {"half-space": np.inf, "5 mm": 5e-3, "2 mm": 2e-3}
DEPTHS = (0.5e-3, 1e-3, 2e-3)
WRONG: dict[str, dict[str, float]] = {
    "E + 10 %": {"young_modulus": 1.1e6},
    "thickness + 10 %": {"thickness": 5.5e-3},
    "thickness − 10 %": {"thickness": 4.5e-3},
    "ν − 0.02": {"poisson_ratio": 0.47},
    "half-space": {"thickness": np.inf},
}
"""How a gel of 1 MPa, ν 0.49 and 5 mm is described wrong."""
PLACE = (0.21, -0.34)
"""Middle of the contact beside that of the lattice, in pitches."""
NORMAL_95 = 1.959964
STICTION = "stiction"
GROUPS = ("gel and noise", "contact", "marker depth", "lattice", "criterion", "wrong description")
PEERS_GROUP, CALIBRATION_GROUP, STREAM_GROUP, FRICTION_GROUP = "peers", "gel calibration", "stream", "friction"
SATURATION_GROUP, COVERAGE_GROUP, REFERENCES_GROUP = "saturation", "coverage", "independent scenes"
SLIP_GROUP, HEIGHT_GROUP, UNEVEN_GROUP = "slip by sensor", "height maps", "uneven gel"
OVER_TIME_GROUP = "over time"
ANYWHERE_GROUP, ANYWHERE_PRESSES = "coverage anywhere", 4
COVERAGE_DRAWS = 2
COVERED_CONTACTS = ("sphere", "ring")


@dataclass(frozen=True, slots=True)
class Case:
    """What is seen: ``wrong`` names an entry of ``WRONG``, ``given`` tells whether the normal force is, and
    ``criterion`` chooses the prior's strength.
    """

    group: str
    depth_seen: bool
    lattice: str = "20 × 20"
    gel: str = "5 mm"
    contact: str = "sphere"
    marker_depth: float = 0.0
    noise: float = 1e-6
    wrong: str = ""
    given: bool = False
    criterion: Criterion = "evidence"

    @property
    def seen(self) -> str:
        """How markers are."""
        return "with z" if self.depth_seen else "in the plane, F_z given" if self.given else "in the plane"

    def true_gel(self) -> Gel:
        """The gel that markers lie in."""
        return Gel(1e6, 0.49, GELS[self.gel], self.marker_depth)


@dataclass(frozen=True, slots=True)
class Score:
    """One method on one case: errors relative to the truth (L2 over all frames), and how many stated intervals hold it.

    ``resultant`` and ``elements``: tangential, normal; ``pooled``: these averaged over squares as wide as the
    kernel, against the truth averaged so; ``area`` of contact found over the true one; ``seconds`` of CPU: to set up,
    a frame; ``squares``, of the mean force: mean squares of errors and of stated deviations.
    """

    case: Case
    method: str
    resultant: tuple[float, float]
    elements: tuple[float, float]
    pooled: tuple[float, float]
    seconds: tuple[float, float]
    area: float = np.nan
    information: float = np.nan
    kernel: float = np.nan
    condition: float = np.nan
    inside: dict[str, tuple[int, int]] = field(default_factory=dict)
    squares: dict[str, tuple[float, float]] = field(default_factory=dict)


def cases(group: str) -> Iterator[Case]:
    """The design of a group, with depth and in the plane."""
    for depth_seen in (True, False):
        base = Case(group, depth_seen)
        half_space = replace(base, gel="half-space", given=not depth_seen)
        if group == "gel and noise":
            yield from (replace(base, noise=noise) for noise in NOISES)
            yield from (replace(other, noise=noise) for other in (half_space, replace(base, gel="2 mm"))
                        for noise in (1e-6, 10e-6))  # fmt: skip
        elif group == "contact":
            yield from (replace(base, contact=contact) for contact in CONTACTS if contact != base.contact)
        elif group == "marker depth":
            yield from (replace(half_space, marker_depth=depth) for depth in DEPTHS)
            yield replace(base, marker_depth=1e-3)
        elif group == "lattice":
            yield from (replace(base, lattice="10 × 7", noise=noise) for noise in (1e-6, 10e-6))
        elif group == "criterion":
            yield from (replace(base, noise=noise, criterion=criterion)
                        for noise in (1e-6, 10e-6) for criterion in get_args(Criterion))  # fmt: skip
        else:
            yield from (replace(base, wrong=wrong) for wrong in WRONG)


def covered() -> Iterator[Case]:
    """Cases by which stated intervals are judged: sensors, noises and two contacts, with depth and in the plane."""
    for depth_seen in (True, False):
        for gel, lattice in (*((gel, "20 × 20") for gel in GELS), ("5 mm", "10 × 7")):
            base = Case(COVERAGE_GROUP, depth_seen, lattice, gel, given=not depth_seen and gel == "half-space")
            yield from (replace(base, noise=noise, contact=contact) for noise in NOISES for contact in COVERED_CONTACTS)


def anywhere_covered() -> Iterator[Case]:
    """Those of them in the plane alone on 5 mm, where intervals are hardest."""
    for case in covered():
        if not case.depth_seen and case.gel == "5 mm" and case.noise > 0.0:
            yield replace(case, group=ANYWHERE_GROUP)


def compared() -> list[Case]:
    """Cases on which peers are tried."""
    return [replace(Case(PEERS_GROUP, depth), noise=noise) for depth in (True, False) for noise in NOISES]


def shown(case: Case, draws: int) -> tuple[Truth, GraspLog]:
    """The press, each frame as often as noise is drawn, and what the sensor shows of it."""
    lattice = LATTICES[case.lattice]
    x, y = (lattice.pitch * part for part in PLACE)
    truth = repeated(press(case.contact, case.true_gel(), lattice, (x, y)), draws)
    return truth, seen(truth.log, case.noise, case.depth_seen, np.random.default_rng(23))


def forces_of(log: GraspLog) -> FloatArray:
    """The true forces of a press."""
    assert log.force is not None
    return log.force


def shown_anywhere(case: Case, number: int) -> tuple[Truth, GraspLog]:
    """A press of another size, direction, place and load for each number, and what the sensor shows of it."""
    rng, lattice = np.random.default_rng([number, 41]), LATTICES[case.lattice]
    x, y = rng.uniform(-0.75e-3, 0.75e-3, 2)
    steps = ((rng.uniform(0.4, 0.6), 0.0), (1.0, rng.uniform(0.3, 0.6)), (1.0, rng.uniform(0.8, 1.0)))
    truth = press(anywhere(case.contact, rng), case.true_gel(), lattice, (float(x), float(y)), steps)
    return truth, seen(truth.log, case.noise, case.depth_seen, rng)


def score(case: Case, truth: Truth, log: GraspLog) -> Score:
    """The reconstruction of one press."""
    true, gel = forces_of(truth.log), replace(case.true_gel(), **WRONG.get(case.wrong, {}))
    began = time.process_time()
    found = reconstruct(log, gel, -truth.total[:, 2] if case.given else None, case.noise, case.criterion)
    seconds = time.process_time() - began
    cells = found.kernel_width / np.sqrt(log.element_area)
    touched = found.contact | (true[..., 2] < 0.0)
    everything = np.ones(len(log), dtype=bool)
    turned = np.abs(found.moment - truth.moment) <= NORMAL_95 * found.moment_deviation
    return Score(
        case,
        STICTION,
        errors(found.resultant, truth.total),
        errors(found.force, true),
        errors(pooled(found.force, cells), pooled(true, cells)),
        (np.nan, seconds / len(log)),
        float(np.mean(found.contact.sum(axis=(1, 2)) * log.element_area / truth.area)),
        float(found.information[2]),
        found.kernel_width,
        found.condition,
        {
            **inside("resultant", found.resultant - truth.total, found.resultant_deviation, everything),
            MOMENT: (int(turned.sum()), len(turned)),
            **inside("element", found.force - true, found.deviation, touched),
        },
        {
            **squares("resultant", found.resultant - truth.total, found.resultant_deviation, truth.total),
            **squares("element", (found.force - true)[touched], found.deviation[touched], true[touched]),
        },
    )


def squares(what: str, error: FloatArray, deviation: FloatArray, true: FloatArray) -> dict[str, tuple[float, float]]:
    """Mean squares of errors and of stated deviations, both over the mean square of true normal forces."""
    of_true = float(np.mean(true[..., 2] ** 2))
    parts = {"tangential": np.s_[..., :2], "normal": np.s_[..., 2]}
    return {
        f"{what}, {axis}": (float(np.mean(error[part] ** 2)) / of_true, float(np.mean(deviation[part] ** 2)) / of_true)
        for axis, part in parts.items()
    }


def inside(what: str, error: FloatArray, deviation: FloatArray, chosen: BoolArray) -> dict[str, tuple[int, int]]:
    """How many stated intervals of 95 % hold the truth, and of how many."""
    holds = np.abs(error)[chosen] <= NORMAL_95 * deviation[chosen]
    parts = {"tangential": holds[:, :2], "normal": holds[:, 2]}
    return {f"{what}, {axis}": (int(part.sum()), part.size) for axis, part in parts.items()}


def errors(found: FloatArray, true: FloatArray) -> tuple[float, float]:
    """Relative errors of what is tangential and of what is normal."""
    parts = (np.s_[..., :2], np.s_[..., 2])
    tangential, normal = (float(np.linalg.norm((found - true)[part]) / np.linalg.norm(true[part])) for part in parts)
    return tangential, normal


def pooled(force: FloatArray, cells: float) -> FloatArray:
    """Forces [t, n, m, 3] averaged over squares of about so many elements; nothing lies beyond the lattice."""
    size = max(1, 2 * round(0.5 * (cells - 1.0)) + 1) if np.isfinite(cells) else 1
    return np.asarray(uniform_filter(force, (0, size, size, 0), mode="constant"))


def peer_score(case: Case, name: str, draws: int) -> Score:
    """A linear operator on the same press."""
    truth, log = shown(case, draws)
    operator, to_make = made(name, case.true_gel(), LATTICES[case.lattice], case.depth_seen)
    began = time.process_time()
    force = operator.forces(log)
    return judged(case, name, truth, force, (to_make, (time.process_time() - began) / len(log)))


def judged(case: Case, method: str, truth: Truth, force: FloatArray, seconds: tuple[float, float]) -> Score:
    """Another method's forces, whose resultants are their sums."""
    of_field = errors(force, forces_of(truth.log))
    return Score(case, method, errors(force.sum(axis=(1, 2)), truth.total), of_field, of_field, seconds)


def exchanged(folder: Path) -> Iterator[tuple[Case, Path]]:
    """Files of the presses on which peers are tried."""
    for case in compared():
        yield case, folder / f"{'z' if case.depth_seen else 'plane'}-{1e6 * case.noise:g}um.npz"


def external_scores(name: str, folder: Path, draws: int) -> Iterator[Score]:
    """What another method made of the exported presses."""
    for case, path in exchanged(folder):
        truth, log = shown(case, draws)
        yield judged(case, name, truth, imported(path, log), (np.nan, np.nan))


def percent(values: Iterable[float]) -> str:
    """Relative errors in percent, one beside the other."""
    return " / ".join(f"{100.0 * value:.2g}" if value < 0.995 else f"{100.0 * value:.0f}" for value in values)


QUANTITIES = [f"{what}, {axis}" for what in ("resultant", "element") for axis in ("tangential", "normal")]
MOMENT = "moment about z"


def coverage(scores: Iterable[Score], names: Sequence[str] = QUANTITIES) -> list[str]:
    """Shares of intervals that hold the truth, by quantity."""
    held = [np.sum([entry.inside[name] for entry in scores], axis=0) for name in names]
    return [f"{inside / count:.0%}" for inside, count in held]


def widths(scores: Sequence[Score], name: str) -> str:
    """Root mean squares of errors and of stated deviations, in percent of the normal force."""
    return percent(np.sqrt(np.mean([entry.squares[name] for entry in scores], axis=0)))


def anywhere_table(scores: Sequence[Score]) -> str:
    """How many intervals hold the truth, by lattice, noise and contact, beside errors and deviations."""
    of_each = (each for name in QUANTITIES for each in (name, "error / deviation"))
    columns = ("markers", "noise, µm", "contact", *of_each, "frames")
    rows: list[tuple[object, ...]] = []
    for case in dict.fromkeys(entry.case for entry in scores):
        own = [entry for entry in scores if entry.case == case]
        cells = [each for name in QUANTITIES for each in (*coverage(own, [name]), widths(own, name))]
        frames = sum(entry.inside["resultant, normal"][1] for entry in own)
        rows.append((case.lattice, f"{1e6 * case.noise:g}", case.contact, *cells, frames))
    return table(columns, rows)


def errors_table(scores: list[Score]) -> str:
    """Errors of the reconstruction for each case, tangential / normal in percent, and coverage of all."""
    columns = ("seen", "gel", "contact", "markers", "depth, mm", "noise, µm", "resultant", "field", "pooled field",
               "area", "F_z from data", "kernel, mm", "condition", "inside: resultant", "inside: element")  # fmt: skip
    rows: list[tuple[object, ...]] = []
    for entry in scores:
        case, held = entry.case, coverage([entry])
        gel = f"{case.gel}, described as {case.wrong}" if case.wrong else case.gel
        gel += f", by {case.criterion}" if case.group == "criterion" else ""
        rows.append((
            case.seen, gel, case.contact, case.lattice, f"{1e3 * case.marker_depth:g}", f"{1e6 * case.noise:g}",
            percent(entry.resultant), percent(entry.elements), percent(entry.pooled), f"{entry.area:.2f}",
            f"{entry.information:.0%}", 1e3 * entry.kernel, f"{entry.condition:.0e}",
            " / ".join(held[:2]), " / ".join(held[2:]),
        ))  # fmt: skip
    return table(columns, rows)


def coverage_table(scores: list[Score]) -> str:
    """How many intervals hold the truth, by sensor and noise, contacts together."""
    quantities = (*QUANTITIES[:2], MOMENT, *QUANTITIES[2:])
    columns = ("seen", "gel", "markers", "noise, µm", *quantities, "frames")
    groups: dict[tuple[str, str, str, str], list[Score]] = {}
    for entry in scores:
        case = entry.case
        groups.setdefault((case.seen, case.gel, case.lattice, f"{1e6 * case.noise:g}"), []).append(entry)
    rows = [
        (*key, *coverage(own, quantities), sum(entry.inside["resultant, normal"][1] for entry in own))
        for key, own in groups.items()
    ]  # fmt: skip
    return table(columns, rows)


def peers_table(scores: list[Score]) -> str:
    """All methods on the sphere on 5 mm."""
    columns = ("seen", "noise, µm", "method", "resultant", "field", "CPU to set up, s", "CPU a frame, ms")
    rows = [
        (s.case.seen, f"{1e6 * s.case.noise:g}", s.method, percent(s.resultant), percent(s.elements), s.seconds[0],
         1e3 * s.seconds[1])
        for s in scores
    ]  # fmt: skip
    return table(columns, rows)


def picture(scores: list[Score]) -> Figure:
    """Error of the field against noise and against time, by method."""
    figure = Figure(figsize=(13, 7), layout="constrained")
    panels = figure.subplots(2, 3)
    for row, seen_as in zip(panels, ("with z", "in the plane"), strict=True):
        own = [s for s in scores if s.case.seen == seen_as]
        for axes, axis, k in zip(row[:2], ("tangential", "normal"), (0, 1), strict=True):
            against_noise(axes, own, k)
            axes.set_title(f"{seen_as}: {axis} forces on elements")
        against_time(row[2], [s for s in own if s.case.noise == 3e-6])
        row[2].set_title(f"{seen_as}: error against time, 3 µm")
    panels[0, 0].legend(fontsize=8, frameon=False)
    return figure


def against_noise(axes: Axes, scores: list[Score], k: int) -> None:
    """One line a method."""
    for number, method in enumerate(dict.fromkeys(s.method for s in scores)):
        own = [s for s in scores if s.method == method]
        noise, error = [1e6 * s.case.noise for s in own], [100.0 * s.elements[k] for s in own]
        axes.plot(noise, error, f"C{number}o-", label=method, markersize=4)
    axes.set_xscale("symlog", linthresh=1.0)
    axes.set(yscale="log", xlabel="noise [µm]", ylabel="relative error [%]", xticks=[0, 1, 3, 10])
    axes.set_xticklabels(["0", "1", "3", "10"])
    axes.grid(alpha=0.3)


def against_time(axes: Axes, scores: list[Score]) -> None:
    """Two points a method: tangential (circle) and normal (square)."""
    for number, entry in enumerate(scores):
        for error, marker in zip(entry.elements, "os", strict=True):
            axes.plot(1e3 * entry.seconds[1], 100.0 * error, f"C{number}{marker}")
    axes.set(xscale="log", yscale="log", xlabel="CPU a frame [ms] (circle: tangential, square: normal)")
    axes.set_ylabel("relative error [%]")
    axes.grid(alpha=0.3)


def calibrate(arguments: argparse.Namespace) -> None:
    """Learn gels from presses, a third as often as noise is drawn else: each takes half a minute."""
    found = [calibrated(*case, draws=max(1, arguments.draws // 3)) for case in gel_presses.cases()]
    text = calibration_table(found)
    print(f"{CALIBRATION_GROUP}\n\n{text}\n", flush=True)
    write([asdict(each) for each in found], {CALIBRATION_GROUP: text}, arguments, "forces-gel-calibration.json")


def follow(arguments: argparse.Namespace) -> None:
    """Frames as they come, in real time."""
    found = [gel_stream.measured(*case) for case in gel_stream.CASES]
    text = gel_stream.stream_table(found)
    print(f"{STREAM_GROUP}\n\n{text}\n", flush=True)
    write([asdict(each) for each in found], {STREAM_GROUP: text}, arguments, "forces-stream.json")


def smooth(arguments: argparse.Namespace) -> None:
    """Each frame by all of them."""
    found = list(gel_over_time.scores())
    text = gel_over_time.over_time_table(found)
    print(f"{OVER_TIME_GROUP}\n\n{text}\n", flush=True)
    write([asdict(each) for each in found], {OVER_TIME_GROUP: text}, arguments, "forces-over-time.json")


def saturate(arguments: argparse.Namespace) -> None:
    """Displacement at the end of a sensor's range."""
    found = gel_saturation.detections()
    text = gel_saturation.detection_table(found)
    print(f"{SATURATION_GROUP}\n\n{text}\n", flush=True)
    write([asdict(each) for each in found], {SATURATION_GROUP: text}, arguments, "forces-saturation.json")


def cover(arguments: argparse.Namespace) -> None:
    """Whether stated intervals hold the truth as often as they say; a line a case while it goes on."""
    found = list[Score]()
    for case in covered():
        found.append(score(case, *shown(case, COVERAGE_DRAWS)))
        about = f"{case.seen}, {case.gel}, {case.lattice}, {case.contact}, {1e6 * case.noise:g} µm"
        print(f"{about}: {', '.join(coverage(found[-1:]))}", flush=True)
    text = coverage_table(found)
    print(f"{COVERAGE_GROUP}\n\n{text}\n", flush=True)
    write([asdict(each) for each in found], {COVERAGE_GROUP: text}, arguments, "forces-coverage.json")


def cover_anywhere(arguments: argparse.Namespace) -> None:
    """The same where presses differ in size, direction, place and load; a line a case while it goes on."""
    found = list[Score]()
    for case in anywhere_covered():
        found += [score(case, *shown_anywhere(case, k)) for k in range(ANYWHERE_PRESSES)]
        print(f"{case.lattice}, {case.contact}, {1e6 * case.noise:g} µm", flush=True)
    text = anywhere_table(found)
    print(f"{ANYWHERE_GROUP}\n\n{text}\n", flush=True)
    write([asdict(each) for each in found], {ANYWHERE_GROUP: text}, arguments, "forces-coverage-anywhere.json")


def refer(arguments: argparse.Namespace) -> None:
    """Scenes whose truth is another solver's."""
    found = list(gel_references.references())
    text = gel_references.references_table(found)
    print(f"{REFERENCES_GROUP}\n\n{text}\n", flush=True)
    write([asdict(each) for each in found], {REFERENCES_GROUP: text}, arguments, "forces-independent-scenes.json")


def grip(arguments: argparse.Namespace) -> None:
    """Grasps to friction and slip, each taking seconds; lines of forces-friction.jsonl are not made again."""
    pictures = picture_folder(arguments)
    seeds = dict(zip((gel_friction.WITH_DEPTH, gel_friction.IN_PLANE), arguments.seeds, strict=True))
    found = gel_friction.campaign(arguments.output / "forces-friction.jsonl", seeds)
    tables = {FRICTION_GROUP: gel_friction.friction_table(found), "slip": gel_friction.slip_table(found)}
    save(gel_friction.picture(found), pictures / "forces-friction.png")
    for name, text in tables.items():
        print(f"{name}\n\n{text}\n", flush=True)
    write([asdict(replace(each, moments="")) for each in found], tables, arguments, "forces-friction.json")


def slip(arguments: argparse.Namespace) -> None:
    """Slip by sensors, each taking seconds; lines of forces-slip.jsonl are not made again."""
    arguments.output.mkdir(parents=True, exist_ok=True)
    found = gel_slip.campaign(arguments.output / "forces-slip.jsonl")
    text = gel_slip.slip_table(found)
    print(f"{SLIP_GROUP}\n\n{text}\n", flush=True)
    write([asdict(each) for each in found], {SLIP_GROUP: text}, arguments, "forces-slip.json")


def see_depth(arguments: argparse.Namespace) -> None:
    """Normal forces by maps of height."""
    found = [gel_height_maps.outcome(*case) for case in gel_height_maps.cases()]
    text = gel_height_maps.height_table(found)
    print(f"{HEIGHT_GROUP}\n\n{text}\n", flush=True)
    write([asdict(each) for each in found], {HEIGHT_GROUP: text}, arguments, "forces-height-maps.json")


def lean(arguments: argparse.Namespace) -> None:
    """Gels that are not alike thick everywhere; a line a case while it goes on."""
    found = list[gel_uneven.Outcome]()
    for each in gel_uneven.outcomes():
        found.append(each)
        print(each, flush=True)
    text = gel_uneven.uneven_table(found)
    print(f"{UNEVEN_GROUP}\n\n{text}\n", flush=True)
    write([asdict(each) for each in found], {UNEVEN_GROUP: text}, arguments, "forces-uneven-gel.json")


def main() -> None:
    """Measure, print and write, group by group."""
    parser = options(__doc__)
    parser.add_argument("--draws", type=int, default=5, help="of noise, for each frame")
    alone = {
        CALIBRATION_GROUP: calibrate,
        STREAM_GROUP: follow,
        OVER_TIME_GROUP: smooth,
        SATURATION_GROUP: saturate,
        COVERAGE_GROUP: cover,
        ANYWHERE_GROUP: cover_anywhere,
        REFERENCES_GROUP: refer,
        FRICTION_GROUP: grip,
        SLIP_GROUP: slip,
        HEIGHT_GROUP: see_depth,
        UNEVEN_GROUP: lean,
    }
    every = (*GROUPS, PEERS_GROUP, *alone)
    parser.add_argument("--only", nargs="+", choices=every, default=every)
    parser.add_argument("--seeds", nargs=2, type=int, default=(40, 20), help="of friction: with depth, in the plane")
    parser.add_argument("--quick", action="store_true", help="one draw of the smaller lattice alone")
    parser.add_argument("--export", type=Path, help="write the cases for other methods into this folder, and end")
    parser.add_argument("--external", action="append", default=[], metavar="NAME=FOLDER", help="score others' forces")
    arguments = parser.parse_args()
    draws = 1 if arguments.quick else arguments.draws
    if arguments.export is not None:
        arguments.export.mkdir(parents=True, exist_ok=True)
        for case, path in exchanged(arguments.export):
            truth, log = shown(case, draws)
            export(log, truth, case.true_gel(), path)
        return
    pictures = picture_folder(arguments)
    for group in ("lattice",) if arguments.quick else arguments.only:
        if group in alone:
            alone[group](arguments)
            continue
        scores = []
        for case in compared() if group == PEERS_GROUP else cases(group):
            scores.append(score(case, *shown(case, draws)))
            if group == PEERS_GROUP:
                scores += [peer_score(case, name, draws) for name in PEERS]
        if group == PEERS_GROUP:
            for entry in arguments.external:
                name, _, folder = entry.partition("=")
                scores += external_scores(name, Path(folder), draws)
            save(picture(scores), pictures / "forces.png")
        text = peers_table(scores) if group == PEERS_GROUP else errors_table(scores)
        print(f"{group}\n\n{text}\n", flush=True)
        write([asdict(entry) for entry in scores], {group: text}, arguments, f"forces-{group.replace(' ', '-')}.json")


if __name__ == "__main__":
    main()
