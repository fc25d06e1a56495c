"""First files for a robot: guesses, each with its evidence, from a description to a robot file and a task that runs."""
