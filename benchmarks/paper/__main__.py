"""The paper's experiments on simulated scenes: `python -m benchmarks.paper [--output FOLDER] [--page docs/paper.md]`.

One module a figure. Prints a table a figure, writes paper.json and a PNG a picture; with ``--page`` the tables and
pictures of that page are made anew. Simulated scenes are kept under .cache, so a second run takes a minute.
"""

import argparse
import importlib
import json
import time
from pathlib import Path

from benchmarks.pages import renew, save
from benchmarks.paper.common import Finding

FIGURES = ("02", "03", "06", "07", "08", "09", "10", "13", "14", "15", "16")


def make(figure: str, pictures: Path) -> Finding:
    """Do one figure's experiment, print its table and write its pictures."""
    began = time.perf_counter()
    module = importlib.import_module(f"benchmarks.paper.figure_{figure}")
    print(f"\n{module.__doc__.splitlines()[0]}", flush=True)
    finding: Finding = module.find()
    for name, picture in finding.pictures.items():
        save(picture, pictures / f"paper-{name}.png")
    print(f"\n{finding.table}\n\n({time.perf_counter() - began:.1f} s)", flush=True)
    return finding


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results"), help="folder for JSON and pictures")
    parser.add_argument("--page", type=Path, help="page to renew, with its pictures in images/ beside it")
    parser.add_argument("--only", nargs="+", choices=FIGURES, default=FIGURES, help="these figures alone")
    arguments = parser.parse_args()
    pictures = arguments.output if arguments.page is None else arguments.page.parent / "images"
    arguments.output.mkdir(parents=True, exist_ok=True)
    pictures.mkdir(parents=True, exist_ok=True)
    findings = {figure: make(figure, pictures) for figure in arguments.only}
    numbers = {figure: finding.numbers for figure, finding in findings.items()}
    (arguments.output / "paper.json").write_text(json.dumps(numbers, indent=1), encoding="utf-8")
    if arguments.page is not None:
        renew(arguments.page, {figure: finding.table for figure, finding in findings.items()})


if __name__ == "__main__":
    main()
