"""A sample as the experimenter knows it: layers, surroundings, instrument, noise, parameters."""

import dataclasses
import math
import tomllib
from pathlib import Path
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.sample import schema
from jaxink.sample.parameters import Parameter, ParameterTable, Prior, unknown_name


@dataclasses.dataclass(frozen=True)
class Roughness:
    """Declared roughness of one face of a layer.

    Parameters
    ----------
    face
        ``front_roughness`` (towards the light) or ``back_roughness``.
    density, second_density
        Of `schema.ROUGHNESS_DENSITIES`; the second is None where there is one density only. Their angles are
        parameters: ``layer.face.sigma_deg``.
    """

    face: str
    density: str
    second_density: str | None = None


@dataclasses.dataclass(frozen=True)
class Layer:
    """One layer of the sample; its numbers live in the parameter table.

    Parameters
    ----------
    name
        First part of the names of its parameters.
    kind
        ``clear`` or ``scattering``.
    phase_function
        For a scattering layer: a key of `schema.PHASE_FUNCTIONS`.
    opaque
        Whether nothing comes out behind it.
    phase_table
        For ``tabulated``: ("angle_deg" or "moments", abscissae or None, values).
    roughness
        Faces that are declared rough.
    """

    name: str
    kind: str
    phase_function: str | None = None
    opaque: bool = False
    phase_table: tuple[str, tuple[float, ...], tuple[float, ...]] | None = None
    roughness: tuple[Roughness, ...] = ()

    @property
    def scatters(self) -> bool:
        """Whether light is scattered in it."""
        return self.kind == "scattering"


@dataclasses.dataclass(frozen=True)
class Noise:
    """Declared noise of the measurement; None where nothing is declared.

    Parameters
    ----------
    relative, floor_per_sr
        Independent for each point: sigma^2 = (relative f)^2 + floor^2.
    scan_relative
        Standard deviation of the unknown common factor of each scan.
    use_file_sigma
        Whether the sigma column of a file, where it has one, goes before ``relative`` and ``floor``.
    """

    relative: float | None = None
    floor_per_sr: float = 0.0
    scan_relative: float = 0.0
    use_file_sigma: bool = True


@dataclasses.dataclass(frozen=True)
class Sample:
    """What is known of a sample and of its measurement.

    Parameters
    ----------
    layers
        In the order in which light meets them.
    parameters
        All numbers.
    title
        For people.
    wavelengths_nm
        Wavelengths whose rows are used; empty: all of the file.
    source_half_angle_deg, detector_half_angle_deg
        Cones of the instrument; 0 is a perfect one.
    noise
        Declared noise.
    masks
        Half-angles and limits of the masks, by key of `schema.MASKS`.
    weights
        (incidence in degrees or None for all, side or None for both, weight) for residuals.
    """

    layers: tuple[Layer, ...]
    parameters: ParameterTable
    title: str = ""
    wavelengths_nm: tuple[float, ...] = ()
    source_half_angle_deg: float = 0.0
    detector_half_angle_deg: float = 0.0
    noise: Noise = Noise()
    masks: tuple[tuple[str, float], ...] = ()
    weights: tuple[tuple[float | None, str | None, float], ...] = ()


