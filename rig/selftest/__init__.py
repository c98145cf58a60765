"""What a board can be asked to prove on the bench, with no more hands than a wire."""
