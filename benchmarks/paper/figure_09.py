"""Fig. 9: six objects of different shape and stiffness under combined shear and twist."""

from benchmarks.paper.common import Finding, scene_log
from benchmarks.paper.stick_ratios import compare, detect_all, draw

OBJECTS = {
    1: "sphere",
    2: "flat sphere",
    3: "ring",
    4: "square, 1 MPa",
    5: "square, 5 MPa",
    6: "soft sphere",
}


def find() -> Finding:
    """Stick ratio of each method against the truth."""
    logs = {f"{k}: {what}": scene_log(f"fig9_object{k}") for k, what in OBJECTS.items()}
    histories = detect_all(logs)
    text, rows = compare(logs, histories)
    return Finding({"09": draw(logs, histories, columns=3)}, text, {"rows": rows})
