"""Boards at USB: which ports may be theirs, and at which one a known board is now."""
