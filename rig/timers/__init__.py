"""Text files of timers: edges, passages, samples."""
