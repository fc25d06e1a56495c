"""What a recording contains in numbers beyond its verdict: errors, limits, work, grasps, the cost of each step."""
