"""The grip controller as pure functions: ``init`` and ``step`` (Li et al., Fig. 18)."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from stiction_client.arguments import of_kind
from stiction_client.controller.friction import KnownFriction, LearnedFriction, utilisation
from stiction_client.controller.load import LoadEstimate
from stiction_client.controller.recognition import UNKNOWN, GripRecognition
from stiction_client.controller.records import Command, Mode, Observation, SlipSamples, checked
from stiction_client.controller.relaxation import Relaxation
from stiction_client.controller.settings import ControlSettings
from stiction_client.controller.stick_ratio import StickRatioEstimate
from stiction_client.linear_friction import LinearFriction, check_model


@dataclass(frozen=True, slots=True, eq=False)
class ControllerState:
    """A controller between two frames, never written to.

    ``known``: the friction that ``hold`` goes by, None while there is none; ``learned``: friction of slipping elements;
    ``contradictions``: frames in a row that speak against ``known``; ``overloaded``: frames in a row with as much load
    as all of the contact can bear by it; ``since``: when ``mode`` began, s;
    ``doubts``: whether slip that is told may be none: while nothing is known of the object, and no alarm was raised;
    ``still``: frames in which elements were told to slip as the grip is relaxed, and hardly any moved;
    ``rested``: whether a load has come to rest, until which the first touch lasts; ``refuted``: the friction that the
    grasp had by what discarded a model as its grip was relaxed, else 0; ``relaxation``: what a grip that is being
    relaxed bears; ``recognition``: the materials that it may be of; ``material``: which it was taken for, and its
    ``probability``.
    """

    settings: ControlSettings
    known: KnownFriction | None
    mode: Mode
    normal_force: float
    time: float = -math.inf
    since: float = -math.inf
    load: LoadEstimate = field(default_factory=LoadEstimate)
    sticking: StickRatioEstimate = field(default_factory=StickRatioEstimate)
    learned: LearnedFriction = field(default_factory=LearnedFriction)
    contradictions: int = 0
    overloaded: int = 0
    doubts: bool = False
    still: int = 0
    rested: bool = False
    refuted: float = 0.0
    relaxation: Relaxation = field(default_factory=Relaxation)
    recognition: GripRecognition | None = None
    material: str | None = None
    probability: float = 0.0


class _Demand(NamedTuple):
    """A normal force, N, and what asks for it."""

    force: float
    reason: str


def init(
    settings: ControlSettings,
    model: LinearFriction | None = None,
    materials: Mapping[str, LinearFriction] | None = None,
) -> ControllerState:
    """A controller that has seen nothing; ``model``: of the object's material, where that is known.

    ``materials``: without a ``model``, those among which the object's is to be recognised, by name. Raises
    ``InvalidArgument`` for one that is called "unknown", and for what are no settings or models.
    """
    of_kind("settings", settings, ControlSettings)
    if model is not None:
        check_model(model)
        return ControllerState(
            settings, KnownFriction.of_model(model, settings), "hold", _floor(settings, rested=False)
        )
    among = GripRecognition.among(materials or {}, settings)
    return ControllerState(
        settings, None, "feel", _floor(settings, rested=False), doubts=among is None, recognition=among
    )


def step(state: ControllerState, observation: Observation) -> tuple[ControllerState, Command]:
    """Take one frame, later than the last, and say how hard to grip.

    Raises ``InvalidArgument`` for an observation that cannot be; the state before it can still be used.
    """
    of_kind("state", state, ControllerState)
    observation = checked(observation, state.time)
    state, elapsed = _taken_over(state, observation), observation.time - state.time
    seen = _decide(_sense(state, observation, elapsed), observation)
    demand = max(_demands(seen, observation), key=lambda each: each.force)
    force = _limited(seen, demand.force, elapsed)
    limited = demand.force > state.settings.most_force
    reason = f"{demand.reason}, more than most_force" if limited else demand.reason
    return replace(seen, normal_force=force), Command(force, seen.mode, reason, seen.material, seen.probability)


def _taken_over(state: ControllerState, observation: Observation) -> ControllerState:
    """With the force that a gripper already presses with in the first frame, from which commands then go on."""
    if math.isfinite(state.time):
        return state
    pressed = min(observation.normal, state.settings.most_force)
    return replace(state, normal_force=max(state.normal_force, pressed))


def _sense(state: ControllerState, observation: Observation, elapsed: float) -> ControllerState:
    """What the frame says of load and friction."""
    load = state.load.step(observation, elapsed, state.settings)
    sticking = state.sticking.step(observation, load, state.settings)
    sampled = _sampled(observation, sticking, state.settings)
    agrees = not math.isnan(sampled) and _agrees(sampled, observation.normal, sticking, load.size, state.settings)
    learned, recognition, samples = state.learned, state.recognition, observation.slip_samples
    count = 0 if samples is None else samples.normal_force.size
    counts = samples is not None and not math.isnan(sampled) and _counts(state, samples, agrees)
    covers = samples is not None and counts and _covers_ring(samples, observation, state.settings)
    if counts:
        learned = learned.with_frame(sampled, count, agrees or (covers and _has_model(state)), state.settings)
    if recognition is not None:
        ratio = sampled if counts and (agrees or covers) else math.nan
        recognition = recognition.step(observation.time, load.loads(state.settings), ratio, count, state.settings)
    against = _contradicts(state, sticking, observation.normal, load.size)
    overloaded = state.overloaded + 1 if _overloaded(state, observation.normal, load.size) else 0
    contradictions = state.contradictions if against is None else state.contradictions + 1 if against else 0
    return replace(  # once: of a step's time it takes a tenth
        state,
        time=observation.time,
        load=load,
        sticking=sticking,
        learned=learned,
        recognition=recognition,
        contradictions=contradictions,
        overloaded=overloaded,
        doubts=state.doubts and state.mode != "alarm",
        still=_still(state, observation),
        rested=state.rested or load.settled(observation.time, state.settings),
        relaxation=state.relaxation.step(load, observation.normal, relaxed=state.mode == "learn"),
    )


def _sampled(observation: Observation, sticking: StickRatioEstimate, settings: ControlSettings) -> float:
    """The contact's friction by the elements that slip; NaN without any."""
    if (
        observation.slip_samples is None
        or not (sticking.shows and sticking.stick_ratio < settings.told_stick_ratio)
        or observation.normal == 0.0
    ):
        return math.nan
    return observation.slip_samples.contact_friction()


