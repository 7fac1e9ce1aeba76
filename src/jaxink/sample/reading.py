"""Sample files: read, checked, and turned into a `Sample`; everything unknown is refused."""

import math
from collections import Counter
from pathlib import Path
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.sample import schema
from jaxink.sample.description import Backing, Layer, Noise, Sample
from jaxink.sample.dispersion import Dispersion, read_dispersion
from jaxink.sample.document import document_of, text_of
from jaxink.sample.entries import (
    bounded,
    choice,
    is_number,
    missing,
    only,
    parameter_entry,
    parameter_of,
    table_of,
)
from jaxink.sample.parameters import Parameter, ParameterTable
from jaxink.sample.populations import Population, check_volume, population_tables, radius_table
from jaxink.sample.roughness import read_roughness


def load_sample(path: str | Path) -> Sample:
    """Read a sample file.

    Parameters
    ----------
    path
        TOML file, as `docs/sample-file.md` describes it.

    Raises
    ------
    InputRefusedError
        Naming the file and the key, what is wrong and what would be right.
    """
    path = Path(path)
    return parse_sample(text_of(path, "sample"), str(path), path.parent)


def parse_sample(text: str, source: str = "sample", folder: str | Path | None = None) -> Sample:
    """Read the text of a sample file; see `load_sample`.

    Parameters
    ----------
    text
        TOML.
    source
        Name for messages.
    folder
        Where files that it names are looked for; None: the working folder.
    """
    document = document_of(text, source)
    try:
        return _Reader(document, Path(folder or ".")).sample()
    except InputRefusedError as problem:
        raise InputRefusedError(f"{source}: {problem}") from None


_TOP_KEYS = (
    "schema_version",
    "title",
    "wavelength_nm",
    "lit_side",
    "surroundings",
    "layers",
    "backing",
    "instrument",
    "noise",
    "masks",
    "weights",
)


