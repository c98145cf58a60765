"""The pages of a session, one a file."""
