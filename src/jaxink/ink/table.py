"""Table of an ink's BSDF between the inside of the plate (side I) and the other side (A), and its Dataset."""

import dataclasses
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief
from jaxink.display.card import Card, CardTable, Presented
from jaxink.errors import InputRefusedError
from jaxink.files.netcdf import Schema, Variable, described, read_dataset, values_of, write_dataset
from jaxink.ink.lobes import COMPONENTS, FacetLobes
from jaxink.ink.polar_grid import linear_matrix

if TYPE_CHECKING:
    import xarray

_SCHEMA = Schema(
    "jaxink.ink_table",
    1,
    "an ink table",
    "BSDF = radiance over irradiance, cosine not included, without the regular part. I is the inside of the "
    "plate, A the other side; the first letter after R or T is the side that light comes from, the second "
    "the side that it leaves to. theta_i and theta_o are measured from the normal in the medium of their own "
    "side. phi is the azimuth of the outgoing direction minus that towards the source: 180 is the half-plane "
    "of the specular or refracted direction, 0 that of the source, and 180 to 360 mirrors 0 to 180. "
    "Reciprocity: R(i, o) = R(o, i), T_IA(i, o) / index_outside^2 = T_AI(o, i) / index_inside^2. regular is "
    "the share of power that leaves in the specular or refracted direction. The values at 90 degrees are "
    "those at grazing_theta_deg, if it is given. facet_*, if present: lobes of light that meets one facet of "
    "a rough face and is otherwise regular. They are included in bsdf_per_sr but too narrow for "
    "interpolation: subtract them, interpolate the rest, and add them again, using the microfacet formulas "
    "(Walter et al. 2007, equations 20 and 21) with facet_passage in place of the masking.",
)
_DIMS = ("component", "wavelength", "theta_i", "theta_o", "phi")
_VARIABLES = tuple(
    Variable(name, dims, units, meaning, name)
    for name, dims, units, meaning in (
        ("bsdf_per_sr", _DIMS, "sr-1", "radiance over irradiance, without cosine and regular part"),
        ("regular", _DIMS[:3], "1", "regular reflectance or transmittance"),
        ("index_inside", ("wavelength",), "1", "refractive index of side I"),
        ("index_outside", ("wavelength",), "1", "refractive index of side A"),
        ("bsdf_standard_error_per_sr", _DIMS, "sr-1", "standard error of bsdf_per_sr from the fit"),
        ("regular_standard_error", _DIMS[:3], "1", "standard error of regular from the fit"),
    )
)
_OPTIONAL = ("bsdf_standard_error_per_sr", "regular_standard_error")
_LOBES = tuple(
    Variable(name, dims, "1", meaning, field)
    for field, name, dims, meaning in (
        ("slope", "facet_slope", ("facet_slope",), "slope of facets"),
        (
            "radial_density",
            "facet_radial_density",
            ("face", "wavelength", "facet_slope"),
            "slope times slope density per area of the slope plane",
        ),
        (
            "face_index",
            "facet_index",
            ("side", "face", "wavelength"),
            "refractive index next to a face, towards side I and towards side A",
        ),
        (
            "passage",
            "facet_passage",
            ("side", "face", "wavelength", "theta_i"),
            "share of the light from a side that reaches a face regularly, times Smith's masking",
        ),
    )
)
_COORDINATES = tuple(
    Variable(name, (name,), units, meaning, field)
    for name, field, units, meaning in (
        ("wavelength", "wavelength_nm", "nm", "wavelength in vacuum"),
        ("theta_i", "theta_deg", "degree", "polar angle of incidence in the medium of the side of incidence"),
        ("theta_o", "theta_deg", "degree", "polar angle of outgoing light in the medium of the exit side"),
        ("phi", "phi_deg", "degree", "azimuth of the outgoing direction minus that towards the source"),
    )
)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class InkTable(Presented):
    """BSDF of an ink alone, with four components; isotropic about the normal.

    Parameters
    ----------
    wavelength_nm
        Wavelengths, ascending, shape ``(wavelengths,)``.
    theta_deg
        Polar angles of incidence and exit, ascending from 0 to 90, shape ``(angles,)``; each is measured from
        the normal in the medium of its own side.
    phi_deg
        Azimuths, ascending from 0 (towards the source) to 180 (specular or undeviated direction), shape
        ``(azimuths,)``; the other half is the mirror image.
    bsdf_per_sr
        Radiance over irradiance without cosine and without the regular part, shape
        ``(4, wavelengths, angles, angles, azimuths)``: component as in `COMPONENTS`, incidence before exit.
    regular
        Power that leaves in the specular (R) or refracted (T) direction over incident power, shape
        ``(4, wavelengths, angles)``.
    index_inside, index_outside
        Refractive indices of side I and side A, shape ``(wavelengths,)``.
    bsdf_standard_error_per_sr, regular_standard_error
        Standard errors from the fit's covariance, shapes as their quantities; None if unknown.
    attrs
        Strings and numbers on the origin of the table.
    lobes
        Lobes of rough interfaces, which are included in ``bsdf_per_sr`` but too narrow for interpolation;
        None if all interfaces are smooth.
    """

    wavelength_nm: Float[np.ndarray, " wavelengths"]
    theta_deg: Float[np.ndarray, " angles"]
    phi_deg: Float[np.ndarray, " azimuths"]
    bsdf_per_sr: Float[np.ndarray, "4 wavelengths angles angles azimuths"]
    regular: Float[np.ndarray, "4 wavelengths angles"]
    index_inside: Float[np.ndarray, " wavelengths"]
    index_outside: Float[np.ndarray, " wavelengths"]
    bsdf_standard_error_per_sr: Float[np.ndarray, "4 wavelengths angles angles azimuths"] | None = None
    regular_standard_error: Float[np.ndarray, "4 wavelengths angles"] | None = None
    attrs: dict[str, Any] = dataclasses.field(default_factory=dict)
    lobes: FacetLobes | None = None

    def __post_init__(self):
        n_wavelengths, n_angles, n_azimuths = (
            len(axis) for axis in (self.wavelength_nm, self.theta_deg, self.phi_deg)
        )
        shapes = {
            "bsdf_per_sr": (4, n_wavelengths, n_angles, n_angles, n_azimuths),
            "regular": (4, n_wavelengths, n_angles),
            "index_inside": (n_wavelengths,),
            "index_outside": (n_wavelengths,),
        }
        for name, shape in shapes.items():
            if np.shape(getattr(self, name)) != shape:
                raise InputRefusedError(
                    f"{name} of an ink table has shape {np.shape(getattr(self, name))}; its axes require "
                    f"{shape}."
                )
        for name, last in (("theta_deg", 90.0), ("phi_deg", 180.0)):
            axis = getattr(self, name)
            if axis[0] != 0 or axis[-1] != last or np.any(np.diff(axis) <= 0):
                raise InputRefusedError(f"{name} of an ink table must ascend from 0 to {last:g} degrees.")

    def index_of_sides(self, component: str) -> tuple[np.ndarray, np.ndarray]:
        """Refractive indices of the side of incidence and of the exit side of a component."""
        indices = {"I": self.index_inside, "A": self.index_outside}
        return indices[component[2]], indices[component[3]]

    @cached_property
    def rest_per_sr(self) -> Float[np.ndarray, "4 wavelengths angles angles azimuths"]:
        """The BSDF without the lobes, smooth between the entries."""
        if self.lobes is None:
            return self.bsdf_per_sr
        into, out, phi = np.meshgrid(self.theta_deg, self.theta_deg, self.phi_deg, indexing="ij")
        lobes = [
            [self.lobes_at(name, into, out, phi, w) for w in range(len(self.wavelength_nm))]
            for name in COMPONENTS
        ]
        return self.bsdf_per_sr - np.array(lobes)

    def lobes_at(
        self, component: str, theta_i_deg, theta_o_deg, phi_deg, wavelength: int = 0
    ) -> Float[np.ndarray, "*points"]:
        """BSDF of the lobes alone at any directions; parameters as for `interpolated`."""
        if self.lobes is None:
            return np.zeros(np.broadcast_shapes(*map(np.shape, (theta_i_deg, theta_o_deg, phi_deg))))
        return self.lobes.bsdf(component, wavelength, theta_i_deg, theta_o_deg, phi_deg)

    def interpolated(
        self, component: str, theta_i_deg, theta_o_deg, phi_deg, wavelength: int = 0
    ) -> Float[np.ndarray, "..."]:
        """BSDF at any directions, 1/sr: lobes in closed form, the rest by linear interpolation.

        Parameters
        ----------
        component
            One of `COMPONENTS`.
        theta_i_deg, theta_o_deg, phi_deg
            Directions, of shapes that broadcast; azimuths beyond 180 are mirrored.
        wavelength
            Index of the wavelength.
        """
        from scipy.interpolate import RegularGridInterpolator

        axes = (self.theta_deg, self.theta_deg, self.phi_deg)
        values = self.rest_per_sr[COMPONENTS.index(component), wavelength]
        turned = np.abs((np.asarray(phi_deg, float) + 180) % 360 - 180)
        points = np.stack(np.broadcast_arrays(theta_i_deg, theta_o_deg, turned), axis=-1)
        # Without the reshape, a single point would give an array of length one.
        rest = RegularGridInterpolator(axes, values)(points).reshape(points.shape[:-1])
        if self.lobes is None:
            return rest
        # The rest may be slightly negative by rounding.
        whole = rest + self.lobes_at(component, theta_i_deg, theta_o_deg, phi_deg, wavelength)
        return np.maximum(whole, 0.0)

    def interpolation_error(
        self, largest_theta_deg: float = 85.0, lobes_apart: bool = True
    ) -> dict[str, float]:
        """Estimate of the largest error of linear interpolation in the polar angles, by component.

        Parameters
        ----------
        largest_theta_deg
            Largest angle considered; closer to grazing, entries may grow without limit.
        lobes_apart
            Whether the lobes are evaluated separately, as by `interpolated`, or interpolated with the rest.

        Returns
        -------
        dict[str, float]
            Error over the largest BSDF at the same incidence: a quarter, by the square law, of the error at
            the entries that a table of every second angle omits.
        """
        kept = np.unique(np.append(np.arange(0, len(self.theta_deg), 2), len(self.theta_deg) - 1))
        looked_at = self.theta_deg <= largest_theta_deg
        rows = linear_matrix(self.theta_deg[kept], self.theta_deg[looked_at])
        found = {}
        read = self.rest_per_sr if lobes_apart else self.bsdf_per_sr
        for name, values, whole in zip(COMPONENTS, read, self.bsdf_per_sr, strict=True):
            exact = values[:, looked_at][:, :, looked_at]
            thinned = values[:, kept][:, :, kept]
            difference = np.abs(np.einsum("ia,wabp,ob->wiop", rows, thinned, rows, optimize=True) - exact)
            top = np.max(whole[:, looked_at][:, :, looked_at], axis=(2, 3), keepdims=True)
            found[name] = float(np.max(difference / np.where(top > 0, top, np.inf))) / 4
        return found

    def card(self) -> Card:
        """Size of the table, refractive indices, and the range of each component."""
        shape = f"{len(self.theta_deg)} polar angles, {len(self.phi_deg)} azimuths"
        title = f"BSDF of an ink between its plate (I) and the other side (A): {shape}"
        rows = [
            [name, f"{w:g}", *(f"{n[i]:.4g}" for n in self.index_of_sides(name))]
            + [f"{f(self.bsdf_per_sr[c, i]):.4g}" for f in (np.min, np.max)]
            + [f"{np.max(self.regular[c, i]):.4g}"]
            for c, name in enumerate(COMPONENTS)
            for i, w in enumerate(self.wavelength_nm)
        ]
        heads = ["component", "nm", "index of incidence", "index of exit", "least BSDF [1/sr]"]
        heads += ["largest BSDF [1/sr]", "largest regular power"]
        remarks = [f"{name}: {brief(value)}" for name, value in self.attrs.items()]
        return Card(title, tables=(CardTable(heads, rows),), remarks=remarks)

    def to_dataset(self) -> "xarray.Dataset":
        """The table as an xarray Dataset with dimensions component, wavelength, theta_i, theta_o, phi."""
        return dataset_of(self)

    @classmethod
    def from_dataset(cls, dataset: "xarray.Dataset", called: str = "the Dataset") -> "InkTable":
        """The table of a Dataset from `to_dataset`; ``called`` is its name in messages.

        Raises
        ------
        InputRefusedError
            If it has another schema or lacks a variable.
        """
        return cls(**fields_of(dataset, called))

    def to_netcdf(self, path: str | Path) -> Path:
        """Write the table to a netCDF 4 file (suffix .nc), whole or not at all, replacing an existing one.

        Raises
        ------
        InputRefusedError
            If the suffix is different or the folder cannot be written to.
        """
        return write_dataset(self.to_dataset(), path)


