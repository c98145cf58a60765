"""A page on which a class can look on: a process beside the daemon, which only reads."""
