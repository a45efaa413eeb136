"""The paper's experiments, run again on simulated scenes; one figure a module."""
