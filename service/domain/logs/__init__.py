"""What is found in a log of a grasp, and what is handed out of it."""
