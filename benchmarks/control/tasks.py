"""Tasks of grip control: twelve lifts, those of the paper's Fig. 19, and two protocols of SimReady.

An object that is lifted stands on a table at first, which lets go of it within 1 s.
"""

import math
from dataclasses import replace

from benchmarks.control.episodes import Task
from slipcore.contact.reduced import GRAVITY, Load

LIFT, LIFTED = 0.5, 1.5
"""s at which the table begins to let go, and has let go."""

PAPER_ON_RUBBER = 0.45
"""Friction of the tasks that say no other."""

TWIST, SEATED = 2.0, 2.4
"""s at which the cap begins to turn, and its thread to draw."""
CUT, THROUGH, INSERTED = 3.0, 4.0, 5.5
"""s at which the knife meets the skin, is through it, and is in its place."""

TAKEN = 0.15
"""s within which a gripper that rises takes over the weight."""
SHAKEN, RATE = 2.5, 2.0 * math.pi * 2.0
"""s at which both protocols of SimReady begin to shake, and by how many rad/s."""


def rise(time: float, start: float, lasts: float) -> float:
    """0 before ``start``, 1 after ``start + lasts``, evenly between, s."""
    return min(max((time - start) / lasts, 0.0), 1.0)


def on_table(time: float) -> float:
    """Share of the weight that the table still bears."""
    return 1.0 - rise(time, LIFT, LIFTED - LIFT)


def lift(mass: float, friction: float) -> Task:
    """Lift ``mass`` kg a finger and hold it."""
    name = f"lift, {mass * GRAVITY:.1f} N, μ {friction:g}"
    return Task(name, (friction,), 6.0, lambda t: Load(mass, on_table(t)))


def sudden(name: str, within: float) -> Task:
    """Fig. 19(a): a load and a twist come onto a held banana ``within`` seconds, and go again after a second."""

    def load(time: float) -> Load:
        share = rise(time, 4.0, within) - rise(time, 5.0, within)
        return Load(0.1, on_table(time), (0.8 * share, 0.0), 1e-3 * share)

    return Task(name, (PAPER_ON_RUBBER,), 7.0, load)


def shell() -> Task:
    """Fig. 19(b): a sea shell that breaks under twice of what it needs, lifted within 0.3 s and then pulled at."""

    def load(time: float) -> Load:
        return Load(0.08, 1.0 - rise(time, LIFT, 0.3), (0.0, 0.3 * rise(time, 4.0, 2.0)))

    return Task("fragile shell", (PAPER_ON_RUBBER,), 7.0, load, limit=2.0 * 0.08 * GRAVITY / PAPER_ON_RUBBER)


def cup() -> Task:
    """Fig. 19(c): water runs into a cup that is held."""
    return Task(
        "cup being filled", (PAPER_ON_RUBBER,), 7.0, lambda t: Load(0.05 + 0.15 * rise(t, 2.0, 3.0), on_table(t))
    )


def cap() -> Task:
    """Fig. 19(d): a cap is screwed on: its thread takes up the torque fast, then draws ever tighter."""

    def load(time: float) -> Load:
        moment = 2.5e-3 * rise(time, TWIST, SEATED - TWIST) + 2.5e-3 * rise(time, SEATED, 3.0)
        return Load(0.05, 1.0, (0.0, 0.0), moment)

    return Task("bottle cap, twisted", (PAPER_ON_RUBBER,), 7.0, load)


def block() -> Task:
    """Fig. 19(e): a block is pulled out between two fingers, and its friction against the one below grows within
    150 ms. Its two faces differ in friction; each finger presses by itself, and its neighbours bear the difference.
    """

    def load(time: float) -> Load:
        pull = 0.8 * rise(time, 2.0, 0.3) + 1.6 * rise(time, 4.0, 0.15)
        return Load(0.1, on_table(time), (pull, 0.0))

    return Task("block, friction jumps", (PAPER_ON_RUBBER, 0.6), 7.0, load)


def knife() -> Task:
    """Fig. 19(f): a knife is pushed into a fruit, which resists until its skin breaks, turns the knife in the hand,
    and in the end bears most of its weight.
    """

    def load(time: float) -> Load:
        skin = rise(time, CUT, THROUGH - CUT - 0.1) - 0.6 * rise(time, THROUGH - 0.1, 0.15)
        resists = skin - 0.4 * rise(time, INSERTED, 0.5)
        return Load(0.1, max(on_table(time), 0.7 * rise(time, INSERTED, 0.5)), (-2.2 * resists, 0.0), 1.5e-3 * resists)

    return Task("knife in a fruit", (PAPER_ON_RUBBER,), 8.5, load)


def grasp_and_lift() -> Task:
    """SimReady FET005, grasp_and_lift 1.3.0: lifted 0.3 m within 1 s by a smoothstep, held 1 s, shaken on a circle of
    1 cm at 2 Hz for 1.5 s, which swells and fades within 0.25 s, held 1 s, and let go. Of the circle, one axis lies in
    the contact.
    """

    def load(time: float) -> Load:
        envelope = rise(time, SHAKEN, 0.25) - rise(time, SHAKEN + 1.25, 0.25)
        shaken = 0.01 * RATE**2 * envelope * math.sin(RATE * (time - SHAKEN))
        return _carried(0.1, time, height=0.3, shaken=(0.0, shaken))

    return Task("SimReady FET005", (PAPER_ON_RUBBER,), 5.0, load, opens=True)


def close_and_lift() -> Task:
    """SimReady FET028, gripper_close_lift_cube 1.4.0, with 85 % of a payload of 0.2 kg a finger: lifted 0.2 m within
    1 s, shaken up and down by 2 cm at 2 Hz for 2 s, and let go. That it is held for a second between is ours.
    """

    def load(time: float) -> Load:
        shakes = SHAKEN <= time < SHAKEN + 2.0
        shaken = -0.02 * RATE**2 * math.sin(RATE * (time - SHAKEN)) if shakes else 0.0
        return _carried(0.85 * 0.2, time, height=0.2, shaken=(shaken, 0.0))

    return Task("SimReady FET028", (PAPER_ON_RUBBER,), 4.5, load, opens=True)


def _carried(mass: float, time: float, height: float, shaken: tuple[float, float]) -> Load:
    """A load lifted by ``height`` m, and its inertia under accelerations ``shaken`` (m/s², up and sideways)."""
    share = (time - LIFT) / (LIFTED - LIFT)
    lifting = 6.0 * height * (1.0 - 2.0 * share) / (LIFTED - LIFT) ** 2 if 0.0 <= share < 1.0 else 0.0
    taken = rise(time, LIFT, TAKEN)
    return Load(mass, 1.0 - taken, (mass * (taken * lifting + shaken[0]), mass * shaken[1]))


def slippery(friction: float) -> Task:
    """The lift of 1 N with an object of this friction, of which strategies are told that it is rubber on paper."""
    task = lift(0.1, friction)
    return replace(task, told=(PAPER_ON_RUBBER,), seconds=3.0)


LIFTS = tuple(lift(mass, friction) for friction in (0.3, 0.45, 0.7) for mass in (0.05, 0.1, 0.15, 0.2))
PAPER = (sudden("sudden load and twist", 0.15), shell(), cup(), cap(), block(), knife())
TASKS = (*LIFTS, *PAPER)
STEP = sudden("the same within 30 ms", 0.03)
"""Faster than a gripper's lag and two frames together: reported beside the others."""
ALL = (*TASKS, STEP)
PROTOCOLS = (grasp_and_lift(), close_and_lift())
