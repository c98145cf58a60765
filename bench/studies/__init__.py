"""What the benches of falls and their analysis count and time, without a word of printing."""
