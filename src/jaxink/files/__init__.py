"""Reading with limits, and writing whole or not at all."""
