"""Findings: the verdict on a search, and what it rests on."""
