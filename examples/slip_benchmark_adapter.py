"""A detector of one's own in the slip benchmark: a program that is given the paths of an input and of its prediction.

    stiction benchmark run FOLDER --external "python examples/slip_benchmark_adapter.py" --name mine

This one says that all slips once the markers have moved by 0.2 mm in the mean.
"""

import sys

import numpy as np

seen = np.load(sys.argv[1])
moved = seen["displacement"][..., :2]  # [t, n, m, 2] m
far = np.hypot(*moved.mean(axis=(1, 2)).T) > 2e-4  # [t]
slip = np.broadcast_to(far[:, None, None], moved.shape[:3])
np.savez(sys.argv[2], slip=slip)
