"""A sketch of a sample: its layers in the order in which light meets them, not to scale."""

from collections.abc import Mapping
from html import escape

from jaxink.numerics.digits import rounded
from jaxink.sample import PHASE_WORDS, Layer, Sample

_WIDTH, _LAYER, _TEXT, _LEFT = 150, 44, 330, 10
_ABOVE, _BACKING, _GAP = 40, 16, 8
_CLEAR, _SCATTERING, _EDGE = "#dcebf7", "#e9dfc8", "#444"
# When a backing is there, by its side; always if not named.
_WHEN = {"R": "only during the scans in reflection"}


def layer_sketch(sample: Sample) -> str:
    """An SVG element: light from above, one box for each layer, and its numbers beside it."""
    parts, y = [_arrow()], _ABOVE
    for i, layer in enumerate(sample.layers):
        parts.append(_box(layer, y, i))
        parts.append(_words(y + _LAYER / 2, layer.name, layer_words(sample, layer)))
        y += _LAYER
    if sample.backing is not None:
        y += 0 if sample.backing.contact else _GAP
        parts.append(_rectangle(y, _BACKING, "#8a8a8a"))
        parts.append(_words(y + _BACKING / 2, "backing", backing_words(sample)))
        y += _BACKING
    said = "; ".join(f"{layer.name}: {layer_words(sample, layer)}" for layer in sample.layers)
    return (
        f'<svg role="img" aria-label="{escape(said, quote=True)}" width="{_LEFT + _WIDTH + _TEXT}" '
        f'height="{y + 8}">{"".join(parts)}</svg>\n'
    )


def layer_sketches(samples: Mapping[str, Sample]) -> str:
    """A sketch of each different sample, with the names of its measurements if there are several."""
    names: dict[str, list[str]] = {}
    for name, sample in samples.items():
        names.setdefault(layer_sketch(sample), []).append(name)
    if len(names) == 1:
        return next(iter(names))
    return "".join(f"<p>{escape(', '.join(of))}</p>\n{drawn}" for drawn, of in names.items())


def layer_words(sample: Sample, layer: Layer) -> str:
    """Kind, phase function, index and thickness of a layer."""
    words = [layer.kind if layer.phase_function is None else PHASE_WORDS[layer.phase_function]]
    if any(d.name == f"{layer.name}.refractive_index" for d in sample.dispersions):
        words.append("n depends on the wavelength")
    elif index := _value(sample, f"{layer.name}.refractive_index"):
        words.append(f"n = {index}")
    for key, unit in (("thickness_mm", "mm"), ("thickness_um", "µm")):
        if thickness := _value(sample, f"{layer.name}.{key}"):
            words.append(f"{thickness} {unit}")
    if layer.opaque:
        words.append("opaque")
    if layer.roughness:
        words.append("rough face" if len(layer.roughness) == 1 else "rough faces")
    return ", ".join(words)


def backing_words(sample: Sample) -> str:
    """Reflectance of what is behind the sample, and when it is there."""
    assert sample.backing is not None, "asked for only if there is one"
    reflectance = _value(sample, "backing.reflectance")
    when = _WHEN.get(sample.backing.side, "")
    return ", ".join(filter(None, [f"reflectance {reflectance}", when]))


def _value(sample: Sample, name: str) -> str:
    """Value of a parameter, or its range over the wavelengths; empty if there is none."""
    values = [v for n, v in sample.parameters.values_with({}).items() if n.partition("@")[0] == name]
    if not values:
        return ""
    low, high = (rounded(float(end), 4) for end in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def _arrow() -> str:
    x, tip = _LEFT + 55, _LEFT + 80
    return (
        f'<path d="M{x} 4 L{tip} {_ABOVE - 2} m-8 -4 l8 4 l1 -9" fill="none" stroke="#d18a1b" '
        f'stroke-width="2"/><text x="{x + 30}" y="16">light</text>'
    )


def _rectangle(y: float, height: float, fill: str) -> str:
    return (
        f'<rect x="{_LEFT}" y="{y}" width="{_WIDTH}" height="{height}" fill="{fill}" stroke="{_EDGE}" '
        'stroke-width="1"/>'
    )


def _box(layer: Layer, y: float, number: int) -> str:
    if not layer.scatters:
        return _rectangle(y, _LAYER, _CLEAR)
    # Spread evenly, but not on a lattice: the fractional parts of multiples of two irrational numbers.
    shares = ((i * 0.7548776662 % 1, i * 0.5698402910 % 1) for i in range(1 + number, 41 + number))
    dots = "".join(
        f'<circle cx="{_LEFT + 6 + across * (_WIDTH - 12):.1f}" cy="{y + 6 + down * (_LAYER - 12):.1f}" '
        'r="2.4" fill="#8a7040"/>'
        for across, down in shares
    )
    return _rectangle(y, _LAYER, _SCATTERING) + dots


def _words(y: float, name: str, text: str) -> str:
    x = _LEFT + _WIDTH + 10
    return (
        f'<text x="{x}" y="{y - 2}" font-weight="bold">{escape(name)}</text>'
        f'<text x="{x}" y="{y + 13}">{escape(text)}</text>'
    )
