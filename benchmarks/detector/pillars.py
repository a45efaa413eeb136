"""Grasps by arrays of 3 × 3 elastic pillars at 1000 frames a second (service/slip_benchmark/pillars.py)."""

from dataclasses import dataclass

from benchmarks.detector.scenes import Case, phases
from service.slip_benchmark.pillars import PillarGrasp


@dataclass(frozen=True, slots=True)
class Grasp(PillarGrasp):
    """A grasp whose loading phases are known, too."""

    def log(self) -> Case:
        """The grasp without noise, and its phases."""
        log = self.simulate()
        return Case(self.name, log, phases(log))


def tuning() -> list[Grasp]:
    """Grasps that defaults may be chosen on."""
    return [
        Grasp("ramp", 0.5, (0.0, 0.2, 0.7, 0.9, 2.4), (-1e-4, -1e-4, 1.2e-3, 1.2e-3, 1.2e-3),
              x=(0.0, 0.0, 0.0, 0.0, 1.9e-3), tilt=(0.02, -0.01), seed=1),
        Grasp("twist", 0.4, (0.0, 0.2, 0.7, 0.9, 2.2), (-1e-4, -1e-4, 1.0e-3, 1.0e-3, 1.0e-3),
              yaw=(0.0, 0.0, 0.0, 0.0, 0.16), tilt=(0.0, 0.03), seed=2),
        Grasp("to and fro", 0.7, (0.0, 0.2, 0.6, 1.3, 2.3, 2.9), (-1e-4, -1e-4, 9e-4, 9e-4, 9e-4, 9e-4),
              x=(0.0, 0.0, 0.0, 1.5e-3, -0.9e-3, 0.2e-3), seed=3),
        Grasp("grip fades", 0.35, (0.0, 0.2, 0.7, 1.2, 1.5, 2.8), (-1e-4, -1e-4, 1.6e-3, 1.6e-3, 1.6e-3, 0.5e-3),
              y=(0.0, 0.0, 0.0, 6e-4, 6e-4, 6e-4), tilt=(-0.02, 0.0), seed=4),
        Grasp("grip rises", 0.45, (0.0, 0.2, 0.6, 1.4, 1.6, 2.1, 2.8), (-1e-4, -1e-4, 7e-4, 7e-4, 7e-4, 1.3e-3, 1.3e-3),
              x=(0.0, 0.0, 0.0, 7e-4, 7e-4, 7e-4, 1.7e-3), seed=5),
        Grasp("pull and hold", 0.9, (0.0, 0.2, 0.7, 1.6, 2.8), (-1e-4, -1e-4, 9e-4, 9e-4, 9e-4),
              x=(0.0, 0.0, 0.0, 1.1e-3, 1.1e-3), y=(0.0, 0.0, 0.0, -0.9e-3, -0.9e-3), tilt=(0.03, 0.02), seed=6),
        Grasp("press only", 0.5, (0.0, 0.2, 0.9, 1.4), (-1e-4, -1e-4, 1.5e-3, 1.5e-3), tilt=(0.01, 0.0), seed=7),
    ]  # fmt: skip


def scoring() -> list[Grasp]:
    """Grasps that are only scored on."""
    return [
        Grasp("slow ramp", 0.6, (0.0, 0.3, 0.9, 1.1, 3.4), (-1e-4, -1e-4, 8e-4, 8e-4, 8e-4),
              y=(0.0, 0.0, 0.0, 0.0, -1.6e-3), tilt=(-0.03, 0.01), seed=21),
        Grasp("quick ramp", 0.38, (0.0, 0.2, 0.5, 0.6, 1.0), (-1e-4, -1e-4, 1.4e-3, 1.4e-3, 1.4e-3),
              x=(0.0, 0.0, 0.0, 0.0, -1.5e-3), seed=22),
        Grasp("turn and pull", 0.55, (0.0, 0.2, 0.7, 1.5, 2.5), (-1e-4, -1e-4, 1.1e-3, 1.1e-3, 1.1e-3),
              x=(0.0, 0.0, 0.0, 2e-4, 1.4e-3), yaw=(0.0, 0.0, 0.0, 0.06, 0.08), seed=23),
        Grasp("swing", 0.45, (0.0, 0.2, 0.7, 1.3, 2.3, 3.2), (-1e-4, -1e-4, 1.2e-3, 1.2e-3, 1.2e-3, 1.2e-3),
              y=(0.0, 0.0, 0.0, 1.3e-3, -1.0e-3, 0.6e-3), tilt=(0.01, 0.02), seed=24),
        Grasp("grip loosens", 0.5, (0.0, 0.2, 0.7, 1.3, 1.5, 3.0), (-1e-4, -1e-4, 1.5e-3, 1.5e-3, 1.5e-3, 4e-4),
              x=(0.0, 0.0, 0.0, -5e-4, -5e-4, -5e-4), y=(0.0, 0.0, 0.0, 5e-4, 5e-4, 5e-4), seed=25),
        Grasp("grip tightens", 0.65, (0.0, 0.2, 0.6, 1.3, 2.0, 3.0), (-1e-4, -1e-4, 6e-4, 6e-4, 1.2e-3, 1.2e-3),
              x=(0.0, 0.0, 0.0, 8e-4, 1.0e-3, 2.3e-3), tilt=(0.0, -0.02), seed=26),
        Grasp("lift and hold", 0.8, (0.0, 0.2, 0.8, 1.8, 3.0), (-1e-4, -1e-4, 1.0e-3, 1.0e-3, 1.0e-3),
              y=(0.0, 0.0, 0.0, 1.5e-3, 1.5e-3), tilt=(0.02, 0.02), seed=27),
        Grasp("press and let go", 0.5, (0.0, 0.2, 0.8, 1.6), (-1e-4, -1e-4, 1.6e-3, -1e-4), tilt=(0.0, 0.02), seed=28),
    ]  # fmt: skip


def cases(which: str) -> list[Case]:
    """The cases of the set ``tuning`` or ``scoring``."""
    return [grasp.log() for grasp in {"tuning": tuning, "scoring": scoring}[which]()]