def load_sample(path: str | Path) -> Sample:
    """Read a sample file.

    Parameters
    ----------
    path
        TOML file, as `docs/sample-file.md` describes it.

    Returns
    -------
    Sample

    Raises
    ------
    InputRefusedError
        Naming the file and the key, what is wrong and what would be right.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputRefusedError(f"{path}: there is no such sample file.") from None
    except (OSError, UnicodeDecodeError) as problem:
        raise InputRefusedError(f"{path}: cannot be read as a text file ({problem}).") from None
    return parse_sample(text, str(path))


def parse_sample(text: str, source: str = "sample") -> Sample:
    """Read the text of a sample file; see `load_sample`.

    Parameters
    ----------
    text
        TOML.
    source
        Name for messages.

    Returns
    -------
    Sample
    """
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as problem:
        raise InputRefusedError(f"{source}: is not valid TOML: {problem}.") from None
    try:
        return _Reader(document).sample()
    except InputRefusedError as problem:
        raise InputRefusedError(f"{source}: {problem}") from None


_TOP_KEYS = (
    "schema_version",
    "title",
    "wavelength_nm",
    "lit_side",
    "surroundings",
    "layers",
    "instrument",
    "noise",
    "masks",
    "weights",
)
_PARAMETER_KEYS = ("value", "free", "min", "max", "unit", "tie", "prior", "per_wavelength")


class _Reader:
    """Turns a parsed document into a `Sample`, refusing everything it does not know."""

    def __init__(self, document: dict[str, Any]):
        self.document = document
        self.parameters: list[Parameter] = []

    def sample(self) -> Sample:
        document = self.document
        _only(document, _TOP_KEYS, "the file")
        version = document.get("schema_version")
        if version != schema.SCHEMA_VERSION:
            raise InputRefusedError(
                f"schema_version is {version!r}; this jaxink reads {schema.SCHEMA_VERSION}, so write "
                f"`schema_version = {schema.SCHEMA_VERSION}` at the top."
            )
        self.wavelengths = self._wavelengths()
        surroundings = _table(document, "surroundings")
        _only(surroundings, schema.SURROUNDINGS, "[surroundings]")
        for key, quantity in schema.SURROUNDINGS.items():
            self._quantity("surroundings", key, quantity, surroundings)
        layers = tuple(self._layer(i, table) for i, table in enumerate(self._layer_tables()))
        names = [layer.name for layer in layers]
        for name in names:
            if names.count(name) > 1 or name == "surroundings":
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
        instrument = self._settings("instrument", schema.INSTRUMENT)
        return Sample(
            layers=layers,
            parameters=ParameterTable(self.parameters),
            title=str(document.get("title", "")),
            wavelengths_nm=self.wavelengths,
            source_half_angle_deg=instrument["source_half_angle_deg"],
            detector_half_angle_deg=instrument["detector_half_angle_deg"],
            noise=self._noise(),
            masks=tuple(self._settings("masks", schema.MASKS).items()),
            weights=self._weights(),
        )

    def _wavelengths(self) -> tuple[float, ...]:
        given = self.document.get("wavelength_nm", [])
        given = given if isinstance(given, list) else [given]
        if not all(_is_number(w) and 100 <= w <= 1e5 for w in given):
            raise InputRefusedError(
                f"wavelength_nm is {given}; it must be a number or a list of numbers, in nanometres "
                "(100 ... 100000)."
            )
        if len(set(given)) != len(given):
            raise InputRefusedError(f"wavelength_nm names a wavelength twice: {given}.")
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
        kind = _choice(table, "kind", ("clear", "scattering"), where)
        roughness = tuple(self._roughness(name, face, table[face]) for face in schema.FACES if face in table)
        if kind == "clear":
            _only(table, ("name", "kind", *schema.FACES, *schema.CLEAR_LAYER), where)
            for key, quantity in schema.CLEAR_LAYER.items():
                self._quantity(name, key, quantity, table)
            return Layer(name, kind, roughness=roughness)
        phase = _choice(table, "phase_function", tuple(schema.PHASE_FUNCTIONS), where)
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
        keys = ("name", "kind", "phase_function", "thickness_um", *schema.FACES, *quantities, *extra)
        _only(table, keys, where)
        for key, quantity in quantities.items():
            self._quantity(name, key, quantity, table)
        phase_table = self._phase_table(table, where) if phase == "tabulated" else None
        return Layer(name, kind, phase, opaque, phase_table, roughness)

    def _roughness(self, layer: str, face: str, given: Any) -> Roughness:
        """A face that is declared rough; its numbers become parameters."""
        where = f"{layer}.{face}"
        if not isinstance(given, dict):
            raise InputRefusedError(f'{where} must be {{ density = "...", sigma_deg = ... }}.')
        second = given.get("second_density")
        quantities = schema.ROUGHNESS | (schema.SECOND_ROUGHNESS if second is not None else {})
        _only(given, ("density", "second_density", *quantities), where)
        density = _choice(given, "density", schema.ROUGHNESS_DENSITIES, where)
        if second is not None:
            _choice(given, "second_density", schema.ROUGHNESS_DENSITIES, where)
        for key, quantity in quantities.items():
            self._quantity(where, key, quantity, given)
        return Roughness(face, density, second)

    def _phase_table(self, table, where):
        by_angle, by_moments = "phase_value" in table, "moments" in table
        if by_angle == by_moments:
            raise InputRefusedError(
                f"{where} has a tabulated phase function: give either moments = [1, ...] or angle_deg and "
                "phase_value."
            )
        columns = [table.get(k) for k in (("angle_deg", "phase_value") if by_angle else ("moments",))]
        for column in columns:
            if not isinstance(column, list) or not all(_is_number(v) for v in column):
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
        """Read one number, or one for each wavelength, into the parameter table."""
        name, given = f"{layer}.{key}", table.get(key, quantity.default)
        if given is None:
            raise InputRefusedError(
                f"{name} is missing; write {key} = <number{' in ' + quantity.unit if quantity.unit else ''}>."
            )
        entry = given if isinstance(given, dict) else {"value": given}
        _only(entry, _PARAMETER_KEYS, name)
        if entry.get("unit", quantity.unit) != quantity.unit:
            raise InputRefusedError(
                f"{name} has unit = {entry['unit']!r}; it is always in "
                f"{quantity.unit or 'no unit (a pure number)'}, as its name says."
            )
        each = entry.get("per_wavelength", False)
        if not isinstance(each, bool):
            raise InputRefusedError(f"{name}: per_wavelength is {each!r}; it must be true or false.")
        if not each:
            self.parameters.append(_parameter(name, entry, quantity))
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
            self.parameters.append(_parameter(f"{name}@{wavelength:g}", one, quantity))

    def _settings(self, table_name: str, keys: dict) -> dict[str, float]:
        table = _table(self.document, table_name)
        _only(table, keys, f"[{table_name}]")
        return {
            key: _bounded(table.get(key, default), lowest, highest, f"{table_name}.{key}", unit)
            for key, (lowest, highest, default, unit) in keys.items()
        }

    def _noise(self) -> Noise:
        table = _table(self.document, "noise")
        _only(table, (*schema.NOISE, "use_file_sigma"), "[noise]")
        values = {}
        for key, (lowest, highest, default, unit) in schema.NOISE.items():
            value = table.get(key, default)
            values[key] = None if value is None else _bounded(value, lowest, highest, f"noise.{key}", unit)
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
            _only(table, ("theta_i_deg", "side", "weight"), "[[weights]]")
            side, angle = table.get("side"), table.get("theta_i_deg")
            if side not in (None, "R", "T"):
                raise InputRefusedError(f'weights.side is {side!r}; it must be "R" or "T".')
            if angle is not None:
                angle = _bounded(angle, 0, 90, "weights.theta_i_deg", "deg")
            weight = _bounded(table.get("weight"), 0, math.inf, "weights.weight", "")
            result.append((angle, side, weight))
        return tuple(result)


def _parameter(name: str, entry: dict[str, Any], quantity: schema.Quantity) -> Parameter:
    """One checked parameter."""
    unit = quantity.unit
    tie, free = entry.get("tie"), entry.get("free", False)
    if not isinstance(free, bool):
        raise InputRefusedError(f"{name}: free is {free!r}; it must be true or false.")
    if tie is not None:
        if free or "value" in entry or not isinstance(tie, str):
            raise InputRefusedError(
                f'{name} has a tie, which gives its value: write tie = "expression" without value and free.'
            )
        if "prior" in entry:
            raise InputRefusedError(
                f"{name} has a tie and a prior; give the prior to the parameter it follows."
            )
        return Parameter(name, math.nan, False, quantity.lowest, quantity.highest, unit, tie)
    if "prior" in entry and not free:
        raise InputRefusedError(f"{name} has a prior but is fixed; write free = true, or remove the prior.")
    lowest, highest = entry.get("min"), entry.get("max")
    if free and (lowest is None or highest is None):
        raise InputRefusedError(f"{name} is free and needs a range: give min and max.")
    lowest = quantity.lowest if lowest is None else lowest
    highest = quantity.highest if highest is None else highest
    for key, value in (("min", lowest), ("max", highest)):
        _bounded(value, quantity.lowest, quantity.highest, f"{name}: {key}", unit)
    if not lowest < highest:
        raise InputRefusedError(f"{name}: min = {lowest:g} is not below max = {highest:g}.")
    value = entry.get("value", (lowest + highest) / 2 if free else None)
    if value is None:
        raise InputRefusedError(f"{name} is fixed and has no value.")
    value = _bounded(value, quantity.lowest, quantity.highest, name, unit)
    if free and not lowest <= value <= highest:
        raise InputRefusedError(
            f"{name}: the start value {value:g} lies outside its range {lowest:g} ... {highest:g}."
        )
    prior = _prior(name, entry)
    return Parameter(
        name,
        value,
        free,
        float(lowest),
        float(highest),
        unit,
        prior=prior,
        scale=quantity.scale,
        multimodal=quantity.multimodal,
    )


def _prior(name: str, entry: dict[str, Any]) -> Prior | None:
    prior = entry.get("prior")
    if prior is None:
        return None
    if not isinstance(prior, dict) or set(prior) != {"mean", "standard_deviation"}:
        raise InputRefusedError(f"{name}: prior must be {{ mean = ..., standard_deviation = ... }}.")
    mean = _bounded(prior["mean"], -math.inf, math.inf, f"{name}: prior.mean", "")
    deviation = _bounded(prior["standard_deviation"], 0, math.inf, f"{name}: prior.standard_deviation", "")
    if deviation == 0:
        raise InputRefusedError(f"{name}: prior.standard_deviation is 0; fix the parameter instead.")
    return Prior(mean, deviation)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _bounded(value: Any, lowest: float, highest: float, name: str, unit: str) -> float:
    """A finite number within limits, or a sentence."""
    unit = f" {unit}" if unit else ""
    if not _is_number(value):
        raise InputRefusedError(f"{name} is {value!r}; it must be a finite number{unit and ' in' + unit}.")
    if not lowest <= value <= highest:
        raise InputRefusedError(
            f"{name} is {value:g}{unit}; it must lie between {lowest:g} and {highest:g}{unit}."
        )
    return float(value)


def _only(table: dict[str, Any], known, where: str) -> None:
    """Refuse keys that mean nothing, with the nearest that would."""
    for key in table:
        if key not in known:
            raise InputRefusedError(f"{where} has the key '{key}', {unknown_name(key, known)}")


def _table(document: dict[str, Any], name: str) -> dict[str, Any]:
    table = document.get(name, {})
    if not isinstance(table, dict):
        raise InputRefusedError(f"{name} must be a table: write [{name}] and its keys below.")
    return table


def _choice(table: dict[str, Any], key: str, known: tuple[str, ...], where: str) -> str:
    value = table.get(key)
    if value not in known:
        raise InputRefusedError(f"{where} has {key} = {value!r}; it must be one of: {', '.join(known)}.")
    return value
