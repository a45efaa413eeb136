"""Sets the clock of a process ahead, by as many seconds as the file says that ``CLOCK_AHEAD`` names, at any moment."""

import os
import threading
import time
from pathlib import Path

import time_machine

LOOK_SECONDS = 0.01


def follow(told: Path, clock: time_machine.Traveller, ahead: float) -> None:
    while True:
        wanted = float(told.read_text())
        if wanted != ahead:
            clock.shift(wanted - ahead)
            ahead = wanted
        time.sleep(LOOK_SECONDS)


told = Path(os.environ["CLOCK_AHEAD"])
ahead = float(told.read_text())
clock = time_machine.travel(time.time() + ahead, tick=True).start()
threading.Thread(target=follow, args=(told, clock, ahead), daemon=True).start()
