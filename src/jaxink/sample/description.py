"""Description of a sample: layers, surroundings, instrument, noise, parameters."""

import dataclasses
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from jaxink.display.brief import brief, brief_repr
from jaxink.display.card import Card, CardTable, Presented
from jaxink.measurement import Noise
from jaxink.sample.declared_effects import DeclaredEffect
from jaxink.sample.dispersion import Dispersion
from jaxink.sample.mixture_shares import require_at_most_whole, require_whole
from jaxink.sample.parameters import ParameterTable
from jaxink.sample.populations import Population
from jaxink.sample.replacing import with_values
from jaxink.sample.residual_weight import ResidualWeight
from jaxink.sample.roughness import Roughness


@dataclasses.dataclass(frozen=True)
class Layer:
    """One layer of the sample; its numbers are in the parameter table.

    Parameters
    ----------
    name
        First part of the names of its parameters.
    kind
        ``clear`` or ``scattering``.
    phase_function
        For a scattering layer: a key of `schema.PHASE_FUNCTIONS`.
    opaque
        Whether no light leaves on its far side.
    phase_table
        For ``tabulated``: ("angle_deg" or "moments", abscissae or None, values).
    roughness
        The rough faces.
    radius_table
        For ``mie``: tabulated radii in nm and their relative numbers, or None.
    populations
        For ``mie``: further kinds of particles.
    mixture
        Names of the inks that it is mixed from; its coefficients are tied to theirs.
    """

    __repr__ = brief_repr

    name: str
    kind: str
    phase_function: str | None = None
    opaque: bool = False
    phase_table: tuple[str, tuple[float, ...], tuple[float, ...]] | None = None
    roughness: tuple[Roughness, ...] = ()
    radius_table: tuple[tuple[float, ...], tuple[float, ...]] | None = None
    populations: tuple[Population, ...] = ()
    mixture: tuple[str, ...] = ()

    @property
    def particles(self) -> dict[str, tuple[tuple[float, ...], tuple[float, ...]] | None]:
        """Table of radii, or None, of each kind of Mie particles, by the prefix of its parameters' names."""
        further = {f"{self.name}.{p.name}": p.radius_table for p in self.populations}
        return {self.name: self.radius_table, **further}

    def shares(self, parameters: ParameterTable) -> dict[str, float]:
        """Share of each ink of the mixture."""
        values = parameters.values_with({})
        return {ink: values[f"{self.name}.mixture.{ink}"] for ink in self.mixture}

    @property
    def scatters(self) -> bool:
        """Whether the layer scatters light."""
        return self.kind == "scattering"


@dataclasses.dataclass(frozen=True)
class Backing:
    """An ideally diffuse, opaque reflector behind the sample; its reflectance is a parameter.

    Parameters
    ----------
    side
        One of `schema.BACKING_SIDES`.
    contact
        Whether it is in optical contact with the last layer; otherwise the surroundings are in between.
    """

    side: str
    contact: bool


