"""The main job: the whole path on real input, with a real server."""
