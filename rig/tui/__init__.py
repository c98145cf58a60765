"""The lab session in a terminal: a client of the daemon that holds no truth of its own."""
