"""File formats of grasp logs, one module each."""
