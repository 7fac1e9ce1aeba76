"""The BSDF of an ink alone, for light inside the plate, with standard errors."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from jaxink.errors import InputRefusedError, require_kind, require_number
from jaxink.files.version import installed_version
from jaxink.fitting import FitResult, load_result
from jaxink.ink.areas import Area, Areas, areas_of
from jaxink.ink.ink_layers import InkLayers, find_ink
from jaxink.ink.polar_grid import critical_angles_deg, polar_grid, require_few_entries
from jaxink.ink.stack_lobes import facet_lobes
from jaxink.ink.stacks import ink_stacks, isolated_model, reversed_stack
from jaxink.ink.table import InkTable
from jaxink.ink.uncertainty import ParameterCovariance
from jaxink.model import ForwardModel
from jaxink.numerics.compiling import NONE, Tiered
from jaxink.numerics.fingerprint import fingerprint
from jaxink.numerics.precision import computing
from jaxink.numerics.threads import in_threads
from jaxink.numerics.weak_cache import WeakCache
from jaxink.optics import Directions, fresnel_reflectance, refracted_cosine
from jaxink.sample import Sample
from jaxink.solver import DEFAULT_ACCURACY, ChannelPlan, SolverConfig, Stack, diffuse_bsdf, regular_power

# Pairs of directions times azimuthal orders and derivatives in one solve: 160 MB for each array.
_MOST_TERMS = 20_000_000
# Number of solves above which full optimisation pays.
_MANY = 40


@dataclasses.dataclass(frozen=True)
class TableOptions:
    """Options of a table.

    Parameters
    ----------
    n_theta
        Number of polar angles; None: 61 to 181, more for inks with a narrow forward peak. The error of linear
        interpolation varies as the inverse square, see `InkTable.interpolation_error`.
    n_phi
        Number of azimuths, equally spaced from 0 to 180 degrees; None: 37 to 91 by the same rule.
    inside
        The medium that the ink is seen from, usually its plate: ``front`` or ``back``, as seen from the
        illuminated side, or the name of an adjacent layer; None: the only adjacent layer, unless that is air.
    index_inside, index_outside
        Refractive indices of side I and side A; None: those of the sample.
    accuracy
        Largest relative error of the BSDF that the discretisation of the solver may cause.
    """

    n_theta: int | None = None
    n_phi: int | None = None
    inside: str | None = None
    index_inside: float | None = None
    index_outside: float | None = None
    accuracy: float = DEFAULT_ACCURACY

    def __post_init__(self):
        if self.n_phi is not None and self.n_phi < 3:
            raise InputRefusedError(f"n_phi is {self.n_phi}; it must be at least 3.")

    def numbers(self, n_orders: int) -> tuple[int, int]:
        """``n_theta`` and ``n_phi`` for an ink that needs ``n_orders`` azimuthal orders."""
        # Gives interpolation errors of half a per cent of the maximum for thin layers.
        n_theta = min(max(61, round(3.6 * n_orders)), 181) if self.n_theta is None else self.n_theta
        n_phi = min(max(37, 2 * n_orders + 1), 91) if self.n_phi is None else self.n_phi
        require_few_entries(n_theta, n_phi)
        return n_theta, n_phi


def ink_table(
    source: FitResult | ForwardModel | Sample | str | Path,
    layers: Sequence[str] | str | None = None,
    wavelengths_nm: Sequence[float] | None = None,
    values: Mapping[str, float] | None = None,
    options: TableOptions | None = None,
) -> InkTable:
    """Tabulate the BSDF of an ink alone, between the medium of its plate (I) and the other side (A).

    Parameters
    ----------
    source
        Sample with the ink, or the folder of a fit or of a diagnosis. Only a fit gives standard errors.
        Effects that the sample declares are part of the table if they are properties of the ink.
    layers
        Names of the adjacent layers that form the ink; None: the only scattering one.
    wavelengths_nm
        Wavelengths; None: those of the fit, the model or the sample.
    values
        Values by name that replace those of the source; the table then has no standard errors.
    options
        Options; None for the defaults.

    Raises
    ------
    InputRefusedError
        If the ink, the medium that it is seen from or the wavelengths are invalid or ambiguous; as
        `UnclearInkError`, it names the choices.

    Notes
    -----
    Between equal indices the BSDF has no limit at grazing incidence and exit. The entries at 90 degrees are
    evaluated at the attribute ``grazing_theta_deg``, a quarter of the last step before.
    """
    options = TableOptions() if options is None else options
    require_kind("options", options, TableOptions)
    require_kind("source", source, FitResult, ForwardModel, Sample, str, Path)
    if isinstance(source, str | Path):
        source = load_result(source)
    sample, wavelengths = _sample_and_wavelengths(source, wavelengths_nm)
    if values:
        table = sample.parameters
        for name in values:
            if name in table and table[name].tie is not None:
                raise InputRefusedError(
                    f"{name} is tied to '{table[name].tie}'; set the parameters in this expression instead."
                )
        table = table.at(values)
        table.require_ranges()
        sample = dataclasses.replace(sample, parameters=table)
    ink = find_ink(sample, layers, options.inside, options.index_inside, options.index_outside)
    made = tabulate(ink, wavelengths, _covariance(source, values), options)
    if isinstance(source, FitResult) and not values:
        verdict = source.verdict
        made.attrs.update({"fit": verdict.sentence, "fit_verdict": str(verdict.code.value)})
    return made


def _covariance(source, values) -> ParameterCovariance:
    if not isinstance(source, FitResult):
        return ParameterCovariance.none("not from a fit")
    if values:
        return ParameterCovariance.none("values differ from those of the fit")
    return ParameterCovariance.of(source)


def _sample_and_wavelengths(source, wavelengths_nm):
    if isinstance(source, Sample):
        sample, known = source, source.wavelengths_nm
    elif isinstance(source, ForwardModel):
        sample, known = source.sample, source.wavelengths_nm
    else:
        sample = source.sample
        known = np.unique(source.data.wavelength_nm[source.data.used]).tolist()
    wavelengths = list(known) if wavelengths_nm is None else np.ravel(wavelengths_nm).tolist()
    for wavelength in wavelengths:
        require_number("a wavelength of wavelengths_nm", wavelength)
        if not 0 < wavelength < np.inf:
            raise InputRefusedError(
                f"wavelengths_nm contains {wavelength:g}; it must be positive and finite."
            )
    wavelengths = sorted(map(float, wavelengths))
    if not wavelengths:
        raise InputRefusedError("the sample names no wavelength_nm; give wavelengths_nm.")
    if len(set(wavelengths)) != len(wavelengths):
        raise InputRefusedError(f"wavelengths_nm contains a wavelength twice: {wavelengths}.")
    return sample, tuple(wavelengths)


def tabulate(
    ink: InkLayers, wavelengths_nm: Sequence[float], covariance: ParameterCovariance, options: TableOptions
) -> InkTable:
    """Tabulate an ink between its media; `ink_table` for any sample, values and covariance.

    Parameters
    ----------
    ink
        From `find_ink`, with the values of its sample. Its side and indices replace those of the options.
    wavelengths_nm
        Wavelengths, ascending.
    covariance
        Covariance of parameters of the sample, or `ParameterCovariance.none`.
    options
        Options.
    """
    with computing():
        return _tabulated(ink, tuple(wavelengths_nm), covariance, options)


def _tabulated(
    ink: InkLayers, wavelengths, covariance: ParameterCovariance, options: TableOptions
) -> InkTable:
    areas, names = areas_of(ink), covariance.names
    solved = [
        _Solved.of(areas, part, wavelengths, names, options.accuracy) for part in areas.parts if part.ink
    ]
    stacks, config = solved[0].lit[0][0], solved[0].model.config
    n_theta, n_phi = options.numbers(max(one.model.config.n_orders for one in solved))
    theta_deg = polar_grid(n_theta, [kink for one in solved for kink in _kinks_deg(one.lit[0][0])])
    grazing_deg = 90 - (90 - theta_deg[-2]) / 4
    phi_deg = np.linspace(0.0, 180.0, n_phi)
    evaluated = np.minimum(theta_deg, grazing_deg)
    weights = areas.weights_with_slopes(names)
    indices = np.asarray(stacks.index_front), np.asarray(stacks.index_back)
    spectrum = []
    for w in range(len(wavelengths)):
        each = iter([one.components(w, evaluated, phi_deg) for one in solved])
        there = [
            next(each) if part.ink else without_ink(indices[0][w], indices[1][w], evaluated, n_phi, names)
            for part in areas.parts
        ]
        components = blended(there, weights)
        spectrum.append([_with_error(bsdf, regular, covariance) for bsdf, regular in components])
    # By wavelength and component: BSDF, its error, regular power, its error.
    columns: list[Any] = [
        None if column[0][0] is None else np.swapaxes(np.array(column), 0, 1)
        for column in zip(*(zip(*parts, strict=True) for parts in spectrum), strict=True)
    ]
    bsdf_per_sr, bsdf_error, regular_power, regular_error = columns
    table = InkTable(
        wavelength_nm=np.array(wavelengths),
        theta_deg=theta_deg,
        phi_deg=phi_deg,
        bsdf_per_sr=bsdf_per_sr,
        regular=regular_power,
        index_inside=indices[0],
        index_outside=indices[1],
        bsdf_standard_error_per_sr=bsdf_error,
        regular_standard_error=regular_error,
        attrs=_attrs(ink, covariance, options, config, grazing_deg) | _attrs_of_effects(ink, areas),
        # The lobes of several areas are not known apart.
        lobes=facet_lobes(stacks, config, theta_deg, grazing_deg) if len(areas.parts) == 1 else None,
    )
    table.attrs["interpolation_error"] = max(table.interpolation_error().values())
    if table.lobes is not None:
        apart = table.interpolation_error(lobes_apart=False)
        table.attrs["interpolation_error_of_entries"] = max(apart.values())
    return table


class _Solved(NamedTuple):
    """One area: its model, and by illuminated side, from side I first: stacks, tangents, and plan."""

    model: ForwardModel
    lit: tuple[tuple[Stack, Stack, ChannelPlan], tuple[Stack, Stack, ChannelPlan]]

    @classmethod
    def of(cls, areas: Areas, part: Area, wavelengths, names: tuple[str, ...], accuracy: float) -> "_Solved":
        """Stacks of an area and their derivatives by parameters."""
        ink = part.ink
        assert ink is not None, "an area without ink has no stack"
        model = isolated_model(ink, wavelengths, accuracy)
        stacks, tangents = _stacks_and_tangents(areas, part, model, names)
        one_way = stacks, tangents, model.plan
        other_way = reversed_stack(stacks), reversed_stack(tangents), model.plan.reversed(len(stacks.layers))
        return cls(model, (one_way, other_way) if ink.inside == "front" else (other_way, one_way))

    def components(self, w: int, theta_deg, phi_deg):
        """BSDF and regular power of the four components at one wavelength, see `_side`."""

        def lit_from(side):
            stack, tangent, plan = side
            here = _at(stack, w, 0), _at(tangent, w, 1)
            return _side(*here, theta_deg, phi_deg, self.model.config, plan)

        (r_ii, t_ia), (r_aa, t_ai) = in_threads(lit_from, self.lit)
        return r_ii, t_ia, t_ai, r_aa


def _with_error(bsdf, regular, covariance: ParameterCovariance):
    """BSDF and regular power of a component, each with its standard error or None."""
    if not covariance.known:
        return bsdf[0], None, regular[0], None
    return bsdf[0], covariance.standard_error(bsdf[1:]), regular[0], covariance.standard_error(regular[1:])


def _attrs_of_effects(ink: InkLayers, areas: Areas) -> dict[str, str]:
    """What the table contains of the declared effects."""
    apart = (*areas.left_out, *areas.of_the_measurement)
    within = [e.name for e in ink.sample.effects if e.name not in apart]
    lines = {
        "effects_included": within,
        "effects_left_out": areas.left_out,
        "effects_of_the_instrument_removed": areas.of_the_measurement,
    }
    return {name: ", ".join(effects) for name, effects in lines.items() if effects}


def _attrs(ink, covariance, options, config, grazing_deg):
    return {
        "title": ink.sample.title,
        "layers": " ".join(ink.names),
        "inside": ink.inside,
        "medium_inside": ink.media[0],
        "medium_outside": ink.media[1],
        "standard_error": covariance.sentence,
        "grazing_theta_deg": float(grazing_deg),
        "accuracy": options.accuracy,
        "solver": ", ".join(f"{name} {size}" for name, size in dataclasses.asdict(config).items()),
        "jaxink_version": installed_version(),
    }


def _stacks_and_tangents(
    areas: Areas, part: Area, model: ForwardModel, names: tuple[str, ...]
) -> tuple[Stack, Stack]:
    """Stacks of an area by wavelength, and their derivatives by parameter and wavelength."""
    start = areas.start

    @jax.jit
    def of(point):
        def stacks(x):
            free = dict(zip(names, x, strict=True))
            return ink_stacks(part.ink, model, free | part.changed(areas.values(free)))

        along = jax.vmap(lambda t: jax.jvp(stacks, (point,), (t,))[1])(jnp.eye(len(names)))
        return stacks(point), along

    return of(jnp.array([float(start[name]) for name in names]))


def _at(tree, position: int, axis: int):
    """One wavelength of a tree."""
    return jax.tree.map(lambda x: jnp.take(x, position, axis=axis), tree)


def _kinks_deg(stacks: Stack) -> list[float]:
    """Critical angles of both sides against every other medium, at the extremes of their dispersion."""
    indices = np.array(stacks.indices)
    angles = []
    for own in (indices[0], indices[-1]):
        for other in indices:
            ratios = other / own
            angles += critical_angles_deg([np.min(ratios), np.max(ratios)])
    return angles


def _side(stack: Stack, tangents: Stack, theta_deg, phi_deg, config: SolverConfig, plan: ChannelPlan):
    """Reflection and transmission: of each, the BSDF at all pairs of directions and the regular power.

    The leading axis has the value first, then its derivative by each parameter.
    """
    n_theta, n_phi = len(theta_deg), len(phi_deg)
    per_incidence = 2 * n_theta * n_phi
    each = config.n_orders * (1 + len(tangents.index_front))
    n_chunks = -(-n_theta * per_incidence * each // _MOST_TERMS)
    # Chunks of equal size share one compiled program; the last incidence pads the last chunk.
    size = -(-n_theta // n_chunks)
    padded = np.append(theta_deg, np.full(n_chunks * size - n_theta, theta_deg[-1]))
    bsdf, regular = [], []
    for incidences in padded.reshape(n_chunks, size):
        axes = np.meshgrid([False, True], np.arange(size), np.arange(n_theta), phi_deg, indexing="ij")
        side, into, out, phi = (axis.ravel() for axis in axes)
        directions = Directions(
            np.sin(np.deg2rad(incidences)),
            np.sin(np.deg2rad(theta_deg)),
            into,
            out,
            np.deg2rad(180.0 - phi),
            side,
        )
        diffuse, straight = _light(stack, tangents, directions, config, plan)
        bsdf.append(np.asarray(diffuse).reshape(-1, 2, size, n_theta, n_phi))
        regular.append(np.asarray(straight))
    wholes = (np.concatenate(parts, axis=2)[:, :, :n_theta] for parts in (bsdf, regular))
    return tuple(zip(*(np.moveaxis(whole, 1, 0) for whole in wholes), strict=True))


def _light(*described: Any) -> tuple[Array, Array]:
    """Diffuse BSDF and regular power; the value first, then its derivative along each tangent.

    Of a stack, its tangents, directions, the resolution and the channels.
    """
    tree = jax.tree.map(lambda x: jnp.asarray(x) if isinstance(x, np.ndarray) else x, described)
    arrays, static = eqx.partition(tree, eqx.is_array)
    leaves, treedef = jax.tree.flatten(static)
    return _programs(treedef, tuple(leaves)).now(1)(arrays)


@WeakCache
def _programs(treedef, leaves) -> Tiered:
    static = jax.tree.unflatten(treedef, leaves)

    def light(arrays):
        stack, tangents, directions, config, plan = eqx.combine(arrays, static)

        def of(s):
            diffuse = diffuse_bsdf(s, directions, config, plan)
            return diffuse, jnp.stack(regular_power(s, directions.sin_incidence))

        if len(tangents.index_front) == 0:
            return jax.tree.map(lambda v: v[None], of(stack))
        value, slopes = jax.vmap(lambda t: jax.jvp(of, (stack,), (t,)), out_axes=(None, 0))(tangents)
        return jax.tree.map(lambda v, d: jnp.concatenate([v[None], d]), value, slopes)

    return Tiered(light, _MANY, fingerprint("ink", static), level=NONE)


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
