"""Effects of the instrument: the BSDF is as modelled, the readings are not."""

import dataclasses

import jax.numpy as jnp
import numpy as np

from jaxink.effects.case import Case
from jaxink.effects.kinds import ReadingEffect, ScalingEffect
from jaxink.effects.scene import GRID_DEG, INCIDENCE_STEP_DEG, Surroundings
from jaxink.sample import terms_of

_MANY_PLANES = "the scans have too many planes of view for integrals along them"


@dataclasses.dataclass(frozen=True)
class Gain(ScalingEffect):
    """All readings are wrong by a common factor."""

    name, may_be_negative, usual = "gain", True, 0.05
    statement = "the calibration is wrong by one factor for all scans"
    numbered = "the readings of all scans are wrong by {relative%}"
    terms = terms_of("gain")

    def factor(self, values, is_transmission):
        """Return 1 + s in y = (1 + s) f."""
        return jnp.asarray(1 + values["gain.relative"])


@dataclasses.dataclass(frozen=True)
class SideGain(ScalingEffect):
    """Readings in reflection are wrong by a factor relative to transmission."""

    name, may_be_negative, usual = "side_gain", True, 0.03
    statement = "the calibration of reflection is wrong relative to that of transmission"
    numbered = "the readings in reflection are wrong by {relative%}"
    terms = terms_of("side_gain")

    @classmethod
    def forms(cls, case: Case):
        sides = np.unique(case.scene.is_transmission)
        return (cls(),) if sides.size == 2 else "only one side was measured, so this is the same as gain"

    def factor(self, values, is_transmission):
        """Return 1 + s in y = (1 + s) f, in reflection only."""
        return 1 + values["side_gain.relative"] * jnp.asarray(~is_transmission)


@dataclasses.dataclass(frozen=True)
class AngleOffset(ReadingEffect):
    """Zero error of the detector arm."""

    name, may_be_negative, usual = "angle_offset", True, 0.3
    looks_at = Surroundings.PLANES
    statement = "the detector arm has an angular offset"
    numbered = "the detector arm has an angular offset of {angle_deg}"
    terms = terms_of("angle_offset")

    @classmethod
    def forms(cls, case: Case):
        return (cls(),) if case.scene.in_few_planes else _MANY_PLANES

    def change(self, predicted, values, field):
        """True angle = label + offset in reflection, label - offset in transmission; to second order."""
        scene = field.scene
        moved = jnp.deg2rad(values["angle_offset.angle_deg"]) * jnp.where(scene.is_transmission, -1.0, 1.0)
        first, second = field.along(scene.slope), field.along(scene.curvature)
        return predicted + moved * first + moved**2 / 2 * second


@dataclasses.dataclass(frozen=True)
class IncidenceAngle(ReadingEffect):
    """The angle of incidence differs from its label."""

    # A stated value is wrong, as with the constants of a sample; the instrument may respond as it should.
    name, group, may_be_negative, usual = "incidence_angle", "constant", True, 0.3
    looks_at = Surroundings.INCIDENCES
    statement = "the angle of incidence differs from its label"
    numbered = "the angle of incidence differs from its label by {angle_deg}"
    terms = terms_of("incidence_angle")

    def change(self, predicted, values, field):
        """True incidence = label + offset; to second order."""
        moved = values["incidence_angle.angle_deg"] / INCIDENCE_STEP_DEG
        first = (field.upper - field.lower) / 2
        second = field.upper - 2 * field.points + field.lower
        return predicted + moved * first + moved**2 / 2 * second


@dataclasses.dataclass(frozen=True)
class Blur(ReadingEffect):
    """Finite angular resolution: a Gaussian core and Cauchy wings, regular peaks included.

    The radiant intensity f cos(theta) is convolved along the plane of a scan; a regular peak is seen through
    the two-dimensional kernels with these projections.
    """

    has_wings: bool = False

    name, looks_at = "blur", Surroundings.PLANES
    statement = "the angular resolution is finite"

    @property
    def numbered(self):
        core = "the angular resolution is finite, with a variance of {core_variance_deg2}"
        wings = ", and {wing_share%} of the light is in wings with a half-width of {wing_half_width_deg}"
        return core + wings if self.has_wings else core

    @classmethod
    def forms(cls, case: Case):
        return (cls(False), cls(True)) if case.scene.in_few_planes else _MANY_PLANES

    @classmethod
    def of_sample(cls, sample):
        del sample
        return cls(True)

    @property
    def form(self):
        return {}

    @property
    def terms(self):
        """Variance of the core; with wings also their share of the power and their half width."""
        core, share, width = terms_of("blur")
        return (share, core, width) if self.has_wings else (core,)

    @property
    def settings(self):
        """Half widths of the wings."""
        if not self.has_wings:
            return ({},)
        return tuple({"blur.wing_half_width_deg": width} for width in (2.0, 4.0, 8.0))

    @property
    def carrier(self):
        """The form with wings, whose share may be 0."""
        return Blur(True)

    def change(self, predicted, values, field):
        scene, radian = field.scene, np.pi / 180
        angle = jnp.deg2rad(scene.signed_deg)
        cosine, sine = jnp.cos(angle), jnp.sin(angle)
        variance = values["blur.core_variance_deg2"] * radian**2
        share = values["blur.wing_share"]
        width = values["blur.wing_half_width_deg"] * radian
        # d2(f cos)/dtheta2 / cos by the product rule.
        bend = field.along(scene.curvature) - 2 * field.along(scene.slope) * sine / cosine - field.points
        core = field.points + variance / 2 * bend
        apart = jnp.deg2rad(scene.signed_deg[:, None] - GRID_DEG)
        step = jnp.deg2rad(GRID_DEG[1] - GRID_DEG[0])
        wing = step * width / jnp.pi / (apart**2 + width**2)
        intensity = field.grid * jnp.cos(jnp.deg2rad(GRID_DEG))
        wings = jnp.sum(wing * intensity[scene.plane], axis=1) / cosine
        # Two-dimensional kernels with these projections; that of the core vanishes with its variance.
        distance2 = jnp.deg2rad(scene.from_forward_deg) ** 2
        safe = jnp.maximum(variance, 1e-9)
        peak = jnp.exp(-distance2 / (2 * safe)) / (2 * jnp.pi * safe)
        foot = width / (2 * jnp.pi * (distance2 + width**2) ** 1.5)
        seen = field.regular * ((1 - share) * peak + share * foot) / cosine
        return predicted + (1 - share) * core + share * wings + seen - field.points