def read_ink_table(path: str | Path) -> InkTable:
    """Read a table written by `InkTable.to_netcdf`, equal to the last bit.

    Raises
    ------
    InputRefusedError
        If the file does not exist or is not an ink table.
    """
    return InkTable.from_dataset(read_dataset(Path(path), what="ink table"), str(path))


def dataset_of(table: Any) -> "xarray.Dataset":
    """The Dataset of an `InkTable`, see `InkTable.to_dataset`."""
    import xarray

    coordinates = described(table, _COORDINATES)
    coordinates["component"] = (
        "component",
        np.array(COMPONENTS, object),
        {"long_name": "R or T, side that light comes from, side that it leaves to (I inside, A other)"},
    )
    variables = described(table, _VARIABLES)
    if table.lobes is not None:
        coordinates["side"] = ("side", np.array(("I", "A"), object), {"long_name": "side of the ink"})
        variables |= described(table.lobes, _LOBES)
    return xarray.Dataset(variables, coordinates, {**table.attrs, **_SCHEMA.attrs})


def fields_of(dataset: "xarray.Dataset", called: str) -> dict[str, Any]:
    """Fields of an `InkTable`; parameters and exceptions as for `InkTable.from_dataset`."""
    _SCHEMA.require(dataset, called)

    def read(variables: tuple[Variable, ...]) -> dict[str, np.ndarray]:
        return {
            v.field: values_of(dataset, v.name, v.dims, called, "fiu")
            for v in variables
            if v.name in dataset.variables or v.name not in _OPTIONAL
        }

    fields: dict[str, Any] = read((*_COORDINATES, *_VARIABLES))
    if tuple(values_of(dataset, "component", ("component",), called, "OUT")) != COMPONENTS:
        raise InputRefusedError(f"{called}: component must be {', '.join(COMPONENTS)}, in this order.")
    if not np.array_equal(dataset["theta_i"], dataset["theta_o"]):
        raise InputRefusedError(f"{called}: theta_i and theta_o differ; they must be equal in an ink table.")
    if _LOBES[0].name in dataset.variables:
        fields["lobes"] = FacetLobes(
            theta_deg=fields["theta_deg"],
            index=np.stack([fields["index_inside"], fields["index_outside"]]),
            grazing_theta_deg=float(dataset.attrs.get("grazing_theta_deg", 90.0)),
            **read(_LOBES),
        )
    fields["attrs"] = {
        key: value.item() if isinstance(value, np.generic) else value
        for key, value in dataset.attrs.items()
        if key not in _SCHEMA.attrs
    }
    return fields
