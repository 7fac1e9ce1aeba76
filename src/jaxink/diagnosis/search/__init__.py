"""The search: models with the effects found so far, screens for further effects, and refits."""
