"""What proves the software itself: real processes killed and flooded. ``./run bench`` runs it."""
