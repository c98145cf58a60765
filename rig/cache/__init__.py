"""Results kept in the user's cache folder: the same content is not computed twice."""
