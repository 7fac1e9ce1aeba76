"""The verdict on a search, and the evidence for it."""
