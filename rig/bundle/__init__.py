"""A session as one file that another person can check: a zipped RO-Crate (``.eln``)."""
