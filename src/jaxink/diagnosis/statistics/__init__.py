"""Statistics of residuals: they know neither the model nor its effects."""
