"""The published reconstructions repeated on simulated stand-ins."""
