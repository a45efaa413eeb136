"""Who answers on a port, among the processes that a server has started."""

import os
import subprocess
import sys

import pytest

from benchmarks.service.http_load import child_listening

LISTEN = """
import socket, sys
with socket.create_server(("127.0.0.1", 0)) as listening:
    print(listening.getsockname()[1], flush=True)
    sys.stdin.read()
"""


def test_the_child_that_listens_at_a_port_is_found() -> None:
    with subprocess.Popen([sys.executable, "-c", LISTEN], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        port = int(child.stdout.readline())
        assert child_listening(os.getpid(), port) == child.pid
        child.communicate()
    with pytest.raises(StopIteration):
        child_listening(os.getpid(), port)
