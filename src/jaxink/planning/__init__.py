"""What to measure next: which further measurement would settle what a fit leaves open."""

from jaxink.planning.menu import Candidate
from jaxink.planning.plan import Forecast, MeasurementPlan, plan_measurement
from jaxink.planning.writing import next_project

__all__ = ["Candidate", "Forecast", "MeasurementPlan", "next_project", "plan_measurement"]
