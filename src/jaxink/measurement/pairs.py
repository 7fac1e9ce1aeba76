"""Pairs of values that must agree: repeats, mirror images, reciprocal directions."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from jaxink.measurement.dataset import FILE_COLUMN, GonioData

# Rounding of printed angles; goniometer grids are at least ten times coarser.
ANGLE_TOLERANCE_DEG = 0.05


@dataclass(frozen=True)
class DirectionMeans:
    """Mean over the repeats of each direction, with its scan and angle labels."""

    value: np.ndarray
    count: np.ndarray
    scan: np.ndarray
    keys: np.ndarray  # labels of side, wavelength, theta_i, theta_o, |phi|
    sign: np.ndarray  # of phi; 0 in the plane of incidence
    along_normal: np.ndarray  # True if either direction is the normal


@dataclass(frozen=True)
class Differences:
    """Relative differences, each scaled to the variance of one value, with weights and scans."""

    relative: np.ndarray
    weight: np.ndarray
    scan_a: np.ndarray
    scan_b: np.ndarray
    spread: np.ndarray  # 1/n_a + 1/n_b by which the square was divided

    def only(self, keep) -> "Differences":
        """The differences for which ``keep`` is True."""
        return Differences(*(values[keep] for values in vars(self).values()))


def direction_groups(data: GonioData) -> Int[np.ndarray, " points"]:
    """Number of the pair of directions of each point, equal for repeats.

    Angles within ``ANGLE_TOLERANCE_DEG`` are equal; along the normal of exit all azimuths are.
    """
    keys, sign = _direction_keys(data)
    _, group = np.unique(np.column_stack([keys, sign]), axis=0, return_inverse=True)
    return group.reshape(-1)


def stated_groups(data: GonioData) -> Int[np.ndarray, " points"]:
    """As `direction_groups`, but stated azimuths count also along the normal of exit."""
    columns = [direction_groups(data), angle_labels(np.abs(data.phi_deg)), np.sign(data.phi_deg).astype(int)]
    _, group = np.unique(np.column_stack(columns), axis=0, return_inverse=True)
    return group.reshape(-1)


def angle_labels(values: Float[np.ndarray, " angles"]) -> Int[np.ndarray, " angles"]:
    """Number the distinct angles in degrees; those within the tolerance of the first one are equal."""
    distinct, inverse = np.unique(values, return_inverse=True)
    labels, start, label = np.empty(distinct.size, int), -np.inf, -1
    for index, value in enumerate(distinct):
        if value - start > ANGLE_TOLERANCE_DEG:
            start, label = value, label + 1
        labels[index] = label
    return labels[inverse.reshape(-1)]


def _direction_keys(data: GonioData) -> tuple[np.ndarray, np.ndarray]:
    polar = angle_labels(np.concatenate([data.theta_i_deg, data.theta_o_deg]))
    theta_i, theta_o = polar[: len(data)], polar[len(data) :]
    _, wavelength = np.unique(np.rint(data.wavelength_nm * 1e6), return_inverse=True)
    azimuth = np.abs(data.phi_deg)
    no_azimuth = data.theta_o_deg <= ANGLE_TOLERANCE_DEG
    in_plane = no_azimuth | (np.minimum(azimuth, 180 - azimuth) <= ANGLE_TOLERANCE_DEG)
    sign = np.where(in_plane, 0, np.sign(data.phi_deg)).astype(int)
    phi = np.where(no_azimuth, -1, angle_labels(azimuth))
    columns = [data.is_transmission, wavelength.reshape(-1), theta_i, theta_o, phi]
    return np.column_stack([np.asarray(column, int) for column in columns]), sign


def without_copies(data: GonioData) -> GonioData:
    """Used, positive points without exact copies, which would look like perfect repeats."""
    keep = data.used & (data.bsdf_per_sr > 0)
    rows = [data.theta_i_deg, data.theta_o_deg, data.phi_deg, data.wavelength_nm, data.bsdf_per_sr]
    numeric = np.column_stack([*rows, data.is_transmission])
    # A row that stands in two files is a copy, too.
    others = [values for name, values in data.extra.items() if name != FILE_COLUMN]
    text = np.array(["\x1f".join(str(values[i]) for values in others) for i in range(len(data))])
    _, text_label = np.unique(text, return_inverse=True)
    cells = np.column_stack([numeric, text_label.reshape(-1)])
    _, first = np.unique(cells, axis=0, return_index=True)
    is_first = np.zeros(len(data), bool)
    is_first[first] = True
    keep &= is_first
    # Masking instead of removing rows keeps the scan numbers of the whole measurement.
    return data.replace(mask=np.where(keep, 0, 1))


def repeat_differences(data: GonioData) -> tuple[Differences, DirectionMeans]:
    """Differences between repeats of a direction among the used points, and the means of each."""
    here = np.flatnonzero(data.used)
    keys, sign = _direction_keys(data)
    keys, sign, value = keys[here], sign[here], data.bsdf_per_sr[here]
    scan = data.scan_index[here]
    _, first, group, count = np.unique(
        np.column_stack([keys, sign]), axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    group = group.reshape(-1)
    mean = np.bincount(group, weights=value) / count
    order = np.argsort(group, kind="stable")
    starts = np.concatenate([[0], np.cumsum(count)[:-1]])
    a, b, weight = [], [], []
    for start, size in zip(starts[count > 1], count[count > 1], strict=True):
        i, j = np.triu_indices(size, 1)
        a.append(order[start + i])
        b.append(order[start + j])
        # All pairs give the sample variance; together they have the weight of size - 1 degrees of freedom.
        weight.append(np.full(i.size, 2.0 / size))
    first_of, second_of = (np.concatenate(part) if part else np.empty(0, int) for part in (a, b))
    relative = (value[second_of] - value[first_of]) / mean[group[first_of]] / np.sqrt(2)
    weights = np.concatenate(weight) if weight else np.empty(0)
    twice = np.full(first_of.size, 2.0)
    differences = Differences(relative, weights, scan[first_of], scan[second_of], twice)
    along_normal = np.minimum(data.theta_i_deg, data.theta_o_deg)[here] <= ANGLE_TOLERANCE_DEG
    means = DirectionMeans(mean, count, scan[first], keys[first], sign[first], along_normal[first])
    return differences, means


def _differences(means: DirectionMeans, a: np.ndarray, b: np.ndarray) -> Differences:
    spread = 1 / means.count[a] + 1 / means.count[b]
    relative = 2 * (means.value[a] - means.value[b]) / (means.value[a] + means.value[b])
    relative /= np.sqrt(spread)
    return Differences(relative, np.ones(a.size), means.scan[a], means.scan[b], spread)


def _matches(wanted: np.ndarray, keys: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices of equal rows of two tables of distinct rows."""
    _, label = np.unique(np.concatenate([wanted, keys]), axis=0, return_inverse=True)
    label = label.reshape(-1)
    _, in_wanted, in_keys = np.intersect1d(
        label[: len(wanted)], label[len(wanted) :], assume_unique=True, return_indices=True
    )
    return in_wanted, in_keys


