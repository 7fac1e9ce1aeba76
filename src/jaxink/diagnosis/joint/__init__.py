"""What the model of several measurements lacks: effects of the sample, of an instrument, of one of them."""
