"""Answers to a planner: friction, material, grip force, and what to record next."""
