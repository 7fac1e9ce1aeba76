"""Methods of minimisation compared on published, simulated and measured problems."""
