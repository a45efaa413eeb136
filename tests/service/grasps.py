"""Logs of other grasps than a given one, or of the same in another file, for which nothing is simulated."""

import io

import numpy as np


def another_grasp(content: bytes, number: int = 1) -> bytes:
    """A container with normal forces that are off by a thousandth, in each reading by another one: friction stays.

    Number 0 is the content itself.
    """
    if number == 0:
        return content
    with np.load(io.BytesIO(content)) as archive:
        members = dict(archive)
    off = np.random.default_rng(number).normal(1.0, 1e-3, (*members["force"].shape[:3], 1))
    buffer = io.BytesIO()
    np.savez(buffer, **members | {"force": members["force"] * off})
    return buffer.getvalue()


def same_grasp(content: bytes, number: int) -> bytes:
    """The same log in other bytes, of which 0 are its own: a zip ends with a comment, which is empty as yet."""
    comment = b" " * number
    return content[:-2] + len(comment).to_bytes(2, "little") + comment
