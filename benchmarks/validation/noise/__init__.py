"""What an estimated noise is worth: coverage of its standard errors, and its false alarms."""
