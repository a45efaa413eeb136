"""Client of the Stiction friction service: what a grasp planner installs."""
