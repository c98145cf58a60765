"""What proves the software itself: its results against the truth, its processes against kills."""
