"""The search: stages of a model, screens of what it may lack, and refits."""
