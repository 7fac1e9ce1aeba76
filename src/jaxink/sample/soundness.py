"""Checks of a sample that was not read from a sample file."""

import itertools
from collections.abc import Iterator

from jaxink.errors import InputRefusedError, require_one_of
from jaxink.sample import schema
from jaxink.sample.description import Layer, Sample
from jaxink.sample.effect_schema import EFFECTS
from jaxink.sample.measurement_schema import DETECTOR_MODES, MASKS, SIDES
from jaxink.sample.roughness import Roughness
from jaxink.sample.schema import HEIGHT_MAP_WORD, Quantity


def require_sound(sample: Sample) -> None:
    """Reject a sample with unknown words, or without a number that it needs."""
    if not any(layer.scatters for layer in sample.layers):
        raise InputRefusedError("layers has no scattering layer; there must be at least one.")
    names = [layer.name for layer in sample.layers]
    for name in names:
        if names.count(name) > 1:
            raise InputRefusedError(f"two layers are named '{name}'; their names must differ.")
    if any(layer.opaque for layer in sample.layers[:-1]):
        raise InputRefusedError("a layer before the last one is opaque; only the last layer may be.")
    for layer in sample.layers:
        _require_sound_layer(layer)
    for dispersion in sample.dispersions:
        require_one_of(
            f"formula of {dispersion.name}", dispersion.formula, (*schema.DISPERSIONS, *schema.LAWS)
        )
        if dispersion.formula == "table":
            _require_columns(dispersion.name, (dispersion.wavelength_nm, dispersion.value), 2)
            _require_ascending(dispersion.name, dispersion.wavelength_nm)
    if sample.backing is not None:
        require_one_of("side of the backing", sample.backing.side, schema.BACKING_SIDES)
    if sample.detector_mode is not None:
        require_one_of("detector_mode", sample.detector_mode, DETECTOR_MODES)
    if sample.illumination is not None:
        _require_columns("illumination", sample.illumination, 2)
        _require_ascending("illumination", sample.illumination[0])
    if {key for key, _ in sample.masks} - set(MASKS):
        raise InputRefusedError(f"masks has unknown keys; valid keys are: {', '.join(MASKS)}.")
    for weight in sample.weights:
        if weight.side is not None:
            require_one_of("side of weights", weight.side, SIDES)
    _require_numbers(sample)


def _require_sound_layer(layer: Layer) -> None:
    where = f"layer '{layer.name}'"
    require_one_of(f"kind of {where}", layer.kind, ("clear", "scattering"))
    if layer.scatters:
        require_one_of(f"phase_function of {where}", layer.phase_function, tuple(schema.PHASE_FUNCTIONS))
    if (layer.phase_table is not None) != (layer.phase_function == "tabulated"):
        raise InputRefusedError(f"{where}: phase_table must be given for a tabulated phase function only.")
    if layer.phase_table is not None:
        kind, angles, values = layer.phase_table
        require_one_of(f"phase_table of {where}", kind, ("moments", "angle_deg"))
        columns = (angles, values) if kind == "angle_deg" else (range(len(values)), values)
        _require_columns(f"phase_table of {where}", columns, 1)
    for table in layer.particles.values():
        if table is not None:
            _require_columns(f"radius_table of {where}", table, 1)
    for face in layer.roughness:
        _require_sound_face(face, layer.name)


