"""Drawing of robots, scenes and runs: pages, pictures, videos and figures."""
