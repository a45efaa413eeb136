"""The systemd unit's restrictions, made with mount namespaces: the service works under them, and they hold."""

import configparser
import os
import shlex
import shutil
import socket
import stat
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest

from slipcore.contact.tiers.ramp import tangential_ramp
from stiction_client.container import encode
from tests.service.conftest import NPZ, SHORT

ROOT = Path(__file__).parents[3]
UNIT = ROOT / "docs" / "deploy" / "stiction.service"
NOBODY = "65534"

RESTRICTED = """
set -e
umask 022
mount --make-rprivate /
mount -t tmpfs tmpfs /opt
mkdir -p /opt/python /opt/stiction
mount --bind {python} /opt/python
mount --bind {code} /opt/stiction
mount --bind {prefix} /opt/stiction/.venv
for folder in /var/lib /var/cache; do mount -t tmpfs -o mode=755 tmpfs $folder; mkdir $folder/stiction; done
mount --bind {state} /var/lib/stiction
mount --bind {cache} /var/cache/stiction
for home in /root /home; do mount -t tmpfs -o mode=755 tmpfs $home; done
if [ ! -e {python} ]; then mkdir -p {python}; mount --bind /opt/python {python}; mount -o remount,bind,ro {python}; fi
mount -t tmpfs -o mode=1777 tmpfs /tmp
for folder in /root /home /var/lib /var/cache /opt/stiction/.venv /opt/stiction /opt/python /opt /; do
    mount -o remount,bind,ro $folder
done
cd /
umask {umask}
exec setpriv --reuid {user} --regid {user} --clear-groups --no-new-privs --bounding-set=-all --inh-caps=-all \\
    env -i {environment} "$@"
"""
"""ProtectSystem=strict, ProtectHome, PrivateTmp, a user without a home, no capabilities; {python} may be in a home."""


def unit() -> configparser.SectionProxy:
    parser = configparser.ConfigParser(strict=False, interpolation=None)
    lines = UNIT.read_text(encoding="utf-8").splitlines()
    merged = " ".join(line.removeprefix("Environment=") for line in lines if line.startswith("Environment="))
    parser.read_string("\n".join(line for line in lines if not line.startswith("Environment=")))
    parser["Service"]["Environment"] = merged
    return parser["Service"]


@dataclass
class Restricted:
    """Runs commands as the unit does, but with Python's own path, for scripts name the one they were installed for."""

    folder: Path
    settings: dict[str, str]

    def command(self, *arguments: str) -> list[str]:
        service = unit()
        given = service["Environment"].split() + [f"{name}={value}" for name, value in self.settings.items()]
        filled = RESTRICTED.format(
            umask=service.get("UMask", "0022"),
            python=shlex.quote(sys.base_prefix),
            code=shlex.quote(str(ROOT)),
            prefix=shlex.quote(sys.prefix),
            state=shlex.quote(str(self.folder / "state")),
            cache=shlex.quote(str(self.folder / "cache")),
            user=NOBODY,
            environment=shlex.join(["PATH=/usr/bin:/bin", "PYTHONPATH=/opt/stiction:/opt/stiction/clients", *given]),
        )
        return ["unshare", "--mount", "sh", "-c", filled, "sh", *arguments]

    def stiction(self, *arguments: str) -> list[str]:
        return self.command("/opt/stiction/.venv/bin/python", "-m", "service.cli", *arguments)

    def run(self, command: list[str]) -> subprocess.CompletedProcess[str]:
        return subprocess.run(command, capture_output=True, text=True, timeout=120.0)


@pytest.fixture
def restricted(tmp_path: Path) -> Restricted:
    if os.geteuid() != 0 or not shutil.which("unshare") or not shutil.which("setpriv"):
        pytest.skip("the unit's restrictions need root, unshare and setpriv")
    service = unit()
    for setting, folder in (("StateDirectory", "state"), ("CacheDirectory", "cache")):
        (tmp_path / folder).mkdir(mode=int(service.get(f"{setting}Mode", "0755"), 8))
        if setting in service:
            os.chown(tmp_path / folder, int(NOBODY), int(NOBODY))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        made = Restricted(tmp_path, {"STICTION_WORKERS": "1", "STICTION_PORT": str(free.getsockname()[1])})
    tried = made.run(made.command("true"))
    if tried.returncode:
        pytest.skip(f"no mount namespaces here: {tried.stderr}")
    return made


