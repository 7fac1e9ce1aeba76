"""Contenders of bench_peers.py: each runs in a process of its own and imports its own package only."""
