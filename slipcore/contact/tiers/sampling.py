"""From fields on the solver's grid to a sensor's points, elements and frames, in the contract's frame (z outward)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipcore.contact.defaults import ACCURACY, CHEAP_TIERS
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.plan.plan import Plan, SamplingPlan
from slipcore.contact.solver.state import StepResult
from slipcore.contact.tiers.free_grid import FreeSensorGrid
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray, GraspLog, GroundTruth


@dataclass(frozen=True, slots=True)
class SensorGrid:
    """Sensor points on a grid: ``points`` along x and y, each the centre of ``cells`` × ``cells`` cells (an odd
    number).
    """

    grid: Grid
    points: tuple[int, int]
    cells: int

    @property
    def pitch(self) -> float:
        """Distance of points, m."""
        return self.cells * self.grid.pitch[0]

    def at_points(self, field: FloatArray) -> FloatArray:
        """Values [..., n, m] of a field [..., ny, nx] at the points, x along the first axis."""
        inside = field[..., *self._inside()]
        middle = self.cells // 2
        return np.swapaxes(inside[..., middle :: self.cells, middle :: self.cells], -1, -2)

    def holds_at_points(self, mask: BoolArray) -> BoolArray:
        """Whether a mask [..., ny, nx] holds at the points [..., n, m]."""
        return self.at_points(mask.view(np.uint8)).astype(bool)

    def stick_ratio(self, result: StepResult) -> float:
        """Stick area over contact area, by cells."""
        return result.stick_ratio

    def over_elements(self, field: FloatArray) -> FloatArray:
        """Sums [..., n, m] of a field [..., ny, nx] over the elements around the points."""
        inside = field[..., *self._inside()]
        n, m = self.points
        blocks = inside.reshape(*field.shape[:-2], m, self.cells, n, self.cells)
        return np.swapaxes(blocks.sum(axis=(-3, -1)), -1, -2)

    def position(self) -> FloatArray:
        """Rest positions [n, m, 3] m."""
        x, y = self.grid.points()
        places = np.stack((x, y, np.zeros_like(x)))
        return np.moveaxis(self.at_points(places), 0, -1).astype(np.float64)

    def _inside(self) -> tuple[slice, slice]:
        (ny, nx), (n, m) = self.grid.shape, self.points
        first_y, first_x = (ny - m * self.cells) // 2, (nx - n * self.cells) // 2
        return slice(first_y, first_y + m * self.cells), slice(first_x, first_x + n * self.cells)


def sensor_grid(sampling: SamplingPlan | None, reach: float, cells_across: int) -> SensorGrid:
    """Points and grid for a contact that reaches ``reach`` m from the centre, with that many cells across it at least.

    Points are cell centres, so that the truth at a point is exact. Without a sensor every cell is a point.
    """
    width = 2.0 * reach
    if sampling is None:
        return SensorGrid(Grid.square(cells_across, width), (cells_across, cells_across), 1)
    cells = max(int(np.ceil(cells_across * sampling.pitch / width)), 1)
    cells += 1 - cells % 2
    pitch = sampling.pitch / cells
    needed = int(np.ceil(width / pitch))
    sides = [max(count * cells, needed) for count in sampling.points]
    nx, ny = (side + (side - count * cells) % 2 for side, count in zip(sides, sampling.points, strict=True))
    return SensorGrid(Grid((ny, nx), (pitch, pitch)), sampling.points, cells)


def frame_times(plan: Plan) -> FloatArray:
    """Times of the frames, from zero to the end of the scene; raises ``InvalidInput`` where that is one alone."""
    rate = ACCURACY.frames / plan.duration if plan.sampling is None else plan.sampling.frame_rate
    # A whole number of frames stays one in spite of rounding.
    last = np.floor(plan.duration * rate * (1.0 + CHEAP_TIERS.rounding))
    if last < 1.0:
        allowed = f"{1.0 / plan.duration:.3g} 1/s or more, for two frames in the scene's {plan.duration:g} s"
        raise InvalidInput("frame_rate of SensorSampling", f"{rate:g} 1/s", allowed)
    return np.asarray(np.arange(last + 1.0) / rate)


@dataclass(frozen=True, slots=True, eq=False)
class FrameRecord:
    """One frame at the points: [n, m, 3] and [n, m], z outward."""

    displacement: FloatArray
    force: FloatArray
    pose: FloatArray
    contact: BoolArray
    moved: BoolArray
    at_limit: BoolArray
    stick_ratio: float


def frame_record(grid: SensorGrid | FreeSensorGrid, steps: Sequence[StepResult]) -> FrameRecord:
    """What the sensor sees at the end of the steps since the last frame; a point moved if it did in any of them."""
    last = steps[-1]
    outward = np.array([1.0, 1.0, -1.0])
    moved = np.logical_or.reduce([step.moved for step in steps])
    return FrameRecord(
        displacement=np.moveaxis(grid.at_points(last.displacement), 0, -1) * outward,
        force=np.moveaxis(grid.over_elements(last.force), 0, -1) * outward,
        pose=last.pose,
        contact=grid.holds_at_points(last.contact),
        moved=grid.holds_at_points(moved),
        at_limit=grid.holds_at_points(last.at_limit),
        stick_ratio=grid.stick_ratio(last),
    )


def untouched(grid: SensorGrid | FreeSensorGrid) -> FrameRecord:
    """A frame before anything touches."""
    nothing, none = np.zeros((*grid.points, 3)), np.zeros(grid.points, dtype=bool)
    return FrameRecord(nothing, nothing, np.zeros(3), none, none, none, float("nan"))


def grasp_log(
    plan: Plan,
    grid: SensorGrid | FreeSensorGrid,
    time: FloatArray,
    frames: Sequence[FrameRecord],
    metadata: dict[str, str],
) -> GraspLog:
    """The log of all frames, with truth and before any observation effect."""
    force = np.stack([frame.force for frame in frames])
    truth = GroundTruth(
        contact=np.stack([frame.contact for frame in frames]),
        slip_kinematic=np.stack([frame.moved for frame in frames]),
        slip_contact_factor=np.stack([frame.at_limit for frame in frames]),
        stick_ratio=np.array([frame.stick_ratio for frame in frames]),
        friction=plan.law,
    )
    return GraspLog(
        time=time,
        position=grid.position(),
        displacement=np.stack([frame.displacement for frame in frames]),
        element_area=grid.pitch**2,
        force=force,
        normal=np.broadcast_to([0.0, 0.0, 1.0], force.shape),  # linear theory: loads act on the undeformed plane
        object_pose=np.stack([frame.pose for frame in frames]),
        sensor="simulated",
        metadata=metadata,
        truth=truth,
    )
