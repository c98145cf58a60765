"""The station: the one owner of the port and of the session."""
