"""Feed mutated files to the readers, in a process whose memory is limited: run by ``test_fuzz.py``.

    python fuzz_readers.py SEEDS COUNT FIRST JOURNAL

SEEDS is a folder of files and, beside a file that needs one, its mapping with the suffix ``.mapping``. Cases FIRST to
FIRST + COUNT go through all of them in turn; each is made of its number alone, so that any can be had again:
``python fuzz_readers.py SEEDS 1 NUMBER JOURNAL`` leaves it in JOURNAL with the suffix ``.case``. JOURNAL gets a line a
case once it is done, so that it tells the case under way, should the process die of it: what came of it, s, and bytes
by which the process has grown at most.
"""

import os
import random
import resource
import signal
import sys
import time
from pathlib import Path

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
        chance.choice(CHANGES)(data, chance)
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
    signal.setitimer(signal.ITIMER_PROF, LIMIT_SECONDS)  # of computing: the machine may be busy
    try:
        formats.read(path, formats.FORMATS[name].content_type, mapping=mapping)
        outcome = "log"
    except InvalidInput:
        outcome = "refused"
    except MemoryError:
        outcome = "memory"
    except Hang:
        outcome = "hang"
    except Exception as error:
        outcome = f"crash: {type(error).__name__}: {error}"[:200]
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    return outcome


def hang(*_: object) -> None:
    raise Hang


def limit_memory() -> None:
    with open("/proc/self/statm", encoding="ascii") as stream:
        now = int(stream.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (now + MEMORY, now + MEMORY))


def most_memory() -> int:
    """Bytes that were resident at most; what ``getrusage`` tells begins with the process that started this one."""
    with open("/proc/self/status", encoding="ascii") as stream:
        return next(1024 * int(line.split()[1]) for line in stream if line.startswith("VmHWM"))


def main(seeds: Path, count: int, first: int, journal: Path) -> None:
    files = sorted(path for path in seeds.iterdir() if path.suffix != ".mapping")
    contents = [path.read_bytes() for path in files]
    names = [formats.identify(path) for path in files]
    mappings = [p.read_text() if (p := path.with_suffix(".mapping")).exists() else None for path in files]
    for path, name, mapping in zip(files, names, mappings, strict=True):
        formats.read(path, formats.FORMATS[name].content_type, mapping=mapping)  # libraries are imported and warm
    signal.signal(signal.SIGPROF, hang)
    limit_memory()
    before = most_memory()
    case = journal.with_suffix(".case")
    with journal.open("wb", buffering=0) as lines:
        for number in range(first, first + count):
            which = number % len(files)
            case.write_bytes(mutated(contents[which], number))
            begin = time.process_time()
            outcome = " ".join(attempt(case, names[which], mappings[which]).split())
            seconds = time.process_time() - begin
            lines.write(f"{outcome}\t{seconds}\t{most_memory() - before}\n".encode())


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))
