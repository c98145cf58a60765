"""The lab session in a terminal: a client of the daemon without data of its own."""