class _Reader:
    """Turns a parsed document into a `Sample`, refusing everything it does not know."""

    def __init__(self, document: dict[str, Any], folder: Path):
        self.document, self.folder = document, folder
        self.parameters: list[Parameter] = []
        self.dispersions: list[Dispersion] = []

    def sample(self) -> Sample:
        document = self.document
        only(document, _TOP_KEYS, "the file")
        version = document.get("schema_version")
        if version is True or version != schema.SCHEMA_VERSION:
            raise InputRefusedError(
                f"schema_version is {version!r}; this jaxink reads {schema.SCHEMA_VERSION}, so write "
                f"`schema_version = {schema.SCHEMA_VERSION}` at the top."
            )
        self.wavelengths = self._wavelengths()
        surroundings = table_of(document, "surroundings")
        only(surroundings, schema.SURROUNDINGS, "[surroundings]")
        for key, quantity in schema.SURROUNDINGS.items():
            self._quantity("surroundings", key, quantity, surroundings)
        layers = tuple(self._layer(i, table) for i, table in enumerate(self._layer_tables()))
        backing = self._backing(layers[-1])
        names = [layer.name for layer in layers]
        for name, count in Counter(names).items():
            if count > 1 or name == "surroundings" or (name == "backing" and backing):
                raise InputRefusedError(f"two layers are named '{name}'; give each a name of its own.")
        if not any(layer.scatters for layer in layers):
            raise InputRefusedError(
                'no layer has kind = "scattering"; there is no ink whose properties could be found.'
            )
        for layer in layers[:-1]:
            if layer.opaque:
                raise InputRefusedError(
                    f"layer '{layer.name}' is opaque but is not the last one: no light would reach "
                    f"'{layers[names.index(layer.name) + 1].name}'."
                )
        lit = document.get("lit_side", names[0])
        if lit != names[0]:
            raise InputRefusedError(
                f"lit_side is '{lit}' but the first layer is '{names[0]}': list the layers in the order "
                "in which light meets them."
            )
        instrument = self._settings("instrument", schema.INSTRUMENT, ("detector_mode", "illumination"))
        mode, illumination = self._light()
        if (instrument["beam_diameter_mm"] is None) != (instrument["detector_diameter_mm"] is None):
            raise InputRefusedError(
                "[instrument] has one of beam_diameter_mm and detector_diameter_mm; give both, or neither if "
                "the detector sees all light, wherever it comes out."
            )
        parameters = ParameterTable(self.parameters)
        for dispersion in self.dispersions:
            dispersion.check(parameters, self.wavelengths)
        for layer in layers:
            if layer.phase_function == "mie":
                check_volume(layer.name, list(layer.particles), parameters)
        return Sample(
            layers=layers,
            parameters=parameters,
            title=str(document.get("title", "")),
            wavelengths_nm=self.wavelengths,
            source_half_angle_deg=instrument["source_half_angle_deg"],
            detector_half_angle_deg=instrument["detector_half_angle_deg"],
            noise=self._noise(),
            masks=tuple(self._settings("masks", schema.MASKS).items()),
            weights=self._weights(),
            dispersions=tuple(self.dispersions),
            backing=backing,
            beam_diameter_mm=instrument["beam_diameter_mm"],
            detector_diameter_mm=instrument["detector_diameter_mm"],
            detector_mode=mode,
            illumination=illumination,
        )

    def _light(self):
        """What falls on the sample, and what the detector sees of it."""
        table = table_of(self.document, "instrument")
        mode = table.get("detector_mode")
        if mode is not None:
            choice(table, "detector_mode", schema.DETECTOR_MODES, "[instrument]")
        given = table.get("illumination")
        if given is None:
            return mode, None
        if not isinstance(given, dict) or set(given) != set(schema.ILLUMINATION):
            raise InputRefusedError(
                "instrument.illumination must be { wavelength_nm = [...], power = [...] }."
            )
        waves, power = (given[key] for key in schema.ILLUMINATION)
        lists = isinstance(waves, list) and isinstance(power, list) and len(waves) == len(power) >= 2
        if not lists or not all(is_number(v) and v >= 0 for v in (*waves, *power)):
            raise InputRefusedError(
                "instrument.illumination: wavelength_nm and power must be two lists of equally many numbers, "
                "two or more, none negative."
            )
        if any(b <= a for a, b in zip(waves, waves[1:], strict=False)):
            raise InputRefusedError("instrument.illumination: wavelength_nm must ascend.")
        return mode, (tuple(map(float, waves)), tuple(map(float, power)))

    def _wavelengths(self) -> tuple[float, ...]:
        given = self.document.get("wavelength_nm", [])
        given = given if isinstance(given, list) else [given]
        if not all(is_number(w) and 100 <= w <= 1e5 for w in given):
            raise InputRefusedError(
                f"wavelength_nm is {given}; it must be a number or a list of numbers, in nanometres "
                "(100 ... 100000)."
            )
        # As the names of parameters tell them apart.
        if len({f"{w:g}" for w in given}) != len(given):
            raise InputRefusedError(f"wavelength_nm names a wavelength twice, to six digits: {given}.")
        return tuple(sorted(float(w) for w in given))

    def _layer_tables(self) -> list[dict[str, Any]]:
        tables = self.document.get("layers")
        if not isinstance(tables, list) or not tables or not all(isinstance(t, dict) for t in tables):
            raise InputRefusedError(
                "there are no layers; write one [[layers]] table for each, in the order in which light "
                "meets them."
            )
        return tables

    def _layer(self, position: int, table: dict[str, Any]) -> Layer:
        name = table.get("name")
        if not isinstance(name, str) or not name.isidentifier():
            raise InputRefusedError(
                f"layer {position + 1} has name = {name!r}; it needs a name of letters, digits and "
                'underscores, such as name = "ink".'
            )
        where = f"layer '{name}'"
        kind = choice(table, "kind", ("clear", "scattering"), where)
        roughness = tuple(
            read_roughness(name, face, table[face], self.folder, self._quantity)
            for face in schema.FACES
            if face in table
        )
        if kind == "clear":
            only(table, ("name", "kind", *schema.FACES, *schema.CLEAR_LAYER), where)
            for key, quantity in schema.CLEAR_LAYER.items():
                self._quantity(name, key, quantity, table)
            return Layer(name, kind, roughness=roughness)
        phase = choice(table, "phase_function", tuple(schema.PHASE_FUNCTIONS), where)
        opaque = table.get("thickness_um") == schema.OPAQUE
        quantities = dict(schema.SCATTERING_LAYER)
        if opaque:
            del quantities["thickness_um"]
        if phase != "mie":
            quantities |= schema.ALBEDO if opaque else schema.COEFFICIENTS
        quantities |= schema.PHASE_FUNCTIONS[phase]
        if opaque and phase != "mie":
            for key in schema.COEFFICIENTS:
                if key in table:
                    raise InputRefusedError(
                        f"{where} is opaque, so {key} alone has no effect; give single_scattering_albedo, "
                        "which is scattering / (scattering + absorption)."
                    )
        extra = ("angle_deg", "moments", "phase_value") if phase == "tabulated" else ()
        radii = None
        if phase == "mie":
            radii = radius_table(table, where)
            quantities |= {k: q for k, q in schema.MIE_LAYER.items() if k in table}
            quantities = _particles(quantities, table)
            extra = (*schema.RADIUS_TABLE, *schema.SIZE_DISTRIBUTION, *schema.MIE_LAYER, "populations")
        keys = ("name", "kind", "phase_function", "thickness_um", *schema.FACES, *quantities, *extra)
        only(table, keys, where)
        for key, quantity in quantities.items():
            self._quantity(name, key, quantity, table)
        populations = self._populations(name, table, keys) if phase == "mie" else ()
        phase_table = self._phase_table(table, where) if phase == "tabulated" else None
        return Layer(name, kind, phase, opaque, phase_table, roughness, radii, populations)

    def _populations(self, layer: str, table: dict[str, Any], taken) -> tuple[Population, ...]:
        """Further kinds of Mie particles."""
        populations = []
        for inner in population_tables(table, layer, taken):
            name = f"{layer}.{inner['name']}"
            where = f"population '{name}'"
            only(inner, ("name", *schema.MIE, *schema.SIZE_DISTRIBUTION, *schema.RADIUS_TABLE), where)
            populations.append(Population(inner["name"], radius_table(inner, where)))
            for key, quantity in _particles(schema.MIE, inner).items():
                self._quantity(name, key, quantity, inner)
        return tuple(populations)

    def _backing(self, last: Layer) -> Backing | None:
        """A reflector behind the sample."""
        if "backing" not in self.document:
            return None
        table = table_of(self.document, "backing")
        only(table, ("side", "contact", *schema.BACKING), "[backing]")
        side = choice({"side": "R"} | table, "side", schema.BACKING_SIDES, "[backing]")
        contact = table.get("contact", False)
        if not isinstance(contact, bool):
            raise InputRefusedError(f"backing.contact is {contact!r}; it must be true or false.")
        if contact and "side" in table and side != "both":
            raise InputRefusedError(
                'backing.contact is true, so the backing cannot be taken away: write side = "both" or '
                "leave it out."
            )
        if last.opaque:
            raise InputRefusedError(
                f"there is a [backing] behind the opaque layer '{last.name}', which lets no light come to "
                "it; take it out, or give the layer a thickness."
            )
        for key, quantity in schema.BACKING.items():
            self._quantity("backing", key, quantity, table)
        return Backing("both" if contact else side, contact)

    def _phase_table(self, table, where):
        by_angle, by_moments = "phase_value" in table, "moments" in table
        if by_angle == by_moments:
            raise InputRefusedError(
                f"{where} has a tabulated phase function: give either moments = [1, ...] or angle_deg and "
                "phase_value."
            )
        columns = [table.get(k) for k in (("angle_deg", "phase_value") if by_angle else ("moments",))]
        for column in columns:
            if not isinstance(column, list) or not column or not all(is_number(v) for v in column):
                raise InputRefusedError(f"{where}: the table of the phase function must be numbers.")
        if by_moments:
            return "moments", (), tuple(map(float, columns[0]))
        if len(columns[0]) != len(columns[1]):
            raise InputRefusedError(
                f"{where}: angle_deg has {len(columns[0])} entries and phase_value {len(columns[1])}; "
                "they must be equally many."
            )
        return "angle_deg", tuple(map(float, columns[0])), tuple(map(float, columns[1]))

    def _quantity(self, layer: str, key: str, quantity: schema.Quantity, table: dict) -> None:
        """Read one number, one for each wavelength, or a dispersion into the parameter table."""
        name, given = f"{layer}.{key}", table.get(key, quantity.default)
        if given is None:
            raise missing(name, key, quantity)
        if isinstance(given, dict) and "dispersion" in given:
            dispersion, coefficients = read_dispersion(name, given, quantity)
            self.dispersions.append(dispersion)
            self.parameters.extend(coefficients)
            return
        entry = parameter_entry(given, name, quantity)
        each = entry.get("per_wavelength", False)
        if not isinstance(each, bool):
            raise InputRefusedError(f"{name}: per_wavelength is {each!r}; it must be true or false.")
        if not each:
            self.parameters.append(parameter_of(name, entry, quantity))
            return
        if not self.wavelengths:
            raise InputRefusedError(
                f"{name} has per_wavelength = true, but the file names no wavelengths; write "
                "wavelength_nm = [...] at the top."
            )
        values = entry.get("value")
        values = values if isinstance(values, list) else [values] * len(self.wavelengths)
        if len(values) != len(self.wavelengths):
            raise InputRefusedError(
                f"{name} has {len(values)} values for {len(self.wavelengths)} wavelengths; give one for "
                "each, by ascending wavelength, or a single one."
            )
        for wavelength, value in zip(self.wavelengths, values, strict=True):
            one = {k: v for k, v in entry.items() if k not in ("per_wavelength", "value")}
            one |= {} if value is None else {"value": value}
            self.parameters.append(parameter_of(f"{name}@{wavelength:g}", one, quantity))

    def _settings(self, table_name: str, keys: dict, further: tuple[str, ...] = ()) -> dict[str, float]:
        table = table_of(self.document, table_name)
        only(table, (*keys, *further), f"[{table_name}]")
        values = {}
        for key, (lowest, highest, default, unit) in keys.items():
            value = table.get(key, default)
            values[key] = (
                None if value is None else bounded(value, lowest, highest, f"{table_name}.{key}", unit)
            )
        return values

    def _noise(self) -> Noise:
        table = table_of(self.document, "noise")
        only(table, (*schema.NOISE, "use_file_sigma"), "[noise]")
        values = {}
        for key, (lowest, highest, default, unit) in schema.NOISE.items():
            value = table.get(key, default)
            values[key] = None if value is None else bounded(value, lowest, highest, f"noise.{key}", unit)
        use = table.get("use_file_sigma", True)
        if not isinstance(use, bool):
            raise InputRefusedError(f"noise.use_file_sigma is {use!r}; it must be true or false.")
        return Noise(**values, use_file_sigma=use)

    def _weights(self):
        tables = self.document.get("weights", [])
        if not isinstance(tables, list) or not all(isinstance(t, dict) for t in tables):
            raise InputRefusedError("weights must be [[weights]] tables.")
        result = []
        for table in tables:
            only(table, ("theta_i_deg", "side", "weight"), "[[weights]]")
            side, angle = table.get("side"), table.get("theta_i_deg")
            if side not in (None, "R", "T"):
                raise InputRefusedError(f'weights.side is {side!r}; it must be "R" or "T".')
            if angle is not None:
                angle = bounded(angle, 0, 90, "weights.theta_i_deg", "deg")
            weight = bounded(table.get("weight"), 0, math.inf, "weights.weight", "")
            result.append((angle, side, weight))
        return tuple(result)


def _particles(quantities: dict[str, schema.Quantity], table: dict[str, Any]) -> dict[str, schema.Quantity]:
    """Quantities of one kind of particles: what the file has of the size distribution decides."""
    spread = {k: q for k, q in schema.SIZE_DISTRIBUTION.items() if k in table}
    return {k: q for k, q in (quantities | spread).items() if k != "radius_nm" or "radii_nm" not in table}
