"""The open slip benchmark: sealed simulated scenes, detectors that are run on them, and their scores."""
