"""What a sensor smoothed is sharpened before slip is looked for."""

import math

from slipcore.defaults import SMOOTHING, ContactOptions, FilterOptions
from slipcore.finding import Finding
from slipcore.frames import FloatArray, GraspLog
from slipcore.surface.smoothing import kernel_width, unsmoothed


def kernels_of(log: GraspLog) -> dict[str, float]:
    """Options of method "filter", m: how widely a sensor smooths displacement and forces, as far as noise shows it."""
    pitch, widths = math.sqrt(log.element_area), {}
    if log.has_displacement:
        widths["marker_kernel"] = pitch * kernel_width(log.time, log.displacement, SMOOTHING.least_noise)
    if log.force is not None:
        widths["force_kernel"] = pitch * kernel_width(log.time, log.force, SMOOTHING.least_force_noise)
    return {name: width for name, width in widths.items() if width > 0.0}


def sharpened(
    displacement: FloatArray, force: FloatArray | None, options: ContactOptions, element_area: float
) -> tuple[FloatArray, FloatArray | None]:
    """Displacement and force [..., n, m, 3] without the smoothing that the options give; the same if they give none."""
    if not isinstance(options, FilterOptions):
        return displacement, force
    pitch, noise = math.sqrt(element_area), options.smoothing_noise
    if options.marker_kernel > 0.0:
        displacement = unsmoothed(displacement, options.marker_kernel / pitch, noise)
    if options.force_kernel > 0.0 and force is not None:
        force = unsmoothed(force, options.force_kernel / pitch, noise)
    return displacement, force


def smoothing_found(kernels: dict[str, float]) -> tuple[Finding, ...]:
    """What a history says of smoothing that was estimated from its log."""
    names = {"marker_kernel": "displacement", "force_kernel": "forces"}
    widths = [f"{names[name]} over {1e3 * width:.3g} mm" for name, width in kernels.items()]
    if not widths:
        return ()
    evidence = f"noise of neighbours goes together as if {' and '.join(widths)} were smoothed (standard deviation)"
    return (Finding("smoothed", evidence, "record fields that are not smoothed; slip is found from sharpened ones"),)
