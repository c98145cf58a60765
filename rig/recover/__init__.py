"""Examination of session files, and recovery of readable data from damaged ones."""
