"""Pictures of the dashboard for its page: `python -m benchmarks.service.screenshots [--output docs/images]`.

A service with grasps of two simulated materials, one of which is streamed meanwhile, in Debian's Chromium: each page in
light colours on a screen 1400 px wide, and in dark ones on a phone 390 px wide.
"""

import argparse
import io
import tempfile
import time
from pathlib import Path

from PIL import Image

from service.demo.server import running_server
from slipcore import GraspLog
from slipcore.contact import tangential_ramp
from stiction_client import FrictionClient
from stiction_client.stream import SlipStream
from tests.service.web import chromium
from tests.service.web.chromium import Tab

FRICTION = {"cardboard": 0.45, "rubber": 0.8}
NORMAL_FORCES = (4.0, 7.0, 11.0)

LOOKS = {"wide": (1400, "light"), "phone": (390, "dark")}
"""Widths in CSS pixels, and colours."""

FRAME = 1.0 / 30.0
"""s between frames of the stream, so that all of them are shown."""

STREAMED = 0.85
"""Part of a grasp that is streamed before its picture is taken."""


def grasps(friction: float) -> list[GraspLog]:
    """Grasps of a material, each pressed harder than the one before."""
    return [
        tangential_ramp(
            points=20, friction=friction, normal_force=force, marker_noise=1e-6, force_noise=2e-3, seed=seed
        )
        for seed, force in enumerate(NORMAL_FORCES)
    ]


def fill(client: FrictionClient) -> str:
    """Upload all grasps and wait for their models; the id of one log."""
    receipts = []
    for material, friction in FRICTION.items():
        client.create_material(material)
        receipts += [client.upload(log, material=material) for log in grasps(friction)]
    for receipt in receipts:
        client.wait(receipt.job)
    return receipts[-1].id


def take(tab: Tab, name: str, folder: Path, part: str = "body") -> None:
    """One picture of the page from the beginning of a ``part``, in each look; 256 colours are plenty."""
    for look, (width, scheme) in LOOKS.items():
        tab.resize(width)
        tab.prefer(scheme)
        tab.run(f"document.querySelector('{part}').scrollIntoView({{behavior: 'instant'}})")
        tab.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        picture = Image.open(io.BytesIO(tab.picture())).convert("RGB")
        path = folder / f"dashboard-{name}-{look}.png"
        picture.quantize(256, Image.Quantize.MAXCOVERAGE).save(path, optimize=True)
        print(path)


def take_live(tab: Tab, url: str, folder: Path) -> None:
    """A live stream, watched from its beginning until part of a grasp is over."""
    log = grasps(FRICTION["rubber"])[-1]
    assert log.displacement is not None
    assert log.force is not None
    with SlipStream(url, log.position, log.element_area, sensor="left finger", material="rubber") as live:
        tab.go(f"{url}/live/{live.session}")
        tab.until("socket.readyState === WebSocket.OPEN")
        last = int(STREAMED * len(log))
        for k in range(last + 1):
            time.sleep(FRAME)
            live.step(log.time[k], log.displacement[k], log.force[k], command=NORMAL_FORCES[-1])
        tab.until("document.querySelector('.player').dataset.frame > 0")
        take(tab, "live", folder)
        live.finish()


def main() -> None:
    """Fill a service and take all pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("docs/images"), help="folder for the pictures")
    folder: Path = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    with (
        tempfile.TemporaryDirectory() as data,
        tempfile.TemporaryDirectory() as profile,
        running_server(Path(data)) as url,
        chromium.running(Path(profile)) as tab,
        FrictionClient(url) as client,
    ):
        log = fill(client)
        tab.resize(LOOKS["wide"][0])
        pages = {"material": "/materials/rubber", "compare": "/compare?material=cardboard&material=rubber"}
        for name, path in pages.items():
            tab.go(f"{url}{path}")
            take(tab, name, folder)
        tab.go(f"{url}/materials/rubber")
        tab.until("document.querySelector('.samples[data-ready]') !== null")
        take(tab, "samples", folder, ".samples")
        tab.go(f"{url}/logs/{log}")
        tab.until("document.querySelector('.player[data-ready]') !== null")
        take(tab, "log", folder)
        take_live(tab, url, folder)


if __name__ == "__main__":
    main()
