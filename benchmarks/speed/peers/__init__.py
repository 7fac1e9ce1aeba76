"""jaxink side by side with its peers: each runs in a process of its own and imports its own package only."""
