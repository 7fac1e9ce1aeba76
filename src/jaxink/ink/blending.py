"""The light of an ink averaged over areas that differ."""

import jax.numpy as jnp
import numpy as np

from jaxink.optics.fresnel import fresnel_reflectance, refracted_cosine


def without_ink(index_inside: float, index_outside: float, theta_deg, n_phi: int, names: tuple[str, ...]):
    """Components where there is no ink: the smooth face between the two media, which scatters nothing.

    Parameters
    ----------
    index_inside, index_outside
        Refractive indices of the two media.
    theta_deg, n_phi
        Polar angles and number of azimuths of the table.
    names
        Parameters by which the components have derivatives, all of them 0.
    """
    cosine, n_theta = jnp.cos(jnp.deg2rad(theta_deg)), len(theta_deg)
    nothing = np.zeros((1 + len(names), n_theta, n_theta, n_phi))
    sides = []
    for n1, n2 in ((index_inside, index_outside), (index_outside, index_inside)):
        reflected = np.asarray(fresnel_reflectance(n1, n2, cosine, refracted_cosine(n1, n2, cosine)))
        sides.append([np.pad(r[None], ((0, len(names)), (0, 0))) for r in (reflected, 1 - reflected)])
    (r_ii, t_ia), (r_aa, t_ai) = sides
    return tuple((nothing, regular) for regular in (r_ii, t_ia, t_ai, r_aa))


def blended(areas, weights):
    """Components of all areas together; the first entries are values, the others derivatives.

    Parameters
    ----------
    areas
        For each area the components, each with BSDF and regular power.
    weights
        Of the areas, shape ``(1 + parameters, areas)``.
    """

    def one(parts):
        mean = sum(w * part for w, part in zip(weights[0], parts, strict=True))
        for k, slope in enumerate(weights[1:], start=1):
            mean[k] += sum(w * part[0] for w, part in zip(slope, parts, strict=True))
        return mean

    if len(areas) == 1:
        return areas[0]
    by_component = zip(*areas, strict=True)
    return [tuple(one(parts) for parts in zip(*component, strict=True)) for component in by_component]
