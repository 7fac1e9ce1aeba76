"""The text of a sample file for a sample, for example one that a fit or a diagnosis has changed."""

import dataclasses
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.sample import measurement_schema, schema
from jaxink.sample.description import Layer, Sample
from jaxink.sample.effect_schema import EFFECTS
from jaxink.sample.ink_mixtures import MIXED
from jaxink.sample.parameters import Parameter
from jaxink.sample.roughness import Roughness
from jaxink.sample.schema import HEIGHT_MAP_WORD
from jaxink.sample.ties import at_wavelength


def sample_text(sample: Sample, remarks: Mapping[str, str] | None = None, head: Iterable[str] = ()) -> str:
    """Text of a sample file that `parse_sample` reads back as the same sample.

    Parameters
    ----------
    sample
        The sample.
    remarks
        Comments by the name of a parameter or of a table, such as ``effects.gain``.
    head
        Lines of a comment at the top.
    """
    writer = _Writer(sample, remarks or {})
    lines = [
        *(f"# {line}".rstrip() for line in head),
        f"schema_version = {measurement_schema.SCHEMA_VERSION}",
    ]
    if sample.title:
        lines.append(f"title = {_word(sample.title)}")
    if sample.wavelengths_nm:
        lines.append(f"wavelength_nm = {_list(sample.wavelengths_nm)}")
    return "\n".join([*lines, *writer.tables()]) + "\n"


@dataclasses.dataclass(frozen=True)
class _Writer:
    """Writes the tables of a sample."""

    sample: Sample
    remarks: Mapping[str, str]

    def tables(self) -> Iterator[str]:
        """Lines of all tables."""
        sample = self.sample
        yield from self._table("[surroundings]", "surroundings", schema.SURROUNDINGS)
        for ink in sample.inks:
            yield from self._table(f"[inks.{ink}]", ink, schema.INKS, remark=ink)
        for layer in sample.layers:
            yield from self._layer(layer)
        if sample.backing is not None:
            yield from self._table(
                "[backing]",
                "backing",
                schema.BACKING,
                side=sample.backing.side,
                contact=sample.backing.contact,
            )
        yield from self._instrument()
        yield from _plain_table("[noise]", dataclasses.asdict(sample.noise))
        yield from _plain_table("[masks]", dict(sample.masks))
        for weight in sample.weights:
            yield from _plain_table("[[weights]]", dataclasses.asdict(weight))
        for effect in sample.effects:
            yield from self._table(
                f"[effects.{effect.name}]",
                effect.name,
                self._numbers_of_effect(effect.name),
                remark=f"effects.{effect.name}",
                **dict(effect.form),
            )

    def _numbers_of_effect(self, name: str) -> Iterable[str]:
        if name in EFFECTS:
            return EFFECTS[name].numbers
        return [p.split(".", 1)[1] for p in self.sample.parameters if p.startswith(f"{name}.")]

    def _layer(self, layer: Layer) -> Iterator[str]:
        fixed: dict[str, Any] = {"name": layer.name, "kind": layer.kind}
        if layer.phase_function is not None:
            fixed["phase_function"] = layer.phase_function
        if layer.opaque:
            fixed["thickness_um"] = schema.OPAQUE
        if layer.phase_table is not None:
            kind, angles, values = layer.phase_table
            columns = (
                {"moments": values} if kind == "moments" else {"angle_deg": angles, "phase_value": values}
            )
            fixed |= columns
        fixed |= _radii(layer.radius_table)
        apart = {p.name for p in layer.populations}
        if layer.mixture:
            shares = {
                ink: _entry(self.sample.parameters[f"{layer.name}.mixture.{ink}"]) for ink in layer.mixture
            }
            fixed["mixture"] = _Written(_inline(shares))
            # What is tied to the shares follows from them.
            apart |= set(MIXED)
        keys = self._keys(layer.name, apart)
        yield from self._table("[[layers]]", layer.name, keys, remark=layer.name, **fixed)
        for face in layer.roughness:
            yield from self._face(face)
        for population in layer.populations:
            stem = f"{layer.name}.{population.name}"
            fixed = {"name": population.name} | _radii(population.radius_table)
            yield from self._table("[[layers.populations]]", stem, self._keys(stem), remark=stem, **fixed)

    def _keys(self, owner: str, apart: Iterable[str] = ()) -> list[str]:
        """Keys of the numbers of one table, without those of the tables inside it."""
        inner = {*schema.FACES, *apart}
        names = [*self.sample.parameters, *(d.name for d in self.sample.dispersions)]
        found = (
            name.removeprefix(f"{owner}.").split("@")[0] for name in names if name.startswith(f"{owner}.")
        )
        return list(dict.fromkeys(key.split(".")[0] for key in found if key.split(".")[0] not in inner))

    def _face(self, face: Roughness) -> Iterator[str]:
        fixed: dict[str, Any] = {}
        for key in ("density", "second_density", "spectrum", "amplitude"):
            if getattr(face, key) is not None:
                fixed[key] = getattr(face, key)
        if HEIGHT_MAP_WORD in fixed.values():
            fixed |= {"heights_um": face.heights_um, "pitch_um": face.pitch_um}
        yield from self._table(
            f"[layers.{face.face}]", face.name, self._keys(face.name), remark=face.name, **fixed
        )

    def _instrument(self) -> Iterator[str]:
        sample, keys = self.sample, self._keys("instrument")
        fixed: dict[str, Any] = {
            key: getattr(sample, key) for key in measurement_schema.INSTRUMENT if key not in keys
        } | {"detector_mode": sample.detector_mode}
        if sample.illumination is not None:
            columns = zip(measurement_schema.ILLUMINATION, sample.illumination, strict=True)
            fixed["illumination"] = dict(columns)
        yield from self._table("[instrument]", "instrument", keys, **fixed)

    def _table(
        self, head: str, owner: str, keys: Iterable[str], *, remark: str = "", **fixed: Any
    ) -> Iterator[str]:
        """Lines of one table: what is no parameter, then the parameters ``owner.key``."""
        yield ""
        yield from self._remark(remark)
        yield head
        yield from (f"{key} = {_value(value)}" for key, value in fixed.items() if value is not None)
        for key in keys:
            name = f"{owner}.{key}"
            yield from self._remark(name)
            yield f"{key} = {self._number(name)}"

    def _remark(self, name: str) -> Iterator[str]:
        if name in self.remarks:
            yield from (f"# {line}" for line in self.remarks[name].splitlines())

    def _number(self, name: str) -> str:
        table = self.sample.parameters
        if name in table:
            return _entry(table[name])
        for dispersion in self.sample.dispersions:
            if dispersion.name == name:
                kind = "law" if dispersion.formula in schema.LAWS else "dispersion"
                parts = {kind: _word(dispersion.formula)}
                if dispersion.wavelength_nm:
                    parts |= {
                        "wavelength_nm": _list(dispersion.wavelength_nm),
                        "value": _list(dispersion.value),
                    }
                coefficients = dispersion.coefficients
                return _inline(parts | {key: _entry(table[f"{name}.{key}"]) for key in coefficients})
        each = [table[f"{name}@{wavelength_nm:g}"] for wavelength_nm in self.sample.wavelengths_nm]
        leading = next((p for p in each if p.free), each[0])
        parts = _parts(leading) | {"per_wavelength": "true"}
        if leading.free and not all(p.free for p in each):
            parts["free"] = f"[{', '.join('true' if p.free else 'false' for p in each)}]"
        if each[0].tie is None:
            parts["value"] = _list([p.value for p in each])
        else:
            parts["tie"] = _word(_common_tie(each, self.sample))
        return _inline(parts)


