"""What is done with a policy: aiming, the robot's pose, trials, and where launches may land."""
