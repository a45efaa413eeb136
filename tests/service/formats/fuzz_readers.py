"""Feed mutated files to the readers, in a process whose memory is limited: run by ``test_fuzz.py``.

    python fuzz_readers.py SEEDS COUNT FIRST PROGRESS

SEEDS is a folder of files and, beside a file that needs one, its mapping with the suffix ``.mapping``. Cases FIRST to
FIRST + COUNT go through all of them in turn; each is made of its number alone, so that any can be had again:
``python fuzz_readers.py SEEDS 1 NUMBER PROGRESS`` leaves it in PROGRESS with the suffix ``.case``. PROGRESS tells the
case under way, should the process die of it. What was found is printed as JSON.
"""

import json
import os
import random
import resource
import signal
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

from service import formats
from service.formats import hdf5, mcap, npy, parquet, rosbag
from slipcore import InvalidInput

LIMIT_SECONDS = 5.0
MEMORY = 2 * npy.MAX_ARRAY_BYTES
"""Address space that a reader may take beyond what the process has: twice the size limit."""

WARM = (hdf5, mcap, parquet, rosbag)
NUMBERS = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 10**9, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**63 - 1, 2**63, 2**64 - 1)
TOKENS = (
    b"1e999",
    b"-1",
    b"NaN",
    b"null",
    b"[",
    b"]",
    b"{",
    b'"',
    b"\\u0000",
    b"9" * 20,
    b"0.0",
    b"[" * 2000,
)


class Hang(BaseException):
    """A reader takes too long; no exception, lest a reader catches it."""


def mutated(content: bytes, number: int) -> bytes:
    """One to four changes, most of them near the ends of the file, where headers and tables are."""
    chance = random.Random(number)
    data = bytearray(content)
    for _ in range(chance.choice((1, 1, 1, 2, 3, 4))):
        if not data:
            break
        chance.choice((flip, flip, overwrite, overwrite, number_at, number_at, number_at, cut, drop, copy, token))(
            data, chance
        )
    return bytes(data)


def place(data: bytearray, chance: random.Random) -> int:
    near = min(len(data), chance.choice((64, 600, 4096)))
    where = chance.random()
    if where < 0.4:
        return chance.randrange(near)
    return len(data) - 1 - chance.randrange(near) if where < 0.7 else chance.randrange(len(data))


def flip(data: bytearray, chance: random.Random) -> None:
    data[place(data, chance)] ^= 1 << chance.randrange(8)


def overwrite(data: bytearray, chance: random.Random) -> None:
    start = place(data, chance)
    for at in range(start, min(start + chance.randrange(1, 9), len(data))):
        data[at] = chance.randrange(256)


def number_at(data: bytearray, chance: random.Random) -> None:
    width, start = chance.choice((1, 2, 4, 8)), place(data, chance)
    value = chance.choice(NUMBERS) % 256**width
    data[start : start + width] = value.to_bytes(width, chance.choice(("little", "little", "big")))


def cut(data: bytearray, chance: random.Random) -> None:
    del data[place(data, chance) :]


def drop(data: bytearray, chance: random.Random) -> None:
    start = place(data, chance)
    del data[start : start + chance.choice((1, 4, 8, 100))]


def copy(data: bytearray, chance: random.Random) -> None:
    source, target = place(data, chance), place(data, chance)
    data[target:target] = data[source : source + chance.choice((1, 8, 64, 1000))]


def token(data: bytearray, chance: random.Random) -> None:
    start = place(data, chance)
    data[start : start + chance.randrange(8)] = chance.choice(TOKENS)


CHANGES = (flip, flip, overwrite, overwrite, number_at, number_at, number_at, cut, drop, copy, token)


def attempt(path: Path, name: str, mapping: str | None) -> str:
    """What a reader makes of a file: "log", "refused", or what is wrong with the reader."""
    begin = time.perf_counter()
    signal.setitimer(signal.ITIMER_REAL, LIMIT_SECONDS)
    try:
        formats.read(path, formats.FORMATS[name].content_type, mapping=mapping)
        outcome = "log"
    except InvalidInput:
        outcome = "refused"
    except MemoryError:
        outcome = "memory"
    except Hang:
        return "hang"
    except Exception as error:
        return f"crash: {type(error).__name__}: {error}"[:200]
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    return outcome if time.perf_counter() - begin < LIMIT_SECONDS else "hang"


def hang(*_: object) -> None:
    raise Hang


def limit_memory() -> None:
    with open("/proc/self/statm", encoding="ascii") as stream:
        now = int(stream.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (now + MEMORY, now + MEMORY))


def main(seeds: Path, count: int, first: int, progress: Path) -> dict[str, Any]:
    files = sorted(path for path in seeds.iterdir() if path.suffix != ".mapping")
    contents = [path.read_bytes() for path in files]
    names = [formats.identify(path) for path in files]
    mappings = [p.read_text() if (p := path.with_suffix(".mapping")).exists() else None for path in files]
    for path, name, mapping in zip(files, names, mappings, strict=True):
        formats.read(path, formats.FORMATS[name].content_type, mapping=mapping)  # libraries are imported and warm
    signal.signal(signal.SIGALRM, hang)
    limit_memory()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    found: list[tuple[int, str, str]] = []
    outcomes: Counter[str] = Counter()
    slowest = 0.0
    case = progress.with_suffix(".case")
    under_way = os.open(progress, os.O_CREAT | os.O_WRONLY)
    for number in range(first, first + count):
        which = number % len(files)
        os.pwrite(under_way, b"%12d" % number, 0)  # at once: it may be read at any time
        case.write_bytes(mutated(contents[which], number))
        begin = time.perf_counter()
        outcome = attempt(case, names[which], mappings[which])
        slowest = max(slowest, time.perf_counter() - begin)
        outcomes[outcome.partition(":")[0]] += 1
        if outcome not in ("log", "refused"):
            found.append((number, files[which].name, outcome))
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    return {"outcomes": outcomes, "found": found[:200], "slowest": slowest, "grown": 1024 * grown}


if __name__ == "__main__":
    sys.stdout.write(json.dumps(main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))))
