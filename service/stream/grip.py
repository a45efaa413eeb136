"""The grip controller beside a live detector: what a stream's frames command (docs/control.md)."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from typing import Any

from service.stream.messages import Control
from service.stream.observing import Observer, SampledForces
from slipcore import Frame, InvalidInput, SlipState
from slipcore.frames import FloatArray
from stiction_client import Contact, ControlSettings, FrictionModel, GraspController, InvalidArgument
from stiction_client.arguments import within
from stiction_client.controller import gains

CONTACT_RANGES = {"pressure_square": (0.1, 1e6, "-"), "torque_arm": (1e-9, 1.0, "m")}


class Grip:
    """A controller on one sensor's frames, with what it may be of. Raises ``InvalidInput`` for settings and models that
    it cannot take.
    """

    def __init__(
        self,
        position: FloatArray,
        control: Control,
        model: FrictionModel | None,
        materials: Mapping[str, FrictionModel] | None = None,
    ) -> None:
        self._observer = Observer(position)
        with _named():
            self._state = GraspController.init(settings_of(control), model, materials)

    def step(self, frame: Frame, found: SlipState, sampled: SampledForces | None = None) -> dict[str, Any]:
        """The command after a frame, as it is sent, with friction of forces that are to be ``sampled`` where these are
        not the frame's; raises ``InvalidInput`` for what the controller cannot take.
        """
        with _named():
            observer, seen = self._observer.step(frame, found, sampled)
            self._state, command = GraspController.step(self._state, seen)
        self._observer = observer
        return asdict(command)


@contextmanager
def _named() -> Iterator[None]:
    """Raise ``InvalidInput`` in place of the controller's own error."""
    try:
        yield
    except InvalidArgument as error:
        raise InvalidInput(f"control: {error.name}", error.value, error.allowed) from error


def settings_of(control: Control) -> ControlSettings:
    """What was said in a message, as the controller takes it; raises ``InvalidArgument``."""
    known, missing = gains(), {"least_force", "most_force"} - control.settings.keys()
    for name in control.settings.keys() - known.keys():
        raise InvalidArgument("settings", name, ", ".join(known))
    for name in missing:
        raise InvalidArgument(name, "not given", f"{known[name].low:g} to {known[name].high:g} {known[name].unit}")
    return ControlSettings(contact=_contact(control), **control.settings)  # type: ignore[arg-type]  # frames are counted


def _contact(control: Control) -> Contact:
    area, force = control.contact_area, control.round_at
    contact = Contact.flat(area) if force is None else Contact.round(area, force)
    if control.torque_arm == 0.0:
        own = f"{contact.torque_arm:g} m, which this contact has without it"
        raise InvalidArgument("torque_arm", 0.0, f"above 0 m, for frames have torques, such as {own}")
    given = {
        name: float(within(name, value, low, high, unit))
        for name, (low, high, unit) in CONTACT_RANGES.items()
        if (value := getattr(control, name)) is not None
    }
    return replace(contact, **given)
