"""Simulated measurements of an ink on a plate in the shared data, each with an effect of its own."""

import csv
import json

import numpy as np


def simulated(shared_data, name):
    """Truth, numbers of its ink, angles (incidence, view, azimuth), and whether each row is transmission."""
    folder = shared_data / "simulated"
    truth = json.loads((folder / f"{name}.truth.json").read_text())
    with (folder / f"{name}.csv").open() as file:
        rows = list(csv.DictReader(file))
    angles = [
        np.array([float(row[key]) for row in rows]) for key in ("theta_i_deg", "theta_o_deg", "phi_deg")
    ]
    side = np.array([row["side"] == "T" for row in rows])
    return truth, truth["ink"] | truth["ink"]["phase"], angles, side
