"""The pages: each returns its content from the model and the operator's view."""
