"""What is installed: pinned versions with known content, built by a pinned backend, under licences that allow it."""

import importlib.metadata
import json
import re
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
OWN = {"stiction", "stiction-client"}


def pinned() -> dict[str, tuple[Requirement, list[str]]]:
    """Each requirement of constraints.txt with its hashes, by canonical name."""
    joined = (ROOT / "constraints.txt").read_text(encoding="utf-8").replace("\\\n", " ")
    entries = [line.split("--hash=") for line in joined.splitlines() if line.strip()]
    requirements = [(Requirement(entry[0]), [each.strip() for each in entry[1:]]) for entry in entries]
    return {canonicalize_name(requirement.name): (requirement, hashes) for requirement, hashes in requirements}


def project(folder: Path) -> dict[str, Any]:
    return tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))


def asked_for(folder: Path) -> set[str]:
    """Canonical names of all that a project asks for, its extras and its build backend included."""
    read = project(folder)
    extras = read["project"].get("optional-dependencies", {}).values()
    lines = [
        *read["build-system"]["requires"],
        *read["project"]["dependencies"],
        *(line for each in extras for line in each),
    ]
    return {canonicalize_name(Requirement(line).name) for line in lines} - OWN


PINNED = pinned()


def test_each_package_is_pinned_to_one_version_and_known_content() -> None:
    assert PINNED
    for requirement, hashes in PINNED.values():
        assert [each.operator for each in requirement.specifier] == ["=="], requirement
        assert hashes, requirement
        assert all(re.fullmatch("sha256:[0-9a-f]{64}", each) for each in hashes), requirement


@pytest.mark.parametrize("folder", [ROOT, ROOT / "clients"], ids=["stiction", "stiction-client"])
def test_all_that_a_project_asks_for_is_pinned(folder: Path) -> None:
    assert asked_for(folder) <= set(PINNED), "run `make constraints`"


@pytest.mark.parametrize("folder", [ROOT, ROOT / "clients"], ids=["stiction", "stiction-client"])
def test_the_build_backend_is_the_pinned_one(folder: Path) -> None:
    (backend,) = project(folder)["build-system"]["requires"]
    assert Requirement(backend).specifier == PINNED["setuptools"][0].specifier


def test_what_is_installed_here_is_what_is_pinned() -> None:
    different = {
        name: installed
        for name, (requirement, _) in PINNED.items()
        if requirement.marker is None or requirement.marker.evaluate()
        if (installed := importlib.metadata.version(name)) not in requirement.specifier
    }
    assert not different, "run `make setup`"


@pytest.mark.parametrize("folder", [ROOT, ROOT / "clients"], ids=["stiction", "stiction-client"])
def test_each_distribution_brings_its_licence(folder: Path) -> None:
    read = project(folder)["project"]
    assert read["license"] == "MIT"
    for file in read["license-files"]:
        assert (folder / file).read_text(encoding="utf-8").startswith("MIT License")


def test_an_image_is_built_on_a_base_of_known_content() -> None:
    text = (ROOT / "docs/deploy/Containerfile").read_text(encoding="utf-8")
    assert re.search(r"^ARG BASE=\S+@sha256:[0-9a-f]{64}$", text, re.M)
    assert re.findall(r"^FROM (\S+)", text, re.M) == ["${BASE}"]


def test_an_image_gets_all_packages_and_nothing_else() -> None:
    let_in = {line[1:] for line in (ROOT / ".containerignore").read_text().splitlines() if line.startswith("!")}
    found = project(ROOT)["tool"]["setuptools"]["packages"]["find"]["include"]
    packages = {pattern.rstrip("*") for pattern in found}
    assert let_in == packages | {"LICENSE", "README.md", "clients", "constraints.txt", "pyproject.toml"}


@pytest.mark.long
def test_a_fresh_clone_sets_itself_up_and_lists_what_it_ships(tmp_path: Path) -> None:
    clone = tmp_path / "clone"
    subprocess.run(["git", "clone", "--quiet", ROOT, clone], check=True)
    subprocess.run(["make", "--silent", "setup", "sbom", "notices"], cwd=clone, check=True, timeout=900)
    subprocess.run([clone / ".venv/bin/stiction", "--help"], check=True, stdout=subprocess.DEVNULL)
    bill = json.loads((clone / "sbom.cdx.json").read_text(encoding="utf-8"))
    components = {canonicalize_name(each["name"]): each["version"] for each in bill["components"]}
    assert bill["metadata"]["component"]["name"] == "stiction"
    assert {"fastapi", "numpy", "psycopg", "stiction-client"} <= set(components)
    assert "pytest" not in components
    assert str(tmp_path) not in json.dumps(bill)
    notices = (clone / "THIRD-PARTY-NOTICES.txt").read_text(encoding="utf-8")
    assert all(f"\n{each}\n" in f"\n{notices}" for each in ("numpy", "fastapi", "scipy"))
