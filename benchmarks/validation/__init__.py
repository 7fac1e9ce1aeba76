"""jaxink against measurements, simulations, other programs and itself: one script, one page of docs."""
