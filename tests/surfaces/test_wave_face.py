"""An interface by wave optics inside a stack."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.optics.directions import Directions
from jaxink.optics.layers import ScatteringLayer
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.bsdf import diffuse_bsdf, hemispherical_power
from jaxink.solver.config import SolverConfig
from jaxink.solver.plan import plan_channels
from jaxink.solver.stack import Stack
from jaxink.surfaces.spectrum import BroadenedSpectrum, GaussianSpectrum, KCorrelation, broadened
from jaxink.surfaces.wave_face import WaveFace, wave_interface
from jaxink.surfaces.wave_optics import scattered_bsdf
from jaxink.surfaces.wave_surface import WaveSurface
from tests.surfaces.densities import gaussian_slopes

WAVELENGTH = 550.0
SIZES = SolverConfig(12, 10, 16, 6)
INCIDENCE_DEG = np.array([0.0, 30.0, 60.0])
OUTGOING_DEG = np.array([10.0, 30.0, 50.0, 70.0])


def directions(azimuth_rad, transmission=(False, True)):
    """Every pair of incidence and outgoing angle, on the given sides."""
    into, out = (k.ravel() for k in np.meshgrid(np.arange(3), np.arange(4), indexing="ij"))
    n, sides = len(into), len(transmission)
    return Directions(
        np.sin(np.deg2rad(INCIDENCE_DEG)),
        np.sin(np.deg2rad(OUTGOING_DEG)),
        np.tile(into, sides),
        np.tile(out, sides),
        np.full(n * sides, azimuth_rad),
        np.repeat(transmission, n),
    )


def stack(face, front=True, albedo=1.0, optical_thickness=2.0, index=1.5):
    layer = ScatteringLayer(index, optical_thickness, albedo, HenyeyGreenstein(0.5))
    faces = () if face is None else (face, None) if front else (None, face)
    return Stack((layer,), 1.0, 1.0, faces)


def gaussian(height_um, length_um, amplitude="perturbation"):
    return WaveFace(GaussianSpectrum(height_um**2, length_um), WAVELENGTH, amplitude)


def test_table_of_broadened_spectra_meets_the_transform():
    for spectrum in (KCorrelation(0.09, 4.65, 3.64), KCorrelation(460.0**2, 3e6, 3.155)):
        table = BroadenedSpectrum.of(spectrum, 34.0)
        phase, frequency = np.geomspace(0.5, 33.0, 9), np.geomspace(0.03, 4.0, 12)
        position = jnp.log(2 * jnp.pi * frequency * spectrum.length_um)
        exact = broadened(
            spectrum, phase**2 * spectrum.height_variance_um2, jnp.broadcast_to(position, (9, 12))
        )
        found = table.density_um4(phase[:, None], frequency[None, :])
        np.testing.assert_allclose(found, exact, rtol=2e-3)


def test_flat_surface_is_the_smooth_one():
    smooth = diffuse_bsdf(stack(None), directions(1.0), SIZES)
    for front in (True, False):
        flat = diffuse_bsdf(stack(gaussian(1e-7, 3.0), front), directions(1.0), SIZES)
        np.testing.assert_allclose(flat, smooth, rtol=1e-4)


@pytest.mark.parametrize("front", [True, False])
@pytest.mark.parametrize(
    "face",
    [gaussian(0.02, 2.0), gaussian(0.3, 6.0), WaveFace(KCorrelation(0.04, 5.0, 3.5), WAVELENGTH)],
    ids=["slightly", "gaussian", "k_correlation"],
)
def test_no_light_is_lost_or_made(face, front):
    lit = stack(face, front)
    # At the solver's own channels the power is not interpolated.
    sines = np.asarray(plan_channels(lit).grid(lit, SIZES).kappa[: SIZES.nodes_escaping])
    reflected, transmitted = hemispherical_power(lit, sines, SIZES)
    np.testing.assert_allclose(reflected + transmitted, 1.0, atol=1e-9)


@pytest.mark.parametrize(
    ("face", "within"),
    [
        (gaussian(0.1, 5.0), 1e-4),
        (gaussian(0.3, 3.0), 1e-4),
        (gaussian(0.05, 0.5), 1e-4),
        (gaussian(0.05, 50.0), 2e-3),
        (WaveFace(KCorrelation(0.04, 8.0, 4.0), WAVELENGTH), 1e-4),
        (WaveFace(KCorrelation(0.09, 20.0, 2.5), WAVELENGTH), 1e-2),
    ],
    ids=["gentle", "steep", "fine", "polished", "k_correlation", "wide tails"],
)
def test_nodes_resolve_narrow_and_wide_lobes(monkeypatch, face, within):
    """Matrices between channels against those by many more nodes, relative to their largest element."""
    lit = stack(face)
    grid = plan_channels(lit).grid(lit, SIZES)

    def matrices():
        return jax.jit(lambda: wave_interface(grid, jnp.asarray(1.0), jnp.asarray(1.5), face, 10).one)()

    found = matrices()
    monkeypatch.setattr("jaxink.surfaces.wave_face._N_RADIAL", 120)
    monkeypatch.setattr("jaxink.surfaces.wave_face._N_AROUND", 80)
    for few, many in zip(jax.tree.leaves(found), jax.tree.leaves(matrices()), strict=True):
        np.testing.assert_allclose(few, many, rtol=0, atol=within * float(jnp.abs(many).max()))


def test_reciprocity():
    face = gaussian(0.3, 6.0)
    angles = np.sin(np.deg2rad([20.0, 50.0]))
    there = Directions(
        angles[:1], angles[1:], np.array([0]), np.array([0]), np.array([2.0]), np.array([False])
    )
    back = Directions(
        angles[1:], angles[:1], np.array([0]), np.array([0]), np.array([2.0]), np.array([False])
    )
    one, other = (float(diffuse_bsdf(stack(face), d, SIZES)[0]) for d in (there, back))
    assert one == pytest.approx(other, rel=2e-3)


@pytest.mark.parametrize("amplitude", ["perturbation", "fresnel"])
def test_black_body_under_it_leaves_the_lobe_of_the_theory(amplitude):
    face = gaussian(0.25, 3.0, amplitude)
    at = directions(0.3, (False,))
    found = diffuse_bsdf(stack(face, albedo=0.0, optical_thickness=1e4), at, SIZES)
    cosine_out = jnp.sqrt(1 - at.sin_outgoing[at.outgoing] ** 2)
    cosine_in = jnp.sqrt(1 - at.sin_incidence[at.incidence] ** 2)
    surface = WaveSurface(face.spectrum, 1.0, 1.5, WAVELENGTH, amplitude)
    lobe = scattered_bsdf(surface, cosine_out, cosine_in, at.azimuth_rad[:, None], False)[:, 0]
    np.testing.assert_allclose(found, lobe, rtol=5e-3, atol=1e-4 * float(lobe.max()))


def test_gentle_large_heights_scatter_as_facets_do():
    # A sigma is above 15 and the slope 0.14: rays by facets of the same slope variance.
    height, length = 3.0, 30.0
    waves = stack(gaussian(height, length, "fresnel"), False)
    rays = eqx.tree_at(lambda s: s.faces, waves, (None, gaussian_slopes(2 * (height / length) ** 2)))
    # Away from the lobes, where both theories differ in second order of the slope.
    at = directions(2.0)
    by_waves, by_rays = (np.asarray(diffuse_bsdf(s, at, SIZES)) for s in (waves, rays))
    near = INCIDENCE_DEG[at.incidence] + OUTGOING_DEG[at.outgoing] < 115
    np.testing.assert_allclose(by_waves[near], by_rays[near], rtol=0.05)
    smooth = np.asarray(diffuse_bsdf(stack(None), at, SIZES))
    assert np.abs(by_waves - by_rays)[near].mean() < 0.5 * np.abs(smooth - by_rays)[near].mean()


def test_derivatives():
    """Also in the height variance where the surface is flat.

    They are those of the integrals, whose nodes are held: from difference quotients of the computed values
    they differ by the error of the quadrature, some 1e-5 of the BSDF.
    """
    at, sizes = directions(0.5), SolverConfig(8, 6, 8, 2)
    values = jnp.array([0.09, 5.0, 3.6, 1.4])

    def model(values):
        variance, length, exponent, index = values
        return stack(WaveFace(KCorrelation(variance, length, exponent), WAVELENGTH), index=index)

    plan = plan_channels(model(values), free=[1])

    def bsdf(values):
        return diffuse_bsdf(model(values), at, sizes, plan)

    @jax.jit
    def value_and_slope(values):
        return jax.jacfwd(lambda v: (bsdf(v),) * 2, has_aux=True)(values)[::-1]

    here, slope = value_and_slope(values)
    for k in range(4):
        step = jnp.zeros(4).at[k].set(1e-5 * values[k])
        difference = (value_and_slope(values + step)[0] - value_and_slope(values - step)[0]) / (2 * step[k])
        within = 3e-5 * float(jnp.abs(here).max())
        np.testing.assert_allclose(slope[:, k] * values[k], difference * values[k], rtol=1e-4, atol=within)

    flat = values.at[0].set(1e-9)
    here, slope = value_and_slope(flat)
    above = value_and_slope(flat.at[0].set(1e-5))[0]
    assert float(jnp.abs(slope[:, 0]).max()) > 0.1
    np.testing.assert_allclose((above - here) / 1e-5, slope[:, 0], rtol=0.02, atol=1e-3)
