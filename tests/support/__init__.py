"""Helpers that several tests and benches share."""
