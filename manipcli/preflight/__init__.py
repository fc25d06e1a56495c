"""What is doubted of a task before it runs: gains, efforts, grips and timeouts, each a check of its own."""
