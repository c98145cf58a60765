"""The session file: everything that happened, in one SQLite database."""
