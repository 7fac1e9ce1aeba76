"""Mitsuba's volumetric path tracer against the solver, by the media that jaxink writes for it."""