@dataclasses.dataclass(frozen=True, repr=False)
class Sample(Presented):
    """Everything that is known about a sample and its measurement.

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
        Cones of the instrument; 0 for an ideal one.
    beam_diameter_mm, detector_diameter_mm
        Diameters of the beam (across it) and of the disc on the sample that the detector sees; None: all
        light is collected. A parameter ``instrument.beam_diameter_mm`` takes precedence, likewise for the
        other.
    detector_mode
        One of `schema.DETECTOR_MODES`: ``spectrometer`` for white light on the sample and a detector that
        resolves wavelengths, ``broadband`` for light of one wavelength and a detector that sees all; None if
        unknown. Used for fluorescence only.
    illumination
        Spectrum of the light on the sample: wavelengths in nm and relative powers, or None.
    noise
        Declared noise.
    masks
        Half-angles and limits of the masks, by key of `schema.MASKS`.
    weights
        Weights of residuals.
    dispersions
        Refractive indices given as functions of the wavelength.
    backing
        Reflector behind the sample, or None.
    effects
        Effects that the sample file declares in tables of their own; `jaxink.forward_model` applies them.
    inks
        Names of the inks that layers are mixed from, the first part of the names of their parameters.
    """

    layers: tuple[Layer, ...]
    parameters: ParameterTable
    title: str = ""
    wavelengths_nm: tuple[float, ...] = ()
    source_half_angle_deg: float = 0.0
    detector_half_angle_deg: float = 0.0
    noise: Noise = Noise()
    masks: tuple[tuple[str, float], ...] = ()
    weights: tuple[ResidualWeight, ...] = ()
    dispersions: tuple[Dispersion, ...] = ()
    backing: Backing | None = None
    beam_diameter_mm: float | None = None
    detector_diameter_mm: float | None = None
    detector_mode: str | None = None
    illumination: tuple[tuple[float, ...], tuple[float, ...]] | None = None
    effects: tuple[DeclaredEffect, ...] = ()
    inks: tuple[str, ...] = ()

    def at_wavelength(self, values: Mapping[str, Any], wavelength_nm: float) -> dict[str, Any]:
        """Values at one wavelength by plain name ``layer.quantity``, with dispersions evaluated.

        Parameters
        ----------
        values
            Value of every parameter, possibly traced.
        wavelength_nm
            One of the wavelengths at which the parameters are given.
        """
        at = f"@{wavelength_nm:g}"
        plain = {n: v for n, v in values.items() if "@" not in n}
        # A value at the wavelength takes the place of the mean over all of them.
        plain |= {n.removesuffix(at): v for n, v in values.items() if n.endswith(at)}
        return plain | {d.name: d.at(values, wavelength_nm) for d in self.dispersions}

    def own_wavelengths(self, names: Collection[str], wavelengths_nm: Sequence[float]) -> dict[str, float]:
        """Wavelength of each of some parameters that no value at another one depends on.

        Parameters
        ----------
        names
            Names of parameters.
        wavelengths_nm
            Wavelengths at which the sample is evaluated.
        """

        def at_of(name: str) -> str:
            return name.partition("@")[2]

        waves = {f"{wave:g}": wave for wave in wavelengths_nm}
        at = {name: at_of(name) for name in names}
        # What ties use at another wavelength than their own, and what that in turn is tied to.
        tied = {name: self.parameters.tied_to(name) for name in self.parameters}
        pending = [o for name, used in tied.items() for o in used if at_of(name) != at_of(o)]
        elsewhere = set[str]()
        while pending:
            name = pending.pop()
            if name not in elsewhere:
                elsewhere.add(name)
                pending += tied[name]
        return {name: waves[wave] for name, wave in at.items() if wave in waves and name not in elsewhere}

    def replace(self, values: Mapping[str, float] | None = None, /, **more: float) -> "Sample":
        """The sample with other values of some parameters; parameters that are tied to them follow.

        Parameters
        ----------
        values
            Value of each parameter that changes, by its name and in its unit, such as
            ``{"ink.thickness_um": 60}``.
        **more
            The same as keywords: ``sample.replace(**{"ink.thickness_um": 60})``.

        Raises
        ------
        InputRefusedError
            For a name that does not exist (near names are suggested), a tied parameter, a value out of the
            range of its parameter, or shares of a mixture that are more than the whole.
        """
        values = {**(values or {}), **more}
        table = with_values(self.parameters, values)
        for layer in self.layers:
            if any(name.startswith(f"{layer.name}.mixture.") for name in values):
                require = require_whole if layer.opaque else require_at_most_whole
                require(layer.name, layer.shares(table))
        return dataclasses.replace(self, parameters=table)

    def without_values(self, names: Collection[str]) -> "Sample":
        """The structure of the sample: without the values of some parameters, noise, masks and title."""
        return dataclasses.replace(
            self,
            title="",
            wavelengths_nm=(),
            noise=Noise(),
            masks=(),
            weights=(),
            parameters=self.parameters.without_values(names),
        )

    def card(self) -> Card:
        """Layers and parameters."""
        rows = [
            [layer.name, layer.kind, layer.phase_function or "", "rough" if layer.roughness else ""]
            for layer in self.layers
        ]
        layers = CardTable(["layer", "kind", "phase function", "faces"], rows, (0, 1, 2, 3))
        title = f"Sample{f' {self.title!r}' if self.title else ''} with {len(self.layers)} layers"
        backing = [] if self.backing is None else [f"Behind it: {brief(self.backing)}."]
        return Card(title, backing, (layers, self.parameters.table()))

    def varies(self, name: str) -> bool:
        """Whether a quantity, given by its plain name, may take several values.

        It does if it is free, depends on the wavelength, or is tied to what does.
        """
        return any(
            p.free or "@" in p.name or any(self.varies(other) for other in self.parameters.tied_to(p.name))
            for p in self.parameters.values()
            if p.name.split("@")[0] == name or p.name.startswith(f"{name}.")
        )
