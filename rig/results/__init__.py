"""Results of a session file: all derived data, which can be computed again at any time."""
