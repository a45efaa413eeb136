"""Make a benchmark's folder: every scene that it lacks, its manifest and its data card."""

from collections.abc import Iterator
from concurrent.futures import Executor, as_completed
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from service import __version__, formats
from service.slip_benchmark import folder as files
from service.slip_benchmark.card import LICENCE, data_card
from service.slip_benchmark.folder import Manifest, SceneEntry, Truth, input_path, truth_path
from service.slip_benchmark.kinds import Kind
from service.slip_benchmark.scenes import FORMAT, VERSION, SealedScene, seal
from service.whole_files import write_whole
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray, FrictionLaw, GraspLog
from stiction_client import container


def make(executor: Executor, phrase: str, scenes: int, kinds: tuple[Kind, ...], folder: Path) -> Iterator[SceneEntry]:
    """Make the scenes that a folder lacks, and report each; whole ones of before are kept, and more may be asked for.

    Raises ``InvalidInput`` for an empty phrase, and for a folder of another phrase, of other kinds or another version.
    """
    if not phrase.strip():
        raise InvalidInput("phrase", repr(phrase), "some text, which nobody knew before")
    manifest = _begun(phrase, kinds, folder)
    sealed = [SealedScene(phrase, index, kinds) for index in range(scenes_in(folder, scenes))]
    entries = []
    for done in as_completed([executor.submit(make_scene, scene, folder) for scene in sealed]):
        entries.append(done.result())
        yield entries[-1]
    whole = replace(manifest, scenes=tuple(sorted(entries, key=lambda entry: entry.name)))
    card = data_card(whole)
    write_whole(folder / files.CARD, lambda beside: beside.write_text(card, encoding="utf-8"))
    files.write_manifest(folder, whole)


def _begun(phrase: str, kinds: tuple[Kind, ...], folder: Path) -> Manifest:
    """The folder's manifest: a new one without scenes, or that of a benchmark of the same phrase."""
    manifest = Manifest(seal(phrase), tuple(kind.name for kind in kinds), LICENCE, f"stiction {__version__}")
    if not (folder / files.MANIFEST).exists():
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise InvalidInput("folder", folder, "a new or empty one, or one with a benchmark of the same phrase")
        files.write_manifest(folder, manifest)
        return manifest
    known = files.read_manifest(folder)
    if replace(known, scenes=()) != manifest:
        made = f"made by {known.made_by} of {'this' if known.seal == manifest.seal else 'another'} phrase"
        description = f"{folder}, {made} for kinds {', '.join(known.kinds)}"
        raise InvalidInput("folder", description, "one of the same phrase, kinds and version, or a new one")
    return known


def scenes_in(folder: Path, asked: int) -> int:
    """How many scenes a folder will have: as many as are ``asked`` for, or those that it has if these are more."""
    return max(asked, len(files.read_manifest(folder).scenes) if (folder / files.MANIFEST).exists() else 0)


def make_scene(scene: SealedScene, folder: Path) -> SceneEntry:
    """Make a scene's files, unless both are there and whole."""
    seen_path, true_path = input_path(folder, scene.name), truth_path(folder, scene.name)
    if not (files.is_whole(seen_path) and files.is_whole(true_path)):
        true, seen = scene.make()
        truth = truth_of(true)
        files.write_arrays(true_path, {entry.name: getattr(truth, entry.name) for entry in fields(Truth)})
        log = _without_truth(scene, seen)
        write_whole(seen_path, lambda beside: container.write(log, beside))
    return _entry(scene, folder)


def _without_truth(scene: SealedScene, seen: GraspLog) -> GraspLog:
    kind, _ = scene.sensor
    return replace(
        seen, truth=None, sensor=kind.name, metadata={"benchmark": f"{FORMAT} {VERSION}", "scene": scene.name}
    )


def truth_of(log: GraspLog) -> Truth:
    """What the simulator knows of a log, as the truth file has it."""
    known, force = log.truth, log.force
    assert known is not None
    assert force is not None
    slip = known.slip_contact_factor & known.contact
    touching, slipping = known.contact.sum(axis=(1, 2)), slip.sum(axis=(1, 2))
    return Truth(
        time=log.time,
        contact=known.contact,
        slip=slip,
        slip_kinematic=known.slip_kinematic & known.contact,
        macro_slip=(touching > 0) & (touching == slipping),
        stick_ratio=np.where(touching > 0, 1.0 - slipping / np.maximum(touching, 1), np.nan),
        stick_area_ratio=known.stick_ratio,
        displacement=log.displacement.astype(np.float32),
        force=force.astype(np.float32),
        object_pose=np.zeros((len(log), 3)) if log.object_pose is None else log.object_pose,
        friction_law=np.array([*known.friction.coefficients, known.friction.scale]),
        friction=np.array(_acting(known.friction, force, slip)),
    )


def _acting(law: FrictionLaw, force: FloatArray, slip: BoolArray) -> float:
    """Friction of the law at the mean normal force, weighted by force, of what slips (of all, where nothing does)."""
    normal = np.maximum(-force[..., 2], 0.0)
    weight = normal * slip if slip.any() else normal
    at_rest, _, of_force = law.coefficients
    return at_rest + of_force * float((weight * normal).sum() / weight.sum())


def _entry(scene: SealedScene, folder: Path) -> SceneEntry:
    kind, fault = scene.sensor
    seen_path, true_path = input_path(folder, scene.name), truth_path(folder, scene.name)
    log = formats.read(seen_path)
    return SceneEntry(
        name=scene.name,
        kind=kind.name,
        fault=fault.name,
        marker_noise=fault.marker_noise,
        force_noise=(kind.force_noise or 0.0) if fault.marker_noise else 0.0,
        frames=len(log),
        elements=log.grid,
        input_sha256=files.sha256(seen_path),
        truth_sha256=files.sha256(true_path),
    )
