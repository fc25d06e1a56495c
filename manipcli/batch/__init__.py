"""Many runs, each in its own process: test discovery, processes with a watchdog, baselines."""
