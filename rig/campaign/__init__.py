"""The plan on its way: one pure machine, driven by the headless runner and by the terminal."""
