"""Twelve mistakes, made in the text of a measurement and of its sample file as a person would make them."""

import csv
import io
import math
import re
from collections.abc import Callable

Row = dict[str, str]


def _edited(change: Callable[[Row], None]) -> Callable[[str, str], tuple[str, str]]:
    """A mistake in each row of the measurement."""

    def make(data: str, sample: str) -> tuple[str, str]:
        rows = list(csv.DictReader(io.StringIO(data)))
        for row in rows:
            change(row)
        text = io.StringIO()
        writer = csv.DictWriter(text, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        return text.getvalue(), sample

    return make


def _times(factor: Callable[[Row], float], column: str = "bsdf_per_sr") -> Callable[[Row], None]:
    def change(row: Row) -> None:
        row[column] = f"{float(row[column]) * factor(row):.9g}"

    return change


def _cosine(row: Row) -> float:
    return math.cos(math.radians(float(row["theta_o_deg"])))


def _exchange(row: Row) -> None:
    row["theta_i_deg"], row["theta_o_deg"] = row["theta_o_deg"], row["theta_i_deg"]


def _turn(row: Row) -> None:
    row["phi_deg"] = f"{(float(row['phi_deg']) + 180) % 360:g}"


def _other_side(row: Row) -> None:
    row["side"] = "T" if row["side"] == "R" else "R"


def _layers_reversed(data: str, sample: str) -> tuple[str, str]:
    head, *layers = sample.split("[[layers]]")
    last, mark, tail = layers[-1].partition("[noise]")
    layers = [layer.rstrip() + "\n\n" for layer in (*layers[:-1], last)]
    swapped = {"back_roughness": "front_roughness", "front_roughness": "back_roughness"}
    layers = [re.sub("|".join(swapped), lambda m: swapped[m[0]], layer) for layer in layers]
    return data, head + "".join("[[layers]]" + layer for layer in reversed(layers)) + mark + tail


def _thousandth_thickness(data: str, sample: str) -> tuple[str, str]:
    return data, re.sub(r"thickness_um = (.*)", lambda m: f"thickness_um = {float(m[1]) / 1000:g}", sample)


# By the name of the mistake that should be named.
FAULTS: dict[str, Callable[[str, str], tuple[str, str]]] = {
    "times_cosine": _edited(_times(_cosine)),
    "divided_by_cosine": _edited(_times(lambda row: 1 / _cosine(row))),
    "times_pi": _edited(_times(lambda _: math.pi)),
    "per_cent": _edited(_times(lambda _: 100.0)),
    "phi_turned": _edited(_turn),
    "sides_exchanged": _edited(_other_side),
    "lit_from_other_side": _layers_reversed,
    "angles_exchanged": _edited(_exchange),
    "more_light_than_arrives": _edited(_times(lambda _: 2.5)),
    "thickness_of_ink_too_small": _thousandth_thickness,
    "sigma_relative": _edited(_times(lambda row: 1 / float(row["bsdf_per_sr"]), "sigma_per_sr")),
    "sigma_times_value": _edited(_times(lambda row: float(row["bsdf_per_sr"]), "sigma_per_sr")),
}
# Words by which the reader, which rejects impossible values before any fit, names the same mistake.
READER_WORDS = {
    "times_pi": "reflectance factors by pi",
    "per_cent": "values in per cent by 100",
    "more_light_than_arrives": "times the incident light",
}
