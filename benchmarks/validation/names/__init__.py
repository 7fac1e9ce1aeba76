"""Whether diagnoses name the right effects: simulated measurements of many inks, half of them kept unseen."""
