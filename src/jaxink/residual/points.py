"""The residual of a model, with the settings and the noise of its points."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from jaxink.display.brief import brief_repr
from jaxink.measurement import GonioData

# Farther out of the plane of incidence than this, a direction counts as out of it.
_IN_PLANE = np.sin(np.deg2rad(1.0))
# With a smaller share of such directions, a side counts as measured in the plane of incidence.
_LEAST_SHARE = 0.1
_LEAST_PER_SR = 1e-12


@dataclass(frozen=True, eq=False)
class ResidualPoints:
    """A residual with its settings and its noise, point by point.

    Parameters
    ----------
    theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission
        See `jaxink.GonioData`.
    scan
        Number of the scan of each point.
    relative
        Measured / predicted - 1.
    relative_sigma
        Standard deviation of the noise divided by the prediction, without the factors of the scans.
    scan_relative
        Standard deviation of the common factor of each scan.
    whitened
        The residual in units of the noise, weighted; rows after the points belong to priors.
    weight
        Weight of each whitened residual.
    """

    __repr__ = brief_repr

    theta_i_deg: Float[np.ndarray, " points"]
    theta_o_deg: Float[np.ndarray, " points"]
    phi_deg: Float[np.ndarray, " points"]
    wavelength_nm: Float[np.ndarray, " points"]
    is_transmission: Bool[np.ndarray, " points"]
    scan: Int[np.ndarray, " points"]
    relative: Float[np.ndarray, " points"]
    relative_sigma: Float[np.ndarray, " points"]
    scan_relative: float
    whitened: Float[np.ndarray, " rows"]
    weight: Float[np.ndarray, " points"]

    @classmethod
    def of(
        cls,
        data: GonioData,
        predicted_per_sr: Float[np.ndarray, " points"],
        sigma_per_sr: Float[np.ndarray, " points"],
        scan_relative: float,
        whitened: Float[np.ndarray, " rows"],
        weight: Float[np.ndarray, " points"],
    ) -> "ResidualPoints":
        """Residual of a prediction at the used points of a measurement.

        Parameters
        ----------
        data
            The measurement.
        predicted_per_sr, sigma_per_sr
            Prediction and independent noise at the used points.
        scan_relative, whitened, weight
            As of the class.
        """
        used = data.used
        # A prediction of 0 has no relative change.
        predicted = np.where(np.abs(predicted_per_sr) > _LEAST_PER_SR, predicted_per_sr, _LEAST_PER_SR)
        return cls(
            data.theta_i_deg[used],
            data.theta_o_deg[used],
            data.phi_deg[used],
            data.wavelength_nm[used],
            data.is_transmission[used],
            data.used_scan_index,
            data.bsdf_per_sr[used] / predicted - 1,
            sigma_per_sr / np.abs(predicted),
            scan_relative,
            whitened,
            weight,
        )

    def __len__(self) -> int:
        return self.scan.size

    def is_in_plane(self, side: str) -> bool:
        """Whether a side was measured in the plane of incidence, but for a few points."""
        return bool(np.mean(~self.near_plane[self.of_side(side)]) < _LEAST_SHARE)

    @property
    def near_plane(self) -> Bool[np.ndarray, " points"]:
        """Points whose direction of view is in the plane of incidence."""
        across = np.sin(np.deg2rad(self.theta_o_deg)) * np.sin(np.deg2rad(self.phi_deg))
        return np.abs(across) < _IN_PLANE

    def of_side(self, side: str) -> Bool[np.ndarray, " points"]:
        """Points of side ``"R"`` or ``"T"``."""
        return self.is_transmission == (side == "T")

    def whiten(self, relative: Float[np.ndarray, "points columns"]) -> Float[np.ndarray, "rows columns"]:
        """Relative changes of the prediction in units of the noise, as `whitened`; zeros for priors.

        References
        ----------
        Woodbury identity, as in `jaxink.fitting.objective.whiten_scans`.
        """
        rows = self._with_scans(relative / self.relative_sigma[:, None], -1)
        padded = np.zeros((self.whitened.size, relative.shape[1]))
        padded[: len(self)] = self.weight[:, None] * rows
        return padded

    def unwhiten(self, rows: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " points"]:
        """Inverse of `whiten` for one column; points without weight count as 0."""
        weight = np.where(self.weight > 0, self.weight, np.inf)
        scaled = (rows[: len(self)] / weight)[:, None]
        return self._with_scans(scaled, 1)[:, 0] * self.relative_sigma

    def _with_scans(self, columns: np.ndarray, sign: int) -> np.ndarray:
        """(1 + q q^T)^(1/2) times columns within each scan, or its inverse."""
        columns = columns.copy()
        if self.scan_relative == 0:
            return columns
        common = self.scan_relative / self.relative_sigma
        for scan in np.unique(self.scan):
            here = self.scan == scan
            q = common[here]
            columns[here] += np.outer(q, (np.sqrt(1 + q @ q) ** sign - 1) * (q @ columns[here]) / (q @ q))
        return columns
