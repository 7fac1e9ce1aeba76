"""Lobes of an ink's rough interfaces, from the regular light that reaches them."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxink.ink.lobes import FacetLobes
from jaxink.optics import ScatteringLayer, delta_m, propagating_cosine
from jaxink.solver import SolverConfig, Stack, regular_fields
from jaxink.surfaces import FacetRule, SlopeDensity, projected_area

# Steps are equal in arsinh(s / narrowest scale); linear interpolation of P(s) s is then accurate to 1e-4.
_N_SLOPES = 1024


def facet_lobes(
    stacks: Stack, config: SolverConfig, theta_deg: np.ndarray, grazing_deg: float
) -> FacetLobes | None:
    """Lobes of the rough interfaces of an ink, None if it has no facets.

    Parameters
    ----------
    stacks
        The ink alone with side I in front; the leading axis of its numbers is the wavelength.
    config
        Resolution; light that delta-M treats as undeviated also reaches the facets.
    theta_deg
        Polar angles of the table.
    grazing_deg
        ``grazing_theta_deg`` of `FacetLobes`.
    """
    facets = _facets(stacks)
    if not facets:
        return None
    scales, ends = (
        np.array([jax.vmap(lambda d, n=name: getattr(d, n))(density) for density in facets.values()])
        for name in ("scale", "largest_slope")
    )
    narrowest = scales.min()
    reach = np.linspace(0, np.arcsinh(ends.max() / narrowest), _N_SLOPES)
    slope = narrowest * np.sinh(reach)
    sines = jnp.sin(jnp.deg2rad(theta_deg))
    radial, face_index, passage = _at_every_wavelength(stacks, config, jnp.asarray(slope), sines)
    return FacetLobes(
        theta_deg=theta_deg,
        index=np.stack([stacks.index_front, stacks.index_back]),
        slope=slope,
        # Reorder the axes to sides, faces, wavelengths.
        radial_density=np.asarray(radial).swapaxes(0, 1),
        face_index=np.moveaxis(np.asarray(face_index), 0, 2),
        passage=np.moveaxis(np.asarray(passage), 0, 2),
        grazing_theta_deg=grazing_deg,
    )


def one_facet_lobes(
    density: SlopeDensity,
    theta_deg: np.ndarray,
    index: tuple[np.ndarray, np.ndarray],
    grazing_deg: float,
) -> FacetLobes:
    """Lobes of a boundary of facets alone; parameters: see `FacetLobes`, one density for all wavelengths."""
    reach = np.linspace(0, np.arcsinh(float(density.largest_slope / density.scale)), _N_SLOPES)
    slope = float(density.scale) * np.sinh(reach)
    # Nothing passes at 90 degrees; `FacetLobes` interpolates between the angles and this one.
    cosine = jnp.maximum(jnp.cos(jnp.deg2rad(theta_deg)), 1e-12)
    sine = jnp.sqrt(jnp.maximum(1 - cosine**2, 1e-12))
    area = projected_area(cosine, sine, density, FacetRule(96, 24))
    masking = np.where(theta_deg < 90, cosine / area, 0.0)
    media = np.stack(index)
    n_wavelengths = media.shape[1]
    return FacetLobes(
        theta_deg=theta_deg,
        index=media,
        slope=slope,
        radial_density=np.tile(np.asarray(density.radial(slope)), (1, n_wavelengths, 1)),
        face_index=media[:, None],
        passage=np.tile(masking, (2, 1, n_wavelengths, 1)),
        grazing_theta_deg=grazing_deg,
    )


def _facets(stack: Stack) -> dict[int, SlopeDensity]:
    """Interfaces with facets by position; lobes by wave optics have no closed form."""
    return {k: face for k, face in stack.rough.items() if isinstance(face, SlopeDensity)}


@eqx.filter_jit
def _at_every_wavelength(stacks: Stack, config: SolverConfig, slope, sines):
    def at(stack):
        facets = _facets(stack)
        rough = np.array(list(facets))
        indices = jnp.stack(stack.indices)
        passage = [
            _reaching_faces(stack, config, sines * stack.index_front, 0),
            _reaching_faces(stack, config, sines * stack.index_back, 1),
        ]
        radial = jnp.stack([density.radial(slope) for density in facets.values()])
        return radial, jnp.stack([indices[rough], indices[rough + 1]]), jnp.stack(passage)

    return jax.vmap(at)(stacks)


def _reaching_faces(stack: Stack, config, kappa, side):
    """Share of light from one side that reaches each rough interface, shape ``(faces, angles)``."""
    column = jnp.stack(stack.indices)[:, None]
    thickness = [
        (delta_m(layer, config.n_moments) if isinstance(layer, ScatteringLayer) else layer).optical_thickness
        for layer in stack.layers
    ]
    squared = 1 - (kappa / column) ** 2
    fields = regular_fields(column[:, 0], squared, jnp.stack(thickness), stack.kept_regular(squared))
    arriving = (fields.arriving_from_front, fields.arriving_from_back)[side]
    found = []
    for k, density in _facets(stack).items():
        cosine = propagating_cosine(squared[k + side])
        safe = jnp.where(cosine > 0, cosine, 1.0)
        sine = jnp.sqrt(jnp.maximum(1 - safe**2, 1e-12))
        area = projected_area(safe, sine, density, FacetRule())
        found.append(jnp.where(cosine > 0, arriving[k] * cosine / area, 0.0))
    return jnp.stack(found)
