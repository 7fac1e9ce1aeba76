"""Difference of an ink's BSDF inside the plate between two models of a sample."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.ink.ink_layers import adjacent_air, find_ink
from jaxink.ink.table import InkTable
from jaxink.ink.tabulate import TableOptions, ink_table
from jaxink.numerics.threads import in_threads
from jaxink.sample import Sample

# Relative changes are unlimited closer to grazing.
LARGEST_THETA_DEG = 75.0
# A comparison needs fewer entries than a ray tracer.
_OPTIONS = TableOptions(n_theta=61, n_phi=13)


@dataclasses.dataclass(frozen=True)
class ComponentDifference:
    """Change of one component over directions up to `LARGEST_THETA_DEG` from the normal on either side.

    Parameters
    ----------
    component
        One of `jaxink.ink.table.COMPONENTS`.
    wavelength_nm
        Wavelength.
    rms_percent
        Root mean square of after / before - 1 over all pairs of directions.
    largest_percent
        The change of largest magnitude.
    theta_i_deg, theta_o_deg, phi_deg
        Directions at which it occurs.
    """

    component: str
    wavelength_nm: float
    rms_percent: float
    largest_percent: float
    theta_i_deg: float
    theta_o_deg: float
    phi_deg: float


@dataclasses.dataclass(frozen=True, eq=False)
class TableComparison:
    """Tables of one ink by two models of its sample, at the same wavelengths."""

    __repr__ = brief_repr

    before: InkTable
    after: InkTable

    def at(
        self, component: str, theta_i_deg, theta_o_deg, phi_deg, wavelength: int = 0
    ) -> tuple[Float[np.ndarray, "..."], Float[np.ndarray, "..."]]:
        """BSDF before and after, 1/sr; parameters as for `InkTable.interpolated`."""
        directions = (component, theta_i_deg, theta_o_deg, phi_deg, wavelength)
        return self.before.interpolated(*directions), self.after.interpolated(*directions)

    def of(self, component: str, wavelength: int = 0) -> ComponentDifference:
        """Change of a component over all directions, at the wavelength with this index."""
        theta = self.before.theta_deg[self.before.theta_deg <= LARGEST_THETA_DEG]
        theta_i, theta_o, phi = np.meshgrid(theta, theta, self.before.phi_deg, indexing="ij")
        before, after = self.at(component, theta_i, theta_o, phi, wavelength)
        with np.errstate(divide="ignore", invalid="ignore"):
            change = 100 * np.where(before > 0, after / before - 1, np.nan)
        where: tuple = (0, 0, 0)
        if np.all(np.isnan(change)):
            rms = np.nan
        else:
            where = np.unravel_index(np.nanargmax(np.abs(change)), change.shape)
            rms = float(np.sqrt(np.nanmean(change**2)))
        return ComponentDifference(
            component,
            float(self.before.wavelength_nm[wavelength]),
            rms,
            float(change[where]),
            *(float(axis[where]) for axis in (theta_i, theta_o, phi)),
        )


def compare_tables(before: Sample, after: Sample, wavelengths_nm: Sequence[float]) -> TableComparison:
    """Tabulate the only scattering layer of a sample by two models of it; see `compare_with_each`."""
    return compare_with_each(before, [after], wavelengths_nm)[0]


def compare_with_each(
    before: Sample, others: Sequence[Sample], wavelengths_nm: Sequence[float]
) -> list[TableComparison]:
    """Tabulate the only scattering layer of a sample by one model of it, and by each of some others.

    Layers that only another model has belong to the ink, and so do layers of air between the ink and a
    further layer, so that both tables are between the same media.

    Parameters
    ----------
    before, others
        The sample by its models; only its layers matter, not its backing, beam or instrument.
    wavelengths_nm
        Wavelengths.

    Returns
    -------
    list
        The comparison with each of the others, in their order; the first model is tabulated once.

    Raises
    ------
    InputRefusedError
        If the ink or the side of its plate is ambiguous, or differs between the models.
    """
    known = {layer.name for layer in before.layers}
    ink = tuple(layer.name for layer in before.layers if layer.scatters)
    if len(ink) != 1:
        raise InputRefusedError(
            f"the sample has {len(ink)} scattering layers ({', '.join(ink)}); the comparison needs "
            "exactly one."
        )
    ink += adjacent_air(before, ink)
    options = dataclasses.replace(_OPTIONS, inside=find_ink(before, ink).inside)

    def table(sample: Sample) -> InkTable:
        found = tuple(layer.name for layer in sample.layers if layer.name not in known)
        return ink_table(sample, ink + found, wavelengths_nm, options=options)

    first, *tables = in_threads(table, [before, *others])
    return [TableComparison(first, one) for one in tables]
