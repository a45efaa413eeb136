import os
import platform
import subprocess
import sys

import pytest

TOUCH = """
import resource
from threading import Thread
from service.processes import freed_memory

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


def page_faults(prepare: str, **variables: str) -> list[int]:
    """Of the main thread and another one, once both have taken as much memory before."""
    command = [sys.executable, "-c", TOUCH.format(prepare=prepare)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=os.environ | variables)
    return [int(line) for line in done.stdout.split()]


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library, which is left as it is")
def test_memory_that_was_freed_is_there_when_it_is_needed_again() -> None:
    many = 20_000  # 20 times 12 MB in pages of 4 KiB are 60,000
    assert min(page_faults("")) > many
    assert max(page_faults("freed_memory.keep()")) < 0.1 * many
    assert min(page_faults("freed_memory.keep()", MALLOC_ARENA_MAX="4")) > many  # as the operator has it
