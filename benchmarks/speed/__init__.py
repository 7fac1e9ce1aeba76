"""Time and memory: jaxink by itself, and beside its peers."""
