"""The wire to the microcontroller: frames, messages, clock and client."""
