"""Contact mechanics on a grid: normal and tangential problems, and histories of load."""
