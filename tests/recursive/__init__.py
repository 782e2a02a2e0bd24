"""Recursive estimators, and the records they are tried on."""
