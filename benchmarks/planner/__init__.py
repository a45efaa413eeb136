"""Grip forces of a planner: how hard, how fast, and in MuJoCo."""
