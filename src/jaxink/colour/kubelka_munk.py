"""Kubelka-Munk coefficients of an ink with Saunderson's correction, and the error that two fluxes make."""

import dataclasses
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxink.colour.arrangement import BACKING, Arrangement, thickness_name
from jaxink.colour.geometry import Geometry
from jaxink.colour.of_sample import SampleSpectra
from jaxink.display.card import Card, CardTable, Presented
from jaxink.numerics.precision import computing
from jaxink.optics import fresnel_reflectance
from jaxink.sample import Sample

# Nodes of Gauss and Legendre over the squared sine, for diffuse light.
_NODES = 16
_SEEN_DEG = 8.0


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class TwoFlux(Presented):
    """K and S of an ink, such that two fluxes give its own diffuse reflectance and transmittance.

    Parameters
    ----------
    wavelength_nm
        Wavelengths.
    thickness_um
        Thickness of the layer from which they are derived.
    absorption_per_mm, scattering_per_mm
        K and S.
    external, internal
        Saunderson's k1 and k2: reflectance of the ink's face from outside at 8 degrees, at which reflectance
        di:8 is seen, and for diffuse light from inside.
    """

    wavelength_nm: Float[np.ndarray, " wavelengths"]
    thickness_um: float
    absorption_per_mm: Float[np.ndarray, " wavelengths"]
    scattering_per_mm: Float[np.ndarray, " wavelengths"]
    external: Float[np.ndarray, " wavelengths"]
    internal: Float[np.ndarray, " wavelengths"]

    def inside(self, thickness_um: float, over: float) -> Float[np.ndarray, " wavelengths"]:
        """Reflectance of a layer over a card for diffuse light, without the face of the ink.

        References
        ----------
        Kubelka 1948 J. Opt. Soc. Am. 38, 448, eq. 17.
        """
        path = self.scattering_per_mm * thickness_um / 1000
        a = 1 + self.absorption_per_mm / self.scattering_per_mm
        b = np.sqrt(a**2 - 1)
        # b coth(b S d), which is 1 / (S d) without absorption.
        coth = np.where(b > 1e-6, b / np.tanh(np.maximum(b, 1e-6) * path), 1 / path)
        return (1 - over * (a - coth)) / (a - over + coth)

    def reflectance(self, thickness_um: float, over: float) -> Float[np.ndarray, " wavelengths"]:
        """Reflectance di:8, specular included, of a layer in contact with a card, by two fluxes.

        References
        ----------
        Saunderson 1942 J. Opt. Soc. Am. 32, 727, eq. 8.
        """
        inner = self.inside(thickness_um, over)
        k1, k2 = self.external, self.internal
        return k1 + (1 - k1) * (1 - k2) * inner / (1 - k2 * inner)

    def card(self) -> Card:
        """K, S and Saunderson's constants by wavelength."""
        columns = (
            self.wavelength_nm,
            self.absorption_per_mm,
            self.scattering_per_mm,
            self.external,
            self.internal,
        )
        rows = [[f"{v:.5g}" for v in row] for row in zip(*columns, strict=True)]
        table = CardTable(["nm", "K, 1/mm", "S, 1/mm", "k1", "k2"], rows, ())
        return Card(f"Kubelka-Munk, from a layer of {self.thickness_um:g} um", (), (table,))


@dataclasses.dataclass(frozen=True, eq=False)
class TwoFluxError:
    """Reflectance by two fluxes, and by the model, of one layer over one card.

    Parameters
    ----------
    thickness_um, over
        The layer and the card.
    two_flux, model
        Reflectance di:8 at each wavelength.
    """

    thickness_um: float
    over: float
    two_flux: Float[np.ndarray, " wavelengths"]
    model: Float[np.ndarray, " wavelengths"]

    @property
    def largest(self) -> float:
        """Largest relative difference at any wavelength."""
        return float(np.max(np.abs(self.two_flux / self.model - 1)))


