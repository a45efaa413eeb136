"""The simulator: accuracy, speed, other programs and references."""
