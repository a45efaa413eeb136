"""The live stream: connections, sessions, detectors."""
