"""A sample as plain data, for result files, and back."""

import dataclasses
import math
from typing import Any

from jaxink.sample.description import Backing, Layer, Noise, Sample
from jaxink.sample.dispersion import Dispersion
from jaxink.sample.parameters import Parameter, ParameterTable, Prior
from jaxink.sample.populations import Population
from jaxink.sample.roughness import Roughness


def sample_to_dict(sample: Sample) -> dict[str, Any]:
    """Plain data of a sample.

    Parameters
    ----------
    sample
        The sample.

    Returns
    -------
    dict
        Of strings, numbers, lists and None only; infinite ranges are None.
    """
    plain = {f.name: getattr(sample, f.name) for f in dataclasses.fields(sample)}
    plain["layers"] = [dataclasses.asdict(layer) for layer in sample.layers]
    plain["backing"] = sample.backing and dataclasses.asdict(sample.backing)
    plain["noise"] = dataclasses.asdict(sample.noise)
    plain["dispersions"] = [dataclasses.asdict(dispersion) for dispersion in sample.dispersions]
    plain["parameters"] = [
        {k: _finite_or_none(v) for k, v in dataclasses.asdict(p).items()} for p in sample.parameters.values()
    ]
    return plain


def sample_from_dict(plain: dict[str, Any]) -> Sample:
    """Sample from the data of `sample_to_dict`.

    Parameters
    ----------
    plain
        The data.

    Returns
    -------
    Sample
    """
    layers = []
    for layer in plain["layers"]:
        table = layer["phase_table"]
        table = table and (table[0], tuple(table[1]), tuple(table[2]))
        faces = tuple(_roughness(face) for face in layer["roughness"])
        # Results of before there were several kinds of particles lack these keys.
        populations = tuple(
            Population(p["name"], _pair(p["radius_table"])) for p in layer.get("populations", ())
        )
        particles = {"radius_table": _pair(layer.get("radius_table")), "populations": populations}
        layers.append(Layer(**{**layer, "phase_table": table, "roughness": faces, **particles}))
    backing = plain.get("backing")
    parameters = []
    for p in plain["parameters"]:
        limits = {"value": math.nan, "minimum": -math.inf, "maximum": math.inf}
        filled = {k: limits.get(k) if v is None and k in limits else v for k, v in p.items()}
        prior = filled["prior"]
        parameters.append(Parameter(**{**filled, "prior": prior and Prior(**prior)}))
    return Sample(
        **{
            **plain,
            "layers": tuple(layers),
            "parameters": ParameterTable(parameters),
            "backing": backing and Backing(**backing),
            "noise": Noise(**plain["noise"]),
            "wavelengths_nm": tuple(plain["wavelengths_nm"]),
            "masks": tuple((k, v) for k, v in plain["masks"]),
            "weights": tuple(tuple(w) for w in plain["weights"]),
            "illumination": _pair(plain.get("illumination")),
            "dispersions": tuple(_dispersion(d) for d in plain.get("dispersions", ())),
        }
    )


def _pair(columns):
    """A table of two columns, or None."""
    return columns and tuple(tuple(column) for column in columns)


def _roughness(plain: dict[str, Any]) -> Roughness:
    nodes = plain.get("nodes")
    return Roughness(**{**plain, "nodes": nodes and (tuple(nodes[0]), tuple(nodes[1]), nodes[2])})


def _dispersion(plain: dict[str, Any]) -> Dispersion:
    columns = {key: tuple(plain[key]) for key in ("wavelength_nm", "value")}
    return Dispersion(**{**plain, **columns})


def _finite_or_none(value):
    return None if isinstance(value, float) and not math.isfinite(value) else value
