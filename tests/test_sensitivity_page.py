"""Each default is on the sensitivity page, or stands here with the reason why it is not."""

import re
from collections.abc import Iterator
from pathlib import Path

from slipcore import METHODS
from slipcore.options import describe_options
from tests.test_defaults import MODULES

PAGE = Path(__file__).parents[1] / "docs/sensitivity.md"

ABSENT: dict[str, dict[str, str]] = {
    "not measured yet": {
        "slipcore.defaults.NOISE": "finest_step lasting_told least_inner least_series least_step series step_levels",
        "slipcore.defaults.SMOOTHING": (
            "frequencies largest_still least_elements least_force_noise least_noise whole widest"
        ),
        "slipcore.defaults.NUMERICS": ("least_element_force least_lever least_spread stretch_variance yaw_variance"),
        "slipcore.defaults.MARKERS": (
            "farthest narrowest neighbours sparsest touching_noise touching_quantile touching_share"
        ),
        "slipcore.defaults.PATCHES": "least_square_arm",
        "slipcore.defaults.COLLECTION": "agreement least_samples",
        "slipcore.defaults.SATURATION": "compared distinct elements equal growth least_others ring",
        "slipcore.contact.defaults.INTERIOR": "most_points",
        "slipcore.contact.defaults.PROJECTION": (
            "bracket certificate flat growth longest ridge search_steps slope tight"
        ),
        "slipcore.contact.defaults.STEP": "barred_tolerance mixing_depth mixing_rank sliding_step steady",
        "slipcore.contact.defaults.ACCURACY": (
            "coarsest_error fewest_frames held_back largest_order last_growth least_growth "
            "least_order overdrawn overhead_cells overhead_spread runs_at_least scouting_share "
            "step_order telling_growth telling_part tightest tried_orders usual_order "
            "usual_ratio_order"
        ),
        "slipcore.contact.defaults.CHEAP_TIERS": (
            "beam_cells beam_error beam_room beam_tolerance element_samples limit_rounding poisson_error sampling_error"
        ),
        "slipcore.contact.defaults.EXPLAIN": (
            "coupling_ratio fewest_points layer_ratio layer_shear moment_share most_runs"
        ),
        "slipcore.forces.defaults.RECONSTRUCTION": "contradicted_share contradiction largest_pressure",
        "estimators.defaults.ALARM": "least_scatter longest most_tau rate reference shift",
        "estimators.defaults.AUTOMATIC": "least_scatter",
        "estimators.defaults.CHANGE": "alarm farthest reset_after spread",
        "estimators.defaults.CLUSTERS": "by_chance least_neighbours least_places most_alike",
        "estimators.defaults.DESIGN": (
            "drop_probability elements force_spread frame_rate least_length least_scatter quantile "
            "seconds slipping velocity_spread"
        ),
        "estimators.defaults.RECOGNITION": "least_scatter level scatter_freedom scatter_nodes slope unknown",
        "estimators.defaults.POPULATION": "quantiles",
        "estimators.defaults.GRID": "beside_gains block_bytes gain_nodes least_gain",
        "estimators.defaults.IDENTIFIABILITY": "compared",
        "estimators.defaults.INFLUENCE": "lowest undone",
        "estimators.defaults.PRIOR": (
            "sensor_degrees_of_freedom sensor_scatter unknown_velocity velocity_effect velocity_tilt"
        ),
        "estimators.defaults.SAMPLING": "nearer nearer_starts",
        "filter": (
            "force_kernel hold_deviations lasting_least lasting_ratio lasting_share marker_kernel "
            "pose_noise_least smoothing_noise surroundings_jitter surroundings_least "
            "surroundings_memory surroundings_outlier surroundings_reach"
        ),
        "strain_rate_literal": "growth_share lag",
        "rigid_fit": "core_share deviation_share least_deviation",
        "deformation_gradient": "least_gradient share",
        "force_ratio": "break_away_ratio",
    },
    "needs presses with known faults": {
        "slipcore.calibration.defaults.PRESS": (
            "core_share footprint_share free_noise free_share guard held_share "
            "least_force_to_noise load_change pressed_share sideways stray_noise"
        ),
        "slipcore.calibration.defaults.ESTIMATE": (
            "confidence free_frames kernel_exponent kernel_exponent_high kernel_exponent_low "
            "kernel_exponents kernel_force_range kernel_force_to_noise kernel_frames kernel_growth "
            "kernel_margin kernel_passes kernel_reach kernel_shape_error least_memory noise_blocks "
            "noise_lags noise_memories noise_series noise_share_of_frames sideways_stiffness "
            "wide_kernel"
        ),
    },
    "says what is simulated": {
        "slipcore.contact.defaults.RAMP": (
            "frame_rate normal_force pitch poisson_ratio sphere_radius tangential_force young_modulus"
        ),
        "slipcore.contact.defaults.SCHEDULE": "hold press rest settle",
        "slipcore.contact.defaults.SCENE": "duration object_poisson_ratio press_duration random_waves",
        "slipcore.contact.defaults.WORLD": ("gel_time gravity gripper_lag gyration most_stiff rest sweeps time_step"),
    },
    "closed forms and solvers that tests compare with": {
        "slipcore.contact.defaults.REFERENCE": (
            "beam_noise beam_sweeps beam_tolerance bottomless first_pose inner_share line_nodes "
            "load_tolerance pose_step pose_tolerance series_below torsion_nodes"
        ),
    },
    "needs streams with their clock": {
        "slipcore.forces.defaults.FORCE_STREAM": (
            "compared growth growth_in_plane lattice_growth least_noise noise_change stride stride_in_plane typical"
        ),
    },
    "a fit takes minutes": {
        "slipcore.forces.defaults.GEL_CALIBRATION": (
            "alternations climbs confidence factor first_ratio first_thickness gels half_space "
            "held identified in_plane lattice least_precision least_ratio poisson_ratio_error "
            "pressed simplex step thickness_error thicknesses young_modulus_error"
        ),
    },
}
"""By reason and table, the entries that no page tells of. What is measured leaves this list."""


def entries() -> Iterator[tuple[str, str]]:
    """Every table with each of its entries, and every method with each of its options."""
    for module in MODULES:
        for label, table in vars(module).items():
            if label.isupper() and any(table is each for each in module.TABLES):
                yield from ((f"{module.__name__}.{label}", name) for name in describe_options(type(table)))
    for method, described in METHODS.items():
        yield from ((method, name) for name in describe_options(described.options))


def test_each_default_is_on_the_sensitivity_page_or_listed_with_the_reason() -> None:
    told = {name.split(".")[-1] for name in re.findall(r"`([\w.]+)`", PAGE.read_text(encoding="utf-8"))}
    absent = {(table, name) for table, name in entries() if name not in told}
    listed = {(table, name) for each in ABSENT.values() for table, names in each.items() for name in names.split()}
    assert absent - listed == set(), "measure it, or say why not"
    assert listed - absent == set(), "it is on the page, or gone"
