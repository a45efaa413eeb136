"""From raw grasps to friction, and on to a grip."""
