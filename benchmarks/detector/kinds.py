"""F1 by kind of grasp, fault of the sensor, input and method: `python -m benchmarks.detector.kinds [--page PAGE]`.

The scenes of the set ``scoring``, on which nothing was chosen, in kinds; those of an independent solver; and arrays of
few elements (benchmarks/detector/coarse.py). Each with every fault of benchmarks/detector/faults.py, with each input,
by this package's method and beside it by the paper's. Says how far it has come. Writes detector_kinds.json and, on the
page, a table of each input.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass

from benchmarks.detector import coarse as detector_coarse
from benchmarks.detector.accuracy import FORCE_NOISE, INPUTS
from benchmarks.detector.faults import FAULTS, FORCE_FAULTS, MARKER_NOISE, mean_f1
from benchmarks.detector.scenes import Case, cases
from benchmarks.pages import options, picture_folder, table, write

KINDS = {
    "loads that grow": ("gentle ramp", "quick pull", "pull while turning"),
    "loads that turn back": ("screw and unscrew", "swing", "lift, hold, set down", "stage turns and slides"),
    "a grip that changes": ("grip tightens", "grip loosens"),
    "a load that wanders": ("load wanders",),
    "bars, edges, rims": ("bar across", "edge of a book", "rim of a glass"),
    "bonded gels": ("thin gel", "layer, squeezed"),
    "soft or creeping": ("soft fruit", "slow gel, twisted"),
    "rough or spotted": ("sandpaper", "wet spot"),
}
"""Scenes of the set ``scoring`` that slip."""
INDEPENDENT = "independent solver"
ARRAYS = ("6 × 6, 2 mN", "3 × 3 pillars at 1 kHz, 10 mN")
PAPERS = "strain_rate"


@dataclass(frozen=True, slots=True)
class Kind:
    """Cases without noise, the noise that they are seen with, m and N, and the method for logs with forces."""

    name: str
    cases: Sequence[Case]
    noise: tuple[float, float]
    with_forces: str

    def methods(self, inputs: str) -> tuple[str, str]:
        """The method of this package for such inputs, and the paper's."""
        return "filter" if inputs == "displacement" else self.with_forces, PAPERS


@dataclass(frozen=True, slots=True)
class Found:
    """Mean F1 of a method on a kind under a fault, with one kind of input."""

    kind: str
    fault: str
    inputs: str
    method: str
    f1: float


def kinds() -> Iterator[Kind]:
    """All kinds; the independent solver's only where its scenes are there."""
    by_name = {case.name: case for case in cases("scoring")}
    for name, scenes in KINDS.items():
        yield Kind(name, [by_name[scene] for scene in scenes], (MARKER_NOISE, FORCE_NOISE), "filter")
    if independent := list(cases("reference")):
        yield Kind(INDEPENDENT, independent, (MARKER_NOISE, FORCE_NOISE), "filter")
    for array in detector_coarse.ARRAYS:
        if array.name in ARRAYS:
            seen = [case for case in detector_coarse.seen_by(array, "scoring") if detector_coarse.slips(case)]
            yield Kind(array.name, seen, (array.marker_noise, array.force_noise), "coarse")


def faults_of(inputs: str) -> list[str]:
    """Faults that such inputs can have: those of forces, or of a pose, only where there are any."""
    return [
        *(name for name in FAULTS if inputs == "motion" or not name.startswith("noise of the pose")),
        *(name for name in FORCE_FAULTS if inputs != "displacement" and name not in FAULTS),
    ]


def measure(kind: Kind) -> Iterator[Found]:
    """Each fault with each input, by the two methods."""
    faults = FORCE_FAULTS | FAULTS
    for inputs in INPUTS:
        for fault in faults_of(inputs):
            for method in kind.methods(inputs):
                f1 = mean_f1(kind.cases, faults[fault], inputs, method, noise=kind.noise)
                yield Found(kind.name, fault, inputs, method, f1)


def tables(found: Sequence[Found]) -> dict[str, str]:
    """Of each input the faults by kinds: F1 of this package's method / the paper's."""
    names = list(dict.fromkeys(each.kind for each in found))
    pairs: dict[tuple[str, str, str], list[str]] = {}
    for each in found:
        pairs.setdefault((each.inputs, each.fault, each.kind), []).append(f"{each.f1:.2f}".removeprefix("0"))
    made = {}
    for inputs in INPUTS:
        rows = [[fault, *(" / ".join(pairs[inputs, fault, kind]) for kind in names)] for fault in faults_of(inputs)]
        made[f"kinds, {inputs}"] = table(("fault", *names), rows)
    return made


def main() -> None:
    """Measure, print and store."""
    arguments = options(__doc__).parse_args()
    picture_folder(arguments)
    every, found = list(kinds()), list[Found]()
    for number, kind in enumerate(every, 1):
        print(f"{kind.name}: {len(kind.cases)} scenes, kind {number} of {len(every)}", file=sys.stderr, flush=True)
        found += measure(kind)
    made = tables(found)
    print("\n\n".join(made.values()))
    write([asdict(each) for each in found], made, arguments, "detector_kinds.json")


if __name__ == "__main__":
    main()
