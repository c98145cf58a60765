"""The protocol file: what is dropped, how it is measured and in which order."""
