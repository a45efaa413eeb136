"""Fig. 15: one object lifted with five grip forces."""

from benchmarks.paper.common import NOISE, Finding, scene_log
from benchmarks.paper.stick_ratios import compare, detect_all, draw
from slipcore.contact.scene import library


def find() -> Finding:
    """Stick ratio of each method against the truth, and where each lift ends."""
    names = sorted(name for name in library() if name.startswith("lifting_"))
    logs = {f"{int(name[8:10])} N": scene_log(name, *NOISE) for name in names}
    histories = detect_all(logs)
    text, rows = compare(logs, histories)
    ends = {grip: float(log.truth.stick_ratio[-1]) for grip, log in logs.items() if log.truth is not None}
    return Finding({"15": draw(logs, histories, columns=5)}, text, {"rows": rows, "final stick ratio": ends})
