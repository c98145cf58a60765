"""What each sub-command does; one module a command, loaded when it is called."""
