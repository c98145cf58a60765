"""The one owner of the port and of the session file."""
