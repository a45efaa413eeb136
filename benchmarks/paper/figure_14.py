"""Fig. 14: twelve objects of the household, lifted."""

from benchmarks.paper.common import Finding, scene_log
from benchmarks.paper.stick_ratios import compare, detect_all, draw
from slipcore.contact.scene import library


def find() -> Finding:
    """Stick ratio of each method against the truth."""
    names = [name for name in library() if name.startswith("household_")]
    logs = {name.removeprefix("household_").replace("_", " "): scene_log(name) for name in names}
    histories = detect_all(logs)
    text, rows = compare(logs, histories)
    return Finding({"14": draw(logs, histories, columns=4, height=1.7)}, text, {"rows": rows})