def _agrees(
    friction: float, normal: float, sticking: StickRatioEstimate, size: float, settings: ControlSettings
) -> bool:
    """Whether the stick ratio says no otherwise of the contact's ``friction``.

    What sticks bears less than its friction: taken for slip, it would make the contact slip more than it does.
    """
    return friction >= settings.agreement_share * size / (normal * utilisation(sticking.stick_ratio))


def _counts(state: ControllerState, samples: SlipSamples, agrees: bool) -> bool:
    """Whether a frame's samples are of a ring that moves, and not of elements that rest, of which noise moves some.

    What rests bears its friction just before all of a contact slips. To a model that is then wrong it is a warning, but
    not where the grip is relaxed on purpose.
    """
    warns = agrees and _has_model(state) and not _relaxed(state)
    return warns or samples.moving >= state.settings.moving_share


def _still(state: ControllerState, observation: Observation) -> int:
    """Frames so far in which elements were told to slip as the grip is relaxed, and hardly any moved."""
    samples = observation.slip_samples
    if state.mode != "learn" or (samples is not None and samples.moving >= state.settings.moving_share):
        return 0
    return state.still + (samples is not None)


def _doubtful(state: ControllerState) -> tuple[StickRatioEstimate, float]:
    """What the stick ratio says, and the least friction, as the grip of an object of which nothing is known is relaxed.

    A ring that slips moves as the force falls: while nothing does, slip that is told is none. Samples that agree show
    the friction of a ring that is narrower than told.
    """
    settings, sticking = state.settings, state.sticking
    still, agreed = state.still >= settings.learn_frames, state.learned.agrees(settings.contradiction_frames, settings)
    return sticking.confirmed() if still else sticking, _shown(state) if agreed else sticking.least(settings)