def keep_kernels(cache: Path) -> None:
    """Put what is compiled already where the unit keeps it: compiling takes half a minute."""
    for package in ("slipcore", "estimators"):
        for kernel in (ROOT / package).rglob("*.nb[ic]"):
            target = cache / "kernels" / kernel.relative_to(ROOT).parent.parent / kernel.name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(kernel, target)
    for path in (cache, *cache.rglob("*")):
        os.chown(path, int(NOBODY), int(NOBODY))


@contextmanager
def serving(restricted: Restricted, key: str) -> Iterator[httpx.Client]:
    with (restricted.folder / "log").open("w") as log:
        process = subprocess.Popen(restricted.stiction("serve"), stderr=log)
        try:
            url = f"http://127.0.0.1:{restricted.settings['STICTION_PORT']}"
            with httpx.Client(base_url=url, headers={"Authorization": f"Bearer {key}"}, timeout=60.0) as client:
                wait_until_ready(client, process)
                yield client
        finally:
            process.terminate()
            process.wait(30.0)


def wait_until_ready(client: httpx.Client, process: "subprocess.Popen[bytes]") -> None:
    end = time.monotonic() + 120.0
    while time.monotonic() < end and process.poll() is None:
        try:
            if client.get("/readyz").status_code == 200:
                return
        except httpx.TransportError:
            pass
        time.sleep(0.1)
    raise AssertionError("the service is not ready")


@pytest.mark.long
def test_the_service_does_its_work_under_the_units_restrictions(restricted: Restricted) -> None:
    keep_kernels(restricted.folder / "cache")
    made = restricted.run(restricted.stiction("keys", "create", "robot", "--scope", "admin", "--json"))
    assert made.returncode == 0, made.stderr
    key = next(word.strip('",') for word in made.stdout.split() if word.strip('",').startswith("stiction_"))
    with serving(restricted, key) as client:
        client.post("/v1/materials", json={"name": "felt"}).raise_for_status()
        log = encode(tangential_ramp(points=14, pitch=0.9e-3, schedule=SHORT))
        sent = client.post("/v1/grasp-logs?material=felt", content=log, headers={"Content-Type": NPZ}).json()
        assert client.get(f"/v1/jobs/{sent['job']['id']}?wait=10").json()["status"] == "done"
    text = (restricted.folder / "log").read_text()
    assert "Traceback" not in text
    assert "Warning" not in text
    files = [path for path in (restricted.folder / "state").rglob("*") if not path.is_symlink()]
    assert files
    assert [path for path in files if stat.S_IMODE(path.stat().st_mode) & 0o027] == []


def test_nothing_can_be_written_but_state_cache_and_a_private_tmp(restricted: Restricted) -> None:
    for folder in ("/opt/stiction", "/etc", "/root", "/var/lib", "/var/cache", "/usr/bin"):
        assert restricted.run(restricted.command("touch", f"{folder}/x")).returncode, folder
    for folder in ("/var/lib/stiction", "/var/cache/stiction", "/tmp"):
        assert restricted.run(restricted.command("touch", f"{folder}/x")).returncode == 0, folder


def test_systemd_itself_finds_no_fault_in_the_unit(tmp_path: Path) -> None:
    if not shutil.which("systemd-analyze"):
        pytest.skip("systemd-analyze is not installed")
    installed = tmp_path / "stiction.service"
    content = UNIT.read_text(encoding="utf-8")
    installed.write_text(
        content.replace("/opt/stiction/.venv/bin/stiction", sys.executable).replace("=stiction\n", "=root\n", 1)
    )
    done = subprocess.run(["systemd-analyze", "verify", installed], capture_output=True, text=True)
    assert [line for line in done.stderr.splitlines() if installed.name in line] == []
