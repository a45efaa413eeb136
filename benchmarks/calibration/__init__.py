"""A sensor's faults from presses."""