def _covers_ring(samples: SlipSamples, observation: Observation, settings: ControlSettings) -> bool:
    """Whether samples bear enough of what presses the ring that slips by the stick ratio sr, (1 − sr)^(3/2) (Hertz).

    Then they show friction that the stick ratio, which misses slip, may contradict; a few at the rim do not.
    """
    slipping = 1.0 - observation.stick_ratio
    ring = observation.normal * slipping * math.sqrt(slipping)
    return float(samples.normal_force.sum()) >= settings.moving_share * ring


def _has_model(state: ControllerState) -> bool:
    """Whether what is known is of other grasps, which samples of this one can contradict."""
    return state.known is not None and state.known.of_others


def _relaxed(state: ControllerState) -> bool:
    """Whether a model's grip is being relaxed, to learn what friction this grasp has."""
    return state.mode == "learn" and _has_model(state)


def _contradicts(state: ControllerState, sticking: StickRatioEstimate, normal: float, size: float) -> bool | None:
    """Whether a contact slips under a load that the friction that is known holds; None where a frame says nothing."""
    if state.known is None or normal == 0.0 or math.isnan(sticking.stick_ratio):
        return None
    low, _ = state.known.bounds(normal)
    return sticking.slips(state.settings) and 0.0 < size < low * normal


def _overloaded(state: ControllerState, normal: float, size: float) -> bool:
    """Whether the load is what next to all of the contact bears, by the mean of its friction.

    A contact that slides bears no more than its friction: how much more is asked of it cannot be measured. A grip that
    is being relaxed is to show whether a grasp has more than the mean.
    """
    if state.known is None or normal == 0.0 or _relaxed(state):
        return False
    return size > utilisation(state.settings.reflex_stick_ratio) * state.known.expected(normal) * normal


def _decide(state: ControllerState, observation: Observation) -> ControllerState:
    """The mode after a frame. Evidence against what is known discards it, and all that was learnt with it."""
    settings = state.settings
    if state.relaxation.slides(state.load, state.sticking, settings):
        return _enter(_slid(state), "hold")
    if state.known is not None and _refuted(state, state.known, observation.normal):
        return _enter(_forgotten(state), "alarm")
    if state.known is not None:
        state = _sharpened(state, state.known, observation.normal)
        return _enter(state, "learn" if _unlearnt(state) and _relaxes(state, observation) else "hold")
    if (state.sticking.slips(settings) and state.load.size > 0.0) or _blind(state):
        return _enter(replace(state, since=state.time, recognition=None), "alarm")
    if state.mode == "alarm" and state.time - state.since < settings.settle_time:
        return state
    state = _recognised(state, observation.normal)
    known = state.known or state.learned.known(settings)
    if known is not None:
        return _enter(replace(state, known=known), "hold")
    return _enter(state, "learn" if _relaxes(state, observation) else "feel")


def _unlearnt(state: ControllerState) -> bool:
    """Whether what is known is of other grasps, and samples of this one are worth relaxing for."""
    return state.known is not None and state.known.of_others and not state.known.learnt


def _relaxes(state: ControllerState, observation: Observation) -> bool:
    """Whether the force may fall until enough slips to be sampled: under a load at rest, where slip can be seen."""
    return state.load.settled(state.time, state.settings) and observation.stick_ratio >= 0.0