def _common_tie(each: Sequence[Parameter], sample: Sample) -> str:
    """The expression from which the ties of values at the wavelengths were made.

    It names no wavelength where a tie names its own, and others where all ties name the same.
    """
    ties = [p.tie or "" for p in each]
    for tie, wavelength_nm in zip(ties, sample.wavelengths_nm, strict=True):
        common = re.sub(rf"@{re.escape(f'{wavelength_nm:g}')}(?![\w.])", "", tie)
        if ties == [at_wavelength(common, wave, sample.parameters) for wave in sample.wavelengths_nm]:
            return common
    names = ", ".join(p.name for p in each)
    raise InputRefusedError(f"the ties of {names} have no common expression that a sample file could hold.")


def _entry(parameter: Parameter) -> str:
    parts = _parts(parameter)
    return parts["value"] if list(parts) == ["value"] else _inline(parts)


def _parts(p: Parameter) -> dict[str, str]:
    """Keys of the table of one number; a fixed one has its value only."""
    shape = {"shape": _list(p.shape)} if p.shape else {}
    if p.tie is not None:
        return {"tie": _word(p.tie)} | shape
    if not p.free:
        return {"value": repr(p.value)} | shape
    parts = {"value": repr(p.value), "free": "true", "min": repr(p.minimum), "max": repr(p.maximum)} | shape
    if p.prior is not None:
        prior = {"mean": repr(p.prior.mean), "standard_deviation": repr(p.prior.standard_deviation)}
        parts["prior"] = _inline(prior)
    if p.smoothness is not None:
        parts["smoothness"] = _inline({k: repr(v) for k, v in vars(p.smoothness).items()})
    return parts


def _radii(table) -> dict[str, Any]:
    return {} if table is None else dict(zip(schema.RADIUS_TABLE, table, strict=True))


def _plain_table(head: str, entries: Mapping[str, Any]) -> Iterator[str]:
    yield ""
    yield head
    yield from (f"{key} = {_value(value)}" for key, value in entries.items() if value is not None)


class _Written(str):
    """A value that is TOML already."""


def _value(value: Any) -> str:
    if isinstance(value, _Written):
        return value
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _word(value)
    if isinstance(value, dict):
        return _inline({key: _value(inner) for key, inner in value.items()})
    if isinstance(value, tuple | list):
        return _list(value)
    return repr(value)


def _word(text: str) -> str:
    """A string in quotes; TOML escapes as JSON does, and also the character DEL."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _list(numbers: Iterable[float]) -> str:
    return f"[{', '.join(map(repr, numbers))}]"


def _inline(parts: Mapping[str, str]) -> str:
    return f"{{ {', '.join(f'{key} = {value}' for key, value in parts.items())} }}"
