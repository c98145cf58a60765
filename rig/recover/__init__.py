"""What is whole in a session file, and saving what can be read of a damaged one."""