@dataclasses.dataclass(frozen=True)
class StrayLight(ReadingEffect):
    """Stray light adds a constant BSDF."""

    name, usual = "stray_light", 0.002
    statement = "stray light adds a constant to the BSDF"
    numbered = "stray light adds {level_per_sr} to the BSDF"
    terms = terms_of("stray_light")

    def change(self, predicted, values, field):
        """Return y = f + s."""
        return predicted + values["stray_light.level_per_sr"]


@dataclasses.dataclass(frozen=True)
class SignalFloor(ReadingEffect):
    """The electronics add a constant signal, which adds s / cos(theta_o) to the BSDF."""

    name, usual = "signal_floor", 0.001
    statement = "the electronics add a constant to the detector's signal"
    numbered = "the electronics add {level_per_sr} to the detector's signal"
    terms = terms_of("signal_floor")

    def change(self, predicted, values, field):
        """Return y = f + s / cos(theta_o)."""
        return predicted + values["signal_floor.level_per_sr"] / jnp.cos(jnp.deg2rad(field.scene.theta_o_deg))


@dataclasses.dataclass(frozen=True)
class Nonlinearity(ReadingEffect):
    """The detector is not linear.

    Parameters
    ----------
    full_scale_per_sr
        Signal v_max; None: the largest of the points.
    """

    full_scale_per_sr: float | None = None

    name, may_be_negative, usual = "nonlinearity", True, 0.02
    statement = "the detector is not linear, or something else grows with the signal"
    numbered = (
        "the detector is not linear, or something else grows with the signal: the reading of the largest one "
        "is off by {relative%}"
    )
    # A weak one resembles much that light adds, and detectors of goniometers are linear to 0.1 % as a rule.
    handicap = 10.0
    terms = terms_of("nonlinearity")

    def settled(self, scene, measured):
        """With the largest measured signal as the full scale."""
        largest = float(np.max(measured * np.cos(np.deg2rad(scene.theta_o_deg))))
        return self if self.full_scale_per_sr is not None else Nonlinearity(largest)

    def change(self, predicted, values, field):
        """Return y = f (1 + s v / v_max), v the detector's signal f cos(theta_o)."""
        signal = field.points * jnp.cos(jnp.deg2rad(field.scene.theta_o_deg))
        full = jnp.max(signal) if self.full_scale_per_sr is None else self.full_scale_per_sr
        return predicted * (1 + values["nonlinearity.relative"] * signal / full)


@dataclasses.dataclass(frozen=True)
class Drift(ReadingEffect):
    """The lamp drifts, in the order of the file's rows.

    Parameters
    ----------
    first_row, last_row
        Rows at the times -1/2 and 1/2; None: of the first and the last point.
    """

    first_row: float | None = None
    last_row: float | None = None

    name, may_be_negative, usual = "drift", True, 0.01
    statement = "the signal drifts from the first to the last row"
    numbered = "the signal drifts by {relative%} from the first to the last row"
    terms = terms_of("drift")

    def settled(self, scene, measured):
        """With the first and the last row of these points."""
        del measured
        first, last = self._rows(scene)
        return Drift(float(first), float(last))

    def change(self, predicted, values, field):
        """Return y = f (1 + s t), t from -1/2 to 1/2."""
        first, last = self._rows(field.scene)
        time = (field.scene.row - first) / jnp.maximum(last - first, 1.0)
        return predicted * (1 + values["drift.relative"] * (time - 0.5))

    def _rows(self, scene):
        first = jnp.min(scene.row) if self.first_row is None else self.first_row
        return first, jnp.max(scene.row) if self.last_row is None else self.last_row


INSTRUMENT = (AngleOffset, IncidenceAngle, Blur, Gain, SideGain, StrayLight, SignalFloor, Nonlinearity, Drift)
