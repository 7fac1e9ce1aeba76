"""What colours of a fitted ink are worth, on simulated inks with known truth."""
