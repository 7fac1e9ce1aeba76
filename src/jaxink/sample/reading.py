"""Reading and checking sample files; anything unknown is rejected."""

from collections import Counter
from collections.abc import Collection
from pathlib import Path
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.files.decoding import read_json
from jaxink.files.result_folder import LARGEST_RESULT_BYTES, RESULT_FILE, SAMPLE_FILE
from jaxink.sample import schema
from jaxink.sample.archive import sample_from_dict
from jaxink.sample.declared_effects import own_kinds, read_effects
from jaxink.sample.description import Backing, Layer, Sample
from jaxink.sample.document import document_of, text_of
from jaxink.sample.entries import choice, only, require_version, table_of, true_or_false
from jaxink.sample.ink_mixtures import read_inks, require_no_unused
from jaxink.sample.layer_reading import layer_tables, read_layer
from jaxink.sample.measurement_reading import (
    read_instrument,
    read_masks,
    read_noise,
    read_wavelengths,
)
from jaxink.sample.measurement_schema import SCHEMA_VERSION, TOP
from jaxink.sample.mixture_shares import require_whole
from jaxink.sample.parameter_reading import ParameterReader
from jaxink.sample.parameters import ParameterTable
from jaxink.sample.populations import check_volume
from jaxink.sample.residual_weight import read_weights


def load_sample(path: str | Path, effects: Collection[Any] = ()) -> Sample:
    """Read a sample file.

    Parameters
    ----------
    path
        TOML file as described in `docs/manual/sample-file.md`; or the folder of a fit or of a diagnosis,
        for the fitted or the corrected sample.
    effects
        Classes of effects of your own that the file declares.

    Raises
    ------
    InputRefusedError
        If the file is invalid; the message names the file and the key.
    """
    path = Path(path)
    if path.is_dir():
        return _sample_of_folder(path, effects)
    return parse_sample(text_of(path, "sample"), str(path), path.parent, effects)


def _sample_of_folder(folder: Path, effects: Collection[Any]) -> Sample:
    """The sample file of a diagnosis, or the sample of a fit."""
    file, result = folder / SAMPLE_FILE, folder / RESULT_FILE
    if file.exists():
        return load_sample(file, effects)
    if not result.exists():
        raise InputRefusedError(
            f"{folder}: is a folder without {SAMPLE_FILE} and {RESULT_FILE}; give a sample file, or the "
            "folder of a fit or of a diagnosis."
        )
    plain = read_json(result, LARGEST_RESULT_BYTES, "result")
    try:
        return sample_from_dict(plain.get("sample") if isinstance(plain, dict) else None, effects=effects)
    except InputRefusedError as problem:
        raise InputRefusedError(f"{result}: {problem}") from None


def parse_sample(
    text: str,
    source: str = "sample",
    folder: str | Path | None = None,
    effects: Collection[Any] = (),
) -> Sample:
    """Parse the text of a sample file; see `load_sample`.

    Parameters
    ----------
    text
        TOML.
    source
        Name for messages.
    folder
        Folder of files that the text names; None: the working folder.
    effects
        Classes of effects of your own that the text declares.
    """
    document = document_of(text, source)
    try:
        sample = sample_of_document(document, Path(folder or "."), effects)
        require_no_unused(table_of(document, "inks"), (sample,))
        return sample
    except InputRefusedError as problem:
        raise InputRefusedError(f"{source}: {problem}") from None


def sample_of_document(document: dict[str, Any], folder: Path, effects: Collection[Any] = ()) -> Sample:
    """The sample that the tables of a file describe; see `parse_sample`.

    Parameters
    ----------
    document
        The tables.
    folder
        Folder of files that they name.
    effects
        Classes of effects of your own that they declare.
    """
    own = own_kinds(effects)
    only(document, TOP, "the file")
    require_version(document, SCHEMA_VERSION, "sample files")
    numbers = ParameterReader(read_wavelengths(document), folder)
    surroundings = table_of(document, "surroundings")
    only(surroundings, schema.SURROUNDINGS, "[surroundings]")
    numbers.read("surroundings", schema.SURROUNDINGS, surroundings)
    tables = layer_tables(document)
    inks = read_inks(document, tables, numbers)
    layers = tuple(read_layer(i, t, folder, numbers, inks) for i, t in enumerate(tables))
    backing = _backing(document, layers[-1], numbers)
    _check_layers(layers, backing is not None, document.get("lit_side", layers[0].name))
    instrument = read_instrument(document, numbers)
    effects = read_effects(document, numbers, [layer.name for layer in layers], own)
    parameters = ParameterTable(numbers.parameters)
    for dispersion in numbers.dispersions:
        dispersion.check(parameters, numbers.wavelengths_nm)
    for layer in layers:
        if layer.phase_function == "mie":
            check_volume(layer.name, list(layer.particles), parameters)
        if layer.opaque and layer.mixture:
            require_whole(layer.name, layer.shares(parameters))
    return Sample(
        layers=layers,
        parameters=parameters,
        title=str(document.get("title", "")),
        wavelengths_nm=numbers.wavelengths_nm,
        noise=read_noise(document),
        masks=read_masks(document),
        weights=read_weights(document),
        dispersions=tuple(numbers.dispersions),
        backing=backing,
        effects=effects,
        inks=tuple(ink for ink in inks if any(ink in layer.mixture for layer in layers)),
        **instrument,
    )


def _backing(document: dict[str, Any], last: Layer, numbers: ParameterReader) -> Backing | None:
    """The reflector behind the sample, if any."""
    if "backing" not in document:
        return None
    table = table_of(document, "backing")
    only(table, schema.BACKING_ENTRIES | schema.BACKING, "[backing]")
    side = choice({"side": schema.BACKING_SIDES[0]} | table, "side", schema.BACKING_SIDES, "[backing]")
    contact = true_or_false(table, "contact", False, "backing.contact")
    if contact and "side" in table and side != "both":
        raise InputRefusedError(
            'backing.contact is true, so the backing cannot be removed; set side = "both" or omit it.'
        )
    if last.opaque:
        raise InputRefusedError(
            f"[backing] is behind the opaque layer '{last.name}', so no light reaches it; remove it, or give "
            "the layer a thickness."
        )
    numbers.read("backing", schema.BACKING, table)
    return Backing("both" if contact else side, contact)


def _check_layers(layers: tuple[Layer, ...], has_backing: bool, lit: Any) -> None:
    """Reject layers with equal names, without scattering, or in the wrong order."""
    names = [layer.name for layer in layers]
    for name, count in Counter(names).items():
        if count > 1 or name == "surroundings" or (name == "backing" and has_backing):
            raise InputRefusedError(f"a layer is named '{name}', a name already in use; choose another one.")
    if not any(layer.scatters for layer in layers):
        raise InputRefusedError('no layer has kind = "scattering"; at least one, the ink, must have it.')
    for i, layer in enumerate(layers[:-1]):
        if layer.opaque:
            raise InputRefusedError(
                f"layer '{layer.name}' is opaque, so no light reaches '{names[i + 1]}'; only the last layer "
                "may be opaque."
            )
    if lit != names[0]:
        raise InputRefusedError(
            f"lit_side is '{lit}' but the first layer is '{names[0]}'; list the layers in the order in which "
            "light meets them."
        )