def _slid(state: ControllerState) -> ControllerState:
    """With the friction that a contact has which slid as its grip was relaxed, whatever was known before.

    It slides on until it is pressed by more than that asks for: the load counts as overload at once.
    """
    known, frames = KnownFriction.slid(state.relaxation.bears, state.settings), state.settings.reflex_frames
    state = replace(state, known=known, overloaded=frames, recognition=None)
    return replace(state, learned=LearnedFriction(), relaxation=Relaxation())


def _forgotten(state: ControllerState) -> ControllerState:
    """Without what was known, and all that was learnt with it, but for what a grip that was being relaxed then bore.

    Before a load rests, samples are of a narrow ring, which bears less than its friction, and the load is a small one.
    """
    sampled, refuted = state.learned.mean if state.learned.values else 0.0, 0.0
    if state.mode == "learn":
        refuted = max(sampled, state.sticking.bore)
    state = replace(state, known=None, material=None, probability=0.0)
    return replace(state, learned=LearnedFriction(), contradictions=0, refuted=refuted)


def _refuted(state: ControllerState, known: KnownFriction, normal: float) -> bool:
    """Whether all samples together speak against what is known, or slip in some frames in a row does."""
    if state.contradictions >= state.settings.contradiction_frames:
        return True
    return normal > 0.0 and known.refuted(state.learned, state.load, normal, state.settings)


def _recognised(state: ControllerState, normal: float) -> ControllerState:
    """With the material that the samples of the first second speak for; once they speak for none, no more is tried."""
    settings, among = state.settings, state.recognition
    if among is None or among.frames < settings.contradiction_frames or normal == 0.0:
        return state
    name, probability = among.likeliest(normal, settings)
    if name == UNKNOWN:
        return replace(state, recognition=None)
    if among.frames < settings.recognise_frames or probability < settings.recognise_probability:
        return state
    return replace(state, known=among.materials[name], material=name, probability=probability, recognition=None)


def _sharpened(state: ControllerState, known: KnownFriction, normal: float) -> ControllerState:
    """With what this grasp's samples add; slip, where they had more friction than a model, disproves them."""
    learnt = state.learned.known(state.settings)
    if not known.of_others:
        return state if learnt is None else replace(state, known=learnt)
    if learnt is not None and normal > 0.0 and known.surpassed(state.learned, normal, state.settings):
        return replace(state, known=learnt, material=None, probability=0.0)
    if _disproves(state, known):
        return replace(state, known=known.disproved(), learned=LearnedFriction())
    sharpened = known.sharpen(state.learned, normal, state.settings)
    return state if sharpened is known else replace(state, known=sharpened)


def _disproves(state: ControllerState, known: KnownFriction) -> bool:
    """Whether slip speaks against samples that had more friction, or against relaxing the grip any further."""
    slips = state.sticking.slips(state.settings) and state.load.size > 0.0
    return slips and (known.sharpened > 1.0 or _relaxed(state))


def _enter(state: ControllerState, mode: Mode) -> ControllerState:
    return state if mode == state.mode else replace(state, mode=mode, since=state.time)


def _blind(state: ControllerState) -> bool:
    """Whether neither a model nor the stick ratio shows how hard to hold a load."""
    return (
        state.known is None
        and state.load.loads(state.settings)
        and state.time - state.sticking.time > state.settings.dropout_time
    )


def _slips(state: ControllerState) -> bool:
    """Whether next to all of the contact slips, by the detector or by what is known of friction."""
    settings = state.settings
    return state.load.size > 0.0 and (state.sticking.slips(settings) or state.overloaded >= settings.reflex_frames)


def _floor(settings: ControlSettings, rested: bool) -> float:
    """The least force, N: after a load has come to rest, and before."""
    return settings.least_force if rested else max(settings.least_force, settings.touch_force)


