"""The daemon: it serves clients on a local socket, in front of the owner of port and session."""
