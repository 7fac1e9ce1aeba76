"""From a sample and the points of a measurement to the predicted BSDF."""
