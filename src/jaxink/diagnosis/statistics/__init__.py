"""Statistics of residuals, independent of the model and its effects."""
