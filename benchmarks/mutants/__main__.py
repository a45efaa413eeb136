"""Does a test fail when the code is changed? `python -m benchmarks.mutants [--page docs/mutants.md] [--count N] ...`.

Draws mutants of the code, tries each with the tests that run its line, and writes mutants.json. All happens in a copy
below `--work`, whose verdicts stay: a run that was stopped goes on, `--again` tries survivors once more. A change in a
function is made in place, in a process that has all modules and tests loaded and is forked for it; these come
first, then those of compiled kernels, and last what must be imported anew, as constants of a module. The first run, or
`--cover`, runs all tests once to know what they cover; `--cover tests/a.py` adds those of new tests. `--near` goes
without: a mutant is tried with the test files that have the name of its module or import it, and what survives these
may be killed by others, in a run `--again`. `--budget` is the seconds of tests for each, `--seconds` ends a run early.
`--part 1/2` and `--part 2/2` share one, each with a `--work` of its own; the files of verdicts are put together by
hand. `--only slipcore/frames.py:12` tries every mutant of a file or of one of its lines, and only prints. `--sample` is
for another sample on the same page.
"""

import argparse
import math
import shutil
import time
import tomllib
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import asdict
from pathlib import Path

from benchmarks.mutants import sample, verdicts
from benchmarks.mutants.edits import Edit, edits
from benchmarks.mutants.page import score, tables
from benchmarks.mutants.scratch_copy import ROOT, ScratchCopy
from benchmarks.mutants.verdicts import BUDGET, Court, Verdict
from benchmarks.pages import options as page_options
from benchmarks.pages import picture_folder, write

EXPLAINED = Path(__file__).with_name("explained.toml")
PAGE = Path(__file__).with_name("page.md")
"""What a page is made of that is not there yet."""


def main() -> None:
    """Draw, try, and tell."""
    options = _options()
    copy = ScratchCopy(options.work)
    copy.refresh()
    if options.cover is not None or not (options.near or copy.data.exists()):
        copy.cover(options.cover or [])
    if options.only:
        _try_place(copy, options)
    else:
        _try_sample(copy, options)


def _try_sample(copy: ScratchCopy, options: argparse.Namespace) -> None:
    drawn = sample.draw(copy.root, options.count, options.seed, options.packages)
    path = _verdicts(options)
    found = verdicts.known(path)
    waiting = [edit for edit in drawn if edit.key not in found or (options.again and not found[edit.key].is_killed)]
    part, parts = map(int, options.part.split("/"))
    waiting = waiting[part - 1 :: parts]
    if waiting and options.seconds > 0.0:
        _try(waiting, found, path, copy, options)
    _write(copy, drawn, found, options)


def _verdicts(options: argparse.Namespace) -> Path:
    return Path(options.work / f"verdicts-{options.seed}.jsonl")


def _try(
    waiting: list[Edit], found: dict[str, Verdict], path: Path, copy: ScratchCopy, options: argparse.Namespace
) -> None:
    """Add to the verdicts found, and to the file of them."""
    end, done = time.monotonic() + options.seconds, set[str]()
    with _court(copy, options) as court:
        for try_mutant in (court.try_quickly, court.try_in_place, court.try_mutant):  # what takes long comes last
            for edit in [edit for edit in waiting if edit.key not in done]:
                if time.monotonic() > end:
                    break
                if verdict := try_mutant(edit):
                    done.add(edit.key)
                    found[edit.key] = verdict
                    verdicts.append(path, verdict)
                    print(f"{len(done)}/{len(waiting)} {_line(edit, verdict)}", flush=True)


def _options() -> argparse.Namespace:
    parser = page_options(__doc__)
    parser.add_argument("--count", type=int, default=320, help="how many mutants are drawn, at least")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--packages", nargs="+", default=sample.PACKAGES, choices=sample.PACKAGES, help="drawn from")
    parser.add_argument("--seconds", type=float, default=math.inf, help="no mutant is begun after so many")
    parser.add_argument("--part", default="1/1", metavar="K/N", help="every N-th of those that wait, from the K-th on")
    parser.add_argument("--work", type=Path, default=ROOT / ".cache" / "mutants", help="the copy and all verdicts")
    parser.add_argument("--budget", type=float, default=BUDGET, help="seconds of tests that a mutant is tried with")
    parser.add_argument("--cover", nargs="*", metavar="TESTS", help="run the tests with coverage first")
    parser.add_argument("--near", action="store_true", help="do not ask first which tests run which line")
    parser.add_argument("--sample", help="its name in those of the page's tables, one of which counts first verdicts")
    parser.add_argument("--again", action="store_true", help="try survivors once more")
    parser.add_argument("--only", metavar="PLACE", help="a file, or file:line")
    return parser.parse_args()


@contextmanager
def _court(copy: ScratchCopy, options: argparse.Namespace) -> Iterator[Court]:
    paths = [path for package in sample.PACKAGES for path in sample.sources(copy.root, package)]
    with closing(Court(copy, paths, budget=options.budget, in_place=True)) as court:
        yield court


def _try_place(copy: ScratchCopy, options: argparse.Namespace) -> None:
    path, _, line = options.only.partition(":")
    with _court(copy, options) as court:
        for edit in edits(copy.root, path):
            if not line or edit.start[0] == int(line):
                print(_line(edit, court.try_mutant(edit)), flush=True)


def _line(edit: Edit, verdict: Verdict) -> str:
    place = f"{edit.path}:{edit.start[0]} {edit.old!r} → {edit.new!r}"
    found = f"killed by {verdict.by}" if verdict.is_killed else "SURVIVED"
    return f"{place} {found} ({verdict.seconds} s, {verdict.tests} tests)"


def _write(copy: ScratchCopy, drawn: list[Edit], found: dict[str, Verdict], options: argparse.Namespace) -> None:
    reasons = tomllib.loads(EXPLAINED.read_text())
    lines = sample.lines_of(copy.root, options.packages)
    made = tables(drawn, found, reasons, lines)
    if options.sample:
        first = verdicts.known(_verdicts(options), at_first_sight=True)
        made["first sight"] = score(drawn, first, reasons, lines)
        made = {f"{name} {options.sample}": table for name, table in made.items()}
    print(*made.values(), sep="\n\n")
    picture_folder(options)
    if options.page is not None and not options.page.exists():
        shutil.copyfile(PAGE, options.page)
    records = [asdict(found[edit.key]) for edit in drawn if edit.key in found]
    write(records, made, options, "mutants.json")


if __name__ == "__main__":
    main()