def _demands(state: ControllerState, observation: Observation) -> list[_Demand]:
    """All that asks for a force; the largest is followed."""
    settings = state.settings
    demands = [_Demand(_floor(settings, state.rested), "least force")]
    slips = _slips(state)
    growth = 1.0 if slips else state.load.growth(settings)  # in slip, what is measured grows with the grip
    if slips:
        demands.append(_Demand(observation.normal * (1.0 + settings.reflex_gain), "slip"))
    if state.known is not None and not _relaxed(state):
        if growth > 1.0 + settings.steady_share:
            asked = state.sticking.required(state.load.size * growth, settings.feel_stick_ratio, _shown(state))
            demands.append(_Demand(asked, "stick ratio, growing load"))
        asked = state.known.required(observation.tangential * growth, observation.torque * growth, settings.most_force)
        return [*demands, _Demand(asked, "friction model" if growth == 1.0 else "friction model, growing load")]
    load = state.load.size * growth
    among = state.recognition
    waits = among is not None and among.waits(state.time, settings) and state.mode == "feel"
    target = settings.learn_stick_ratio if state.mode == "learn" else settings.feel_stick_ratio
    least = state.sticking.least(settings)
    doubtful = state.doubts and state.mode == "learn"
    sticking, shown = _doubtful(state) if doubtful else (state.sticking, least)
    demands.append(_Demand(sticking.required(load, target, shown), "stick ratio"))
    lowest = state.learned.lowest(settings)
    if state.mode == "learn" and lowest > 0.0:
        friction = max(lowest, least)  # what sticks, taken for slip, would ask for ever more
        demands.append(_Demand(load / friction, "samples of slip"))
    if state.mode == "learn" and state.refuted > 0.0:
        friction = max(state.refuted * utilisation(settings.reflex_stick_ratio), least)
        demands.append(_Demand(load / friction, "slip before"))
    if state.known is not None:
        most = state.known.required(observation.tangential * growth, observation.torque * growth, settings.most_force)
        return [each if each.reason == "slip" else _Demand(min(each.force, most), each.reason) for each in demands]
    if among is not None and waits:
        demands.append(_Demand(load / among.borne(observation.normal, settings), "to be recognised"))
        demands = _held_still(state, demands)
    elif state.mode != "learn":
        why, friction = ("no stick ratio", settings.unknown_friction) if _blind(state) else ("friction unknown", least)
        demands += [_Demand(load / friction, why), _Demand(state.normal_force, why)]
    return demands


def _held_still(state: ControllerState, demands: list[_Demand]) -> list[_Demand]:
    """Demands of a grip that stays as it is, or is pressed at once for the load that is still to come.

    Under a force that grows with the load nothing slips, however near to slipping it is (Mindlin and Deresiewicz,
    1953): what slips shows only while the load grows under a force that doesn't.
    """
    most = max(demands, key=lambda each: each.force)
    if most.force <= state.normal_force or state.load.size == 0.0:
        return [*demands, _Demand(state.normal_force, "to be recognised")]
    grows = state.load.after(state.settings.recognise_time, state.settings) / state.load.lead(state.settings)
    return [*demands, _Demand(most.force * max(grows, 1.0), most.reason)]


def _shown(state: ControllerState) -> float:
    """The least friction that a contact which is seen to slip may have: what samples say, or what most objects have.

    What sticks, taken for slip, would ask for ever more.
    """
    return max(state.learned.low(state.settings), state.sticking.least(state.settings))


def _limited(state: ControllerState, force: float, elapsed: float) -> float:
    """The force on the way from the last one: no faster than the rates allow, over a gap no further than one frame."""
    settings, last = state.settings, state.normal_force
    time = min(elapsed, settings.dropout_time) if math.isfinite(elapsed) else 0.0
    rate = settings.relax_rate if state.mode == "learn" else settings.fall_rate
    slowest = last * max(1.0 - rate * time, 0.0)
    risen = min(max(force, slowest), last + settings.rise_rate * time)
    return min(max(risen, settings.least_force), settings.most_force)