def _require_sound_face(face: Roughness, layer: str) -> None:
    require_one_of(f"face of {face.name}", face.face, schema.FACES)
    if face.name != f"{layer}.{face.face}":
        raise InputRefusedError(f"{face.name} is a face of layer '{layer}'; its name must begin with that.")
    if (face.density is None) == (face.spectrum is None):
        raise InputRefusedError(f"{face.name} must have either a density or a spectrum.")
    if face.density is not None:
        densities = (*schema.ROUGHNESS_DENSITIES, HEIGHT_MAP_WORD)
        require_one_of(f"density of {face.name}", face.density, densities)
    else:
        require_one_of(f"spectrum of {face.name}", face.spectrum, (*schema.SPECTRA, HEIGHT_MAP_WORD))
        require_one_of(f"amplitude of {face.name}", face.amplitude, schema.AMPLITUDES)
    if face.second_density is not None:
        require_one_of(f"second_density of {face.name}", face.second_density, schema.ROUGHNESS_DENSITIES)
    if (face.nodes is not None) != (HEIGHT_MAP_WORD in (face.density, face.spectrum)):
        raise InputRefusedError(f"{face.name}: nodes must be given for a height map only.")
    if face.nodes is not None:
        _require_columns(f"nodes of {face.name}", face.nodes[:2], 2)
        _require_ascending(f"nodes of {face.name}", face.nodes[0])


def _require_columns(name: str, columns, least: int) -> None:
    first, second = columns
    if len(first) != len(second) or len(first) < least:
        raise InputRefusedError(
            f"{name} has columns of {len(first)} and {len(second)} numbers; they must be equally long, at "
            f"least {least}."
        )


def _require_ascending(name: str, column) -> None:
    if any(b <= a for a, b in itertools.pairwise(column)):
        raise InputRefusedError(f"the first column of {name} must be in ascending order.")


def _require_numbers(sample: Sample) -> None:
    """Reject a sample without a number that it needs."""
    given = {*sample.parameters, *(dispersion.name for dispersion in sample.dispersions)}
    for name in _asked(sample):
        each = [f"{name}@{wavelength_nm:g}" for wavelength_nm in sample.wavelengths_nm] or [name]
        if name not in given and not given.issuperset(each):
            raise InputRefusedError(f"parameters does not contain {name}, which the sample needs.")


def _asked(sample: Sample) -> Iterator[str]:
    tables: list[tuple[str, dict[str, Quantity]]] = [("surroundings", schema.SURROUNDINGS)]
    if sample.backing is not None:
        tables.append(("backing", schema.BACKING))
    tables += [(d.name, d.coefficients) for d in sample.dispersions]
    for layer in sample.layers:
        tables += [(layer.name, table) for table in _tables_of(layer)]
        tables += [(f"{layer.name}.{p.name}", _particles(p.radius_table)) for p in layer.populations]
        tables += [(face.name, table) for face in layer.roughness for table in _tables_of_face(face)]
    tables += [(ink, schema.INKS) for ink in sample.inks]
    tables += [
        (f"{layer.name}.mixture", dict.fromkeys(layer.mixture, schema.SHARE)) for layer in sample.layers
    ]
    tables += [(e.name, EFFECTS[e.name].numbers) for e in sample.effects if e.name in EFFECTS]
    yield from (f"{where}.{key}" for where, table in tables for key in table)


def _tables_of(layer: Layer) -> Iterator[dict[str, Quantity]]:
    if not layer.scatters:
        yield schema.CLEAR_LAYER
        return
    yield {k: q for k, q in schema.SCATTERING_LAYER.items() if not (layer.opaque and k == "thickness_um")}
    if layer.phase_function == "mie":
        yield _particles(layer.radius_table)
        return
    yield schema.ALBEDO if layer.opaque else schema.COEFFICIENTS
    if layer.phase_function is not None:
        yield schema.PHASE_FUNCTIONS[layer.phase_function]


def _particles(radius_table) -> dict[str, Quantity]:
    return {k: q for k, q in schema.MIE.items() if k != "radius_nm" or radius_table is None}


def _tables_of_face(face: Roughness) -> Iterator[dict[str, Quantity]]:
    if face.nodes is not None:
        yield schema.HEIGHT_MAP
    else:
        yield schema.SPECTRA[face.spectrum] if face.spectrum is not None else schema.ROUGHNESS
    if face.second_density is not None:
        yield schema.SECOND_ROUGHNESS
