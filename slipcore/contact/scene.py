"""Scenes: a finger, an object, a press, and the effects that a scene calls for."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from slipcore.contact.effects import EFFECTS
from slipcore.contact.kernels import HalfSpace
from slipcore.contact.plan import Effect, Plan, ramp
from slipcore.contact.problem import HeightField, Problem
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray, FrictionLaw

if TYPE_CHECKING:
    from slipcore.contact.explain import Explanation

LIBRARY = Path(__file__).parent / "scenes"


@dataclass(frozen=True, slots=True)
class Finger:
    """A gel fingertip: ``radius`` m (inf for a flat one), ``young_modulus`` Pa, ``poisson_ratio``, ``thickness`` m of
    the gel.

    The gel is a half-space to the solver unless the scene has a bonded layer; its thickness tells whether it should.
    """

    radius: float = 15e-3
    young_modulus: float = 1e6
    poisson_ratio: float = 0.49
    thickness: float = float("inf")

    def __post_init__(self) -> None:
        for name in ("radius", "thickness"):
            if not getattr(self, name) > 0.0:
                raise InvalidInput(f"{name} of the finger", getattr(self, name), "above 0 m, inf for none")

    def height(self) -> HeightField:
        """Gap to a flat object."""
        half = 0.5 / self.radius

        def paraboloid(x: FloatArray, y: FloatArray) -> FloatArray:
            return half * (x**2 + y**2)

        return paraboloid


@dataclass(frozen=True, slots=True)
class Press:
    """Normal ``force`` N, reached within ``duration`` s from the begin, then held."""

    force: float = 10.0
    duration: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.force < np.inf:
            raise InvalidInput("press.force", self.force, "finite and at least 0 N")


@dataclass(frozen=True, slots=True)
class Scene:
    """A grasp to simulate: ``friction`` is the Coulomb coefficient, ``duration`` s covers press and all that follows.

    What is not among the ``effects`` does not happen: no tangential load, a rigid flat object, a half-space, friction
    that is the same everywhere, a log of every cell and step. Raises ``InvalidInput``.
    """

    name: str
    effects: tuple[Effect, ...] = ()
    finger: Finger = field(default_factory=Finger)
    friction: float = 0.4
    press: Press = field(default_factory=Press)
    duration: float = 2.0
    description: str = ""

    def __post_init__(self) -> None:
        if not 0.0 < self.duration < np.inf:
            raise InvalidInput("duration", self.duration, "finite and above 0 s")
        self.plan()

    @classmethod
    def from_toml(cls, path: str | Path) -> "Scene":
        """Read a scene file; a bare name is one of the library's."""
        path = Path(path)
        if not path.suffix and not path.exists():
            path = LIBRARY / f"{path}.toml"
        if not path.exists():
            raise InvalidInput("scene", path, "a TOML file, or one of " + ", ".join(library()))
        try:
            entries = tomllib.loads(path.read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise InvalidInput("scene file", path, f"TOML ({error})") from error
        return cls.from_mapping(entries)

    @classmethod
    def from_mapping(cls, entries: Mapping[str, Any]) -> "Scene":
        """A scene from the entries of a scene file; effects are tables with a ``kind``."""
        entries = dict(entries)
        effects = tuple(_effect(dict(table)) for table in entries.pop("effect", ()))
        parts = {name: _record(kind, entries.pop(name)) for name, kind in _PARTS.items() if name in entries}
        return _record(cls, entries | parts | {"effects": effects})

    def plan(self, seed: int = 0) -> Plan:
        """The scene with all its effects added, in an order that does not depend on how they are listed."""
        finger = self.finger
        body = HalfSpace.from_young(finger.young_modulus, finger.poisson_ratio)
        plan = Plan(
            problem=Problem((body,), self.friction, heights=(finger.height(),)),
            duration=self.duration,
            histories=(ramp("normal_force", self.press.force, 0.0, self.press.duration),),
            law=FrictionLaw((self.friction, 0.0, 0.0)),
            young_modulus=finger.young_modulus,
            poisson_ratio=finger.poisson_ratio,
            seed=seed,
        )
        for effect in sorted(self.present(), key=lambda effect: (type(effect).__name__, repr(effect))):
            plan = effect.extend(plan)
        return plan.check()

    def present(self) -> tuple[Effect, ...]:
        """The effects that have any strength."""
        return tuple(effect for effect in self.effects if not effect.absent)

    def explain(self, seed: int = 0) -> "Explanation":
        """What each effect is there for, what it costs and what leaving it out would change, by coarse runs."""
        from slipcore.contact.explain import explain

        return explain(self, seed)


Record = TypeVar("Record")
_PARTS: dict[str, type[Any]] = {"finger": Finger, "press": Press}


def library() -> list[str]:
    """Names of the scenes that come with the package."""
    return sorted(path.stem for path in LIBRARY.glob("*.toml"))


def _effect(table: dict[str, Any]) -> Effect:
    kind = table.pop("kind", None)
    if kind not in EFFECTS:
        raise InvalidInput("kind of effect", kind, ", ".join(sorted(EFFECTS)))
    return _record(EFFECTS[kind], table)


def _record(kind: type[Record], entries: Mapping[str, Any]) -> Record:
    """A record from a table, refused where the table has a key that the record has not."""
    known = [entry.name for entry in fields(kind)]  # type: ignore[arg-type]
    for name in entries:
        if name not in known:
            raise InvalidInput(f"entry of {kind.__name__}", name, ", ".join(known))
    try:
        return kind(**{name: _frozen(value) for name, value in entries.items()})
    except TypeError as error:
        raise InvalidInput(kind.__name__, entries, f"all of its entries, of their types ({error})") from error


def _frozen(value: Any) -> Any:
    return tuple(_frozen(part) for part in value) if isinstance(value, list) else value
