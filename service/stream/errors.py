"""How connections of the live stream end."""

FINISHED, NOT_UNDERSTOOD, DETECTOR_LOST = 1000, 1003, 1011
KEY_ENDED, UNKNOWN_SESSION, SLOW_READER, IN_USE = 4401, 4404, 4408, 4409
REFUSED, NOT_READY, TOO_MANY, STORAGE_AWAY = 4422, 4425, 4429, 4503


class End(Exception):
    """The connection is to be closed, with this code and reason."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code, self.reason = code, reason