def mirror_differences(means: DirectionMeans) -> Differences:
    """Differences f(phi) - f(-phi), zero for an azimuthally isotropic sample."""
    plus, minus = np.flatnonzero(means.sign > 0), np.flatnonzero(means.sign < 0)
    a, b = _matches(means.keys[plus], means.keys[minus])
    return _differences(means, plus[a], minus[b])


def reciprocal_differences(means: DirectionMeans) -> Differences:
    """Differences f(i, o) - f(o, i) in reflection; in transmission the partner enters from the other side.

    Mirror images are averaged first, as are all azimuths along a normal, where the azimuth has no meaning
    for an azimuthally isotropic sample.
    """
    reflected = np.flatnonzero(means.keys[:, 0] == 0)
    keys = means.keys[reflected].copy()
    keys[means.along_normal[reflected], 4] = -1
    unique, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    group = group.reshape(-1)
    weight = means.count[reflected]
    count = np.bincount(group, weights=weight, minlength=len(unique))
    total = np.bincount(group, weights=weight * means.value[reflected], minlength=len(unique))
    source = reflected[first]
    pooled = DirectionMeans(
        total / count, count, means.scan[source], unique, means.sign[source], means.along_normal[source]
    )
    a = np.flatnonzero(unique[:, 2] < unique[:, 3])
    found, b = _matches(unique[a][:, [0, 1, 3, 2, 4]], unique)
    return _differences(pooled, a[found], b)
