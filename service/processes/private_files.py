"""Files that the service makes are for its user and group, whatever the shell that started it says."""

import os

WITHHELD = 0o027
"""Writing from the group, everything from others: files are 0640 at most, folders 0750."""


def withhold() -> None:
    """Let this process, and those that it starts, make no file or folder that others can read."""
    os.umask(os.umask(WITHHELD) | WITHHELD)