def two_flux(sample: Sample, wavelength_nm: Sequence[float], thickness_um: float | None = None) -> TwoFlux:
    """Kubelka-Munk coefficients from the parameters of an ink.

    K and S are those that reproduce the reflectance and transmittance of the ink alone, in a medium of its
    own index, for uniformly diffuse light; as light does not stay diffuse, they depend on the thickness.

    Parameters
    ----------
    sample
        The sample; its ink is the only scattering layer.
    wavelength_nm
        Wavelengths at which it is known.
    thickness_um
        Thickness from which they are derived; None: that of the sample.
    """
    name = thickness_name(sample)
    ink = name.partition(".")[0]
    own = float(sample.parameters.values_with({})[name])
    thickness = own if thickness_um is None else float(thickness_um)
    wave = np.asarray(wavelength_nm, float)
    free = Arrangement(thickness_um=thickness, free=True, over="nothing").of(
        dataclasses.replace(sample, wavelengths_nm=tuple(wave.tolist()))
    )
    index = _index(free, ink, wave)
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    angles = np.rad2deg(np.arcsin(np.sqrt((1 + nodes) / 2)))
    geometries = [_at(quantity, angle) for quantity in ("R_total", "T_total") for angle in angles]
    spectra = SampleSpectra(_in_its_binder(free, ink), geometries, wave).at()
    reflected, transmitted = (weights / 2 @ part for part in np.split(spectra, 2))
    a = (1 + reflected**2 - transmitted**2) / (2 * reflected)
    b = np.sqrt(np.maximum(a**2 - 1, 0.0))
    small = b < 1e-6
    path = np.where(
        small,
        reflected / transmitted,
        (np.arcsinh(b / transmitted) - np.arcsinh(b)) / np.where(small, 1.0, b),
    )
    scattering = path / thickness * 1000
    return TwoFlux(wave, thickness, scattering * (a - 1), scattering, *saunderson(index))


def _at(quantity: str, theta_deg: float) -> Geometry:
    return Geometry(f"{quantity} {theta_deg:.1f}", quantity, float(theta_deg), np.nan, np.nan)


def _index(sample: Sample, ink: str, wave: Float[np.ndarray, " wavelengths"]):
    start = sample.parameters.values_with({})
    each = (sample.at_wavelength(start, w)[f"{ink}.refractive_index"] for w in wave.tolist())
    return np.array([float(one) for one in each])


def _in_its_binder(sample: Sample, ink: str) -> Sample:
    """The ink between two half spaces of its binder, with smooth faces."""
    layers = tuple(dataclasses.replace(layer, roughness=()) for layer in sample.layers)
    table = sample.parameters
    for side in ("surroundings.index_front", "surroundings.index_back"):
        if side in table:
            table = table.replace(side, value=1.0, free=False, tie=f"{ink}.refractive_index")
    return dataclasses.replace(sample, layers=layers, parameters=table)


def saunderson(
    index: Float[np.ndarray, " wavelengths"],
) -> tuple[Float[np.ndarray, " wavelengths"], Float[np.ndarray, " wavelengths"]]:
    """Fresnel reflectances of a smooth face in air: from outside at 8 degrees, diffuse from inside."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    outside = _fresnel(index, np.sqrt((1 + nodes) / 2)) @ weights / 2
    # By reciprocity, n^2 (1 - inside) = 1 - outside.
    inside = 1 - (1 - outside) / index**2
    return _fresnel(index, np.sin(np.deg2rad([_SEEN_DEG])))[:, 0], inside


def _fresnel(
    index: Float[np.ndarray, " wavelengths"], sine: Float[np.ndarray, " angles"]
) -> Float[np.ndarray, "wavelengths angles"]:
    """Reflectance of unpolarised light from air."""
    with computing():
        of_face = jnp.asarray(index)[:, None]
        inside = jnp.sqrt(1 - (sine / of_face) ** 2)
        cosine = jnp.broadcast_to(jnp.sqrt(1 - sine**2), inside.shape)
        return np.asarray(fresnel_reflectance(jnp.ones_like(of_face), of_face, cosine, inside))


def two_flux_errors(
    sample: Sample, found: TwoFlux, thicknesses_um: Sequence[float], cards: Sequence[float]
) -> tuple[TwoFluxError, ...]:
    """What two fluxes predict for other layers over cards in contact, against the model."""
    name = thickness_name(sample)
    arranged = Arrangement(thickness_um=found.thickness_um, over=cards[0], contact=True, free=True).of(
        dataclasses.replace(sample, wavelengths_nm=tuple(found.wavelength_nm.tolist()))
    )
    spectra = SampleSpectra(arranged, ["di:8"], found.wavelength_nm)
    return tuple(
        TwoFluxError(t, card, found.reflectance(t, card), spectra.at({name: float(t), BACKING: card})[0])
        for t in thicknesses_um
        for card in cards
    )
