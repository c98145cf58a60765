"""The pages: each makes of what is known, and of what is looked at, what there is to see."""
