import platform
import subprocess
import sys

import pytest

TOUCH = """
import resource
from threading import Thread
from service import freed_memory

def take():  # 12 MB in all, as for an upload or two; each page is written
    blocks = [b"x" * 2_000_000 for _ in range(6)]

def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(20):
        take()
    print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)

{prepare}
take()
faults()
thread = Thread(target=lambda: (take(), faults()))
thread.start()
thread.join()
"""


def page_faults(prepare: str) -> list[int]:
    """Of the main thread and another one, once both have taken as much memory before."""
    command = [sys.executable, "-c", TOUCH.format(prepare=prepare)]
    return [int(line) for line in subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()]


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library, which is left as it is")
def test_memory_that_was_freed_is_there_when_it_is_needed_again() -> None:
    given_back, kept = page_faults(""), page_faults("freed_memory.keep()")
    for before, after in zip(given_back, kept, strict=True):
        assert before > 20_000  # 20 times 12 MB in pages of 4 KiB are 60,000
        assert after < 2_000
