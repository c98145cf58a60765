"""A session for others: tables, and one file of which another person can check every number."""
