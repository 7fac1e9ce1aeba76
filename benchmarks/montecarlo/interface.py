"""Light that leaves one rough interface; `reference` keeps some of it for the tests."""

from pathlib import Path

import numpy as np

from benchmarks.montecarlo.facets import (
    N_BATCHES,
    cross,
    fresnel,
    leaves,
    meet_facet,
    reflected_ray,
    refracted_ray,
)

INTERFACE_FILE = Path(__file__).with_name("interface.json")


def interface_alone(indices, theta_deg, facets, n_rays, seed=0, edges_deg=None):
    """Light that leaves one rough interface, lit from the first medium.

    The first facet divides each ray into both parts with Fresnel weights, the later ones choose.

    Parameters
    ----------
    indices
        Refractive index of the medium the light comes from and of the other.
    theta_deg
        Incidence in the first medium.
    facets
        The interface.
    n_rays
        Incident rays, in 20 batches.
    seed
        Of the generator.
    edges_deg
        Edges of the rings of the outgoing angle in degrees; default 0, 5 ... 90.

    Returns
    -------
    dict
        ``R``, ``T``: totals; ``R_single``, ``T_single``: after exactly one facet; ``R_events``, ``T_events``:
        power by number of facets 1 ... 6, 7 or more; ``R_bsdf``, ``T_bsdf``: mean over each ring weighted by
        cos(theta) dOmega, 1/sr; each as (value, standard error from the batches).
    """
    edges = np.linspace(0, 90, 19) if edges_deg is None else np.asarray(edges_deg)
    random = np.random.default_rng(seed)
    size = n_rays // N_BATCHES
    rows = [_batch(indices, theta_deg, facets, size, random, edges) for _ in range(N_BATCHES)]
    means = {name: np.mean([row[name] for row in rows], axis=0) for name in rows[0]}
    errors = {name: np.std([row[name] for row in rows], axis=0, ddof=1) / N_BATCHES**0.5 for name in rows[0]}
    return {name: (means[name], errors[name]) for name in means}


def _batch(indices, theta_deg, facets, size, random, edges):
    theta = np.deg2rad(theta_deg)
    ray = np.repeat([[np.sin(theta)], [0.0], [np.cos(theta)]], size, axis=1)
    normal, cosine = meet_facet(ray, np.ones(size, bool), facets, random)
    reflectance, refracted = fresnel(indices[0], indices[1], cosine)
    passing = reflectance < 1
    through = refracted_ray(ray, normal, cosine, refracted, indices[0] / indices[1])[:, passing]
    direction = np.concatenate([reflected_ray(ray, normal, cosine), through], axis=1)
    above = np.arange(direction.shape[1]) < size
    weight = np.concatenate([reflectance, 1 - reflectance[passing]]) / size
    events = np.ones(above.size, int)
    stay = np.flatnonzero(~leaves(direction, above, facets, random))
    direction[:, stay], above[stay], more = cross(direction[:, stay], above[stay], indices, facets, random)
    events[stay] += more

    out = {}
    sines = np.hypot(direction[0], direction[1])
    etendue = np.pi * np.diff(np.sin(np.deg2rad(edges)) ** 2)
    for name, side in (("R", above), ("T", ~above)):
        by_events = np.bincount(np.minimum(events[side], 7), weight[side], 8)[1:]
        angle = np.rad2deg(np.arctan2(sines[side], np.abs(direction[2, side])))
        ring = np.histogram(angle, edges, weights=weight[side])[0]
        out |= {name: weight[side].sum(), f"{name}_single": by_events[0], f"{name}_events": by_events}
        out[f"{name}_bsdf"] = ring / etendue
    return out
