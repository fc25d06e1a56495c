"""Many runs, each in a process of its own: which tasks there are, running them, what came of each."""
