"""Mitsuba 3 BSDF ``jaxink_table``: an ink between the inside of a plate (I) and the other side (A).

Needs mitsuba 3, numpy, xarray and netCDF4 or h5netcdf, but not jaxink. Set the variant first::

    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    import jaxink_table  # registers the plug-in

    bsdf = mi.load_dict({"type": "jaxink_table", "filename": "ink.nc"})

The normal of the shape points from I to A, like the outward normals of a closed plate.
"""

import drjit as dr
import mitsuba as mi
import numpy as np
import xarray

# Reflection and transmission of light from side A (front), then from side I.
_COMPONENTS = ("R_AA", "T_AI", "R_II", "T_IA")
_LOBES = (
    mi.BSDFFlags.GlossyReflection,
    mi.BSDFFlags.GlossyTransmission,
    mi.BSDFFlags.DeltaReflection,
    mi.BSDFFlags.DeltaTransmission,
)
_VARIANT = mi.variant() or ""
_SCALAR = _VARIANT.startswith("scalar")
_SPECTRAL = "spectral" in _VARIANT


def _buffer(values):
    """Numbers in a form that `_at` reads."""
    flat = np.ascontiguousarray(values, dtype=np.float64).ravel()
    return flat.tolist() if _SCALAR else mi.Float(flat)


def _at(buffer, index, active=True):
    """Entry of a buffer."""
    return buffer[int(index)] if _SCALAR else dr.gather(mi.Float, buffer, mi.UInt32(index), active)


def _within(value, low, high):
    """The value clipped to the bounds; LLVM 15 cannot compile minimum and maximum."""
    return dr.select(value < low, low, dr.select(value > high, high, value))


def _arccos(cosine):
    return dr.acos(_within(cosine, -1.0, 1.0))


def _root(value):
    return dr.sqrt(dr.select(value > 0, value, 0.0))


def _pick(lobe, values):
    """Select a value by the number of a lobe."""
    return dr.select(
        lobe == 0, values[0], dr.select(lobe == 1, values[1], dr.select(lobe == 2, values[2], values[3]))
    )


def _search(buffer, start, size: int, value):
    """Index from ``start`` of the last of ``size`` ascending entries that is not above the value."""
    position = 0 if _SCALAR else dr.zeros(mi.UInt32, dr.width(value))
    step = 1 << (size - 1).bit_length()
    while step > 1:
        step //= 2
        further = position + step
        inside = further < size
        entry = _at(buffer, start + dr.select(inside, further, size - 1))
        position = dr.select(inside & (entry <= value), further, position)
    return position


class _Axis:
    """Ascending angles with linear interpolation."""

    def __init__(self, degrees):
        self.radians = np.deg2rad(degrees)
        self.size = len(degrees)
        self.buffer = _buffer(self.radians)

    def find(self, value):
        """Cell and fraction within it."""
        cell = _search(self.buffer, 0, self.size - 1, value)
        low, high = _at(self.buffer, cell), _at(self.buffer, cell + 1)
        return cell, _within((value - low) / (high - low), 0, 1)


class JaxinkTable(mi.BSDF):
    """Four-component BSDF table with its regular part.

    Parameters
    ----------
    props
        ``filename``: netCDF file of jaxink. ``wavelength_nm``: wavelength to use, needed if the file has
        several and the variant is not spectral. ``ignore_regular``: leave out the regular part.
    """

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        if "polarized" in mi.variant():
            raise RuntimeError(
                "jaxink_table: the table is for unpolarised light; choose an unpolarised variant."
            )
        filename = props["filename"]
        with xarray.open_dataset(filename) as opened:
            data = opened.load()
        data = data.sel(component=list(_COMPONENTS)).transpose(
            "component", "wavelength", "theta_i", "theta_o", "phi", missing_dims="ignore"
        )
        wanted = float(props.get("wavelength_nm", 0.0))
        self.keep_regular = not props.get("ignore_regular", False)
        if wanted:
            data = data.sel(wavelength=[wanted], method="nearest", tolerance=0.01)
        elif not _SPECTRAL and data.sizes["wavelength"] > 1:
            known = ", ".join(f"{w:g}" for w in data["wavelength"].values)
            raise RuntimeError(
                f"jaxink_table: {filename} has several wavelengths ({known} nm); set wavelength_nm or "
                "choose a spectral variant."
            )
        self._load(data)
        both_sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        lobes = _LOBES if self.keep_regular else _LOBES[:2]
        self.m_components = [lobe | both_sides | mi.BSDFFlags.NonSymmetric for lobe in lobes]
        self.m_flags = self.m_components[0]
        for lobe in self.m_components[1:]:
            self.m_flags = self.m_flags | lobe

    def _load(self, data):
        self.theta, self.phi = _Axis(data["theta_i"].values), _Axis(data["phi"].values)
        self.wavelengths = data["wavelength"].values
        bsdf, regular = data["bsdf_per_sr"].values, data["regular"].values
        self.bsdf, self.regular = _buffer(bsdf), _buffer(regular)
        self.bsdf_shape, self.regular_shape = bsdf.shape, regular.shape
        # One ratio for all wavelengths, because a ray has one direction.
        self.index_ratio = float(np.mean(data["index_inside"].values / data["index_outside"].values))
        # Sampling cells: projected solid angle is uniform in sin^2(theta) and phi.
        sine2 = np.sin(self.theta.radians) ** 2
        self.cell_area = np.outer(np.diff(sine2) / 2, np.diff(self.phi.radians))
        corners = bsdf.mean(axis=1)
        middle = (corners[..., :-1, :] + corners[..., 1:, :]) / 2
        middle = (middle[..., :-1] + middle[..., 1:]) / 2
        power = (middle * self.cell_area).reshape(*corners.shape[:2], -1)
        cumulated = np.concatenate([np.zeros_like(power[..., :1]), np.cumsum(power, axis=-1)], axis=-1)
        # A cell and its mirror image.
        self.diffuse_power = _buffer(2 * cumulated[..., -1])
        total = np.where(cumulated[..., -1:] > 0, cumulated[..., -1:], 1.0)
        self.cumulated = _buffer(cumulated / total)
        self.n_cells = power.shape[-1]
        self.density = _buffer(power / total / self.cell_area.ravel())
        self.sine2 = _buffer(sine2)
        self.mean_regular = _buffer(regular.mean(axis=1))

    # Look-ups. A side is 0 for A (in front of the surface), 1 for I; a component is 2 side + transmission.

    def _bsdf(self, component, theta_i, theta_o, phi, si, active):
        (i, u), (o, v), (p, w) = self.theta.find(theta_i), self.theta.find(theta_o), self.phi.find(phi)
        _, n_wavelengths, n_theta, _, n_phi = self.bsdf_shape

        def at(wavelength):
            value = 0.0
            for a in (0, 1):
                for b in (0, 1):
                    for c in (0, 1):
                        row = (component * n_wavelengths + wavelength) * n_theta + i + a
                        entry = _at(self.bsdf, (row * n_theta + o + b) * n_phi + p + c, active)
                        weight = (u if a else 1 - u) * (v if b else 1 - v) * (w if c else 1 - w)
                        value = value + entry * weight
            return value

        return self._spectrum(at, si)

    def _regular(self, component, theta_i, si, active):
        i, u = self.theta.find(theta_i)
        _, n_wavelengths, n_theta = self.regular_shape

        def at(wavelength):
            first = (component * n_wavelengths + wavelength) * n_theta + i
            return _at(self.regular, first, active) * (1 - u) + _at(self.regular, first + 1, active) * u

        return self._spectrum(at, si)

    def _spectrum(self, at, si):
        """Spectrum from the values at the table's wavelengths: linear between them, constant outside."""
        if not _SPECTRAL or len(self.wavelengths) == 1:
            return mi.Spectrum(at(0))
        values = [at(k) for k in range(len(self.wavelengths))]
        result = mi.Spectrum(values[0])
        for k, (low, high) in enumerate(zip(self.wavelengths, self.wavelengths[1:], strict=False)):
            fraction = _within((si.wavelengths - float(low)) / float(high - low), 0, 1)
            result = result + mi.Spectrum(fraction) * (values[k + 1] - values[k])
        return result

    def _powers(self, side, theta_i, active):
        """Hemispherical powers of the lobes: diffuse and regular, reflected and transmitted."""
        i, u = self.theta.find(theta_i)
        shares = []
        for buffer in (self.diffuse_power, self.mean_regular):
            for transmission in (0, 1):
                first = (2 * side + transmission) * self.theta.size + i
                share = _at(buffer, first, active) * (1 - u) + _at(buffer, first + 1, active) * u
                shares.append(share if self.keep_regular or buffer is self.diffuse_power else 0.0 * share)
        return shares

    def _chosen_powers(self, ctx, side, theta_i, active):
        """Powers of the lobes that the context enables, and their sum."""
        shares = self._powers(side, theta_i, active)
        for k, lobe in enumerate(_LOBES):
            exists = k < len(self.m_components)
            if not exists or not ctx.is_enabled(lobe, k):
                shares[k] = 0.0 * shares[k]
        return shares, shares[0] + shares[1] + shares[2] + shares[3]

    @staticmethod
    def _angles(wi, wo):
        """Polar angles from the normal of each side, and relative azimuth folded to half a circle."""
        theta_i = _arccos(dr.abs(wi.z))
        theta_o = _arccos(dr.abs(wo.z))
        length = dr.sqrt((wi.x * wi.x + wi.y * wi.y) * (wo.x * wo.x + wo.y * wo.y))
        cosine = (wi.x * wo.x + wi.y * wo.y) / dr.select(length > 0, length, 1.0)
        return theta_i, theta_o, _arccos(dr.select(length > 0, cosine, -1.0))

    def _scaling(self, ctx, wi):
        """Squared ratio of the indices on the side of wi and beyond, by which refraction scales radiance.

        The table is for light that arrives along wi; radiance is transported in the opposite direction.
        """
        if ctx.mode == mi.TransportMode.Importance:
            return 1.0
        squared = self.index_ratio**2
        return dr.select(wi.z > 0, 1 / squared, squared)

    def eval(self, ctx, si, wo, active=True):
        """BSDF times the cosine of wo."""
        wi = si.wi
        theta_i, theta_o, phi = self._angles(wi, wo)
        side, transmitted = dr.select(wi.z > 0, 0, 1), wi.z * wo.z < 0
        reflects = ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0)
        transmits = ctx.is_enabled(mi.BSDFFlags.GlossyTransmission, 1)
        active = active & dr.select(transmitted, transmits, reflects) & (wi.z * wo.z != 0)
        value = self._bsdf(2 * side + dr.select(transmitted, 1, 0), theta_i, theta_o, phi, si, active)
        scaling = dr.select(transmitted, self._scaling(ctx, wi), 1.0)
        return dr.select(active, value * (scaling * dr.abs(wo.z)), mi.Spectrum(0.0))

    def pdf(self, ctx, si, wo, active=True):
        """Density of wo per solid angle, including the probability of its lobe."""
        wi = si.wi
        theta_i, theta_o, phi = self._angles(wi, wo)
        side, transmitted = dr.select(wi.z > 0, 0, 1), wi.z * wo.z < 0
        shares, total = self._chosen_powers(ctx, side, theta_i, active)
        chance = dr.select(transmitted, shares[1], shares[0]) / dr.select(total > 0, total, 1.0)
        density = self._density(2 * side + dr.select(transmitted, 1, 0), theta_i, theta_o, phi, active)
        return dr.select(active & (wi.z * wo.z != 0), chance * density * dr.abs(wo.z), 0.0)

    def _density(self, component, theta_i, theta_o, phi, active):
        """Density per projected solid angle of directions drawn from a diffuse lobe."""
        i, u = self.theta.find(theta_i)
        cell = self.theta.find(theta_o)[0] * (self.phi.size - 1) + self.phi.find(phi)[0]
        value = 0.0
        # Each of the two tabulated incidences is drawn in proportion to its power.
        powers = []
        for a in (0, 1):
            row = component * self.theta.size + i + a
            power = _at(self.diffuse_power, row, active) * (u if a else 1 - u)
            powers.append(power)
            value = value + power * _at(self.density, row * self.n_cells + cell, active)
        total = powers[0] + powers[1]
        # A direction and its mirror image.
        return value / (2 * dr.select(total > 0, total, 1.0))

    def sample(self, ctx, si, sample1, sample2, active=True):
        """A direction, and BSDF times cosine over its density."""
        wi = si.wi
        side = dr.select(wi.z > 0, 0, 1)
        theta_i = _arccos(dr.abs(wi.z))
        shares, total = self._chosen_powers(ctx, side, theta_i, active)
        active = active & (total > 0) & (wi.z != 0)
        draw = sample1 * total
        edges = [shares[0], shares[0] + shares[1], shares[0] + shares[1] + shares[2]]
        lobe = dr.select(draw < edges[0], 0, dr.select(draw < edges[1], 1, dr.select(draw < edges[2], 2, 3)))
        start, share = _pick(lobe, [0.0, *edges]), _pick(lobe, shares)
        rest = _within((draw - start) / dr.select(share > 0, share, 1.0), 0, 1)
        transmitted, is_regular = (lobe == 1) | (lobe == 3), lobe >= 2
        component = 2 * side + dr.select(transmitted, 1, 0)
        ratio = dr.select(wi.z > 0, 1 / self.index_ratio, self.index_ratio)

        wo = dr.select(
            is_regular,
            self._straight(wi, transmitted, ratio),
            self._drawn(component, wi, theta_i, transmitted, rest, sample2, active),
        )
        sign = dr.select(transmitted, -1.0, 1.0)
        active = active & (wo.z * wi.z * sign > 0)

        bs = mi.BSDFSample3f()
        bs.wo = wo
        bs.eta = dr.select(transmitted, 1 / ratio, 1.0)
        chance = share / dr.select(total > 0, total, 1.0)
        bs.pdf = dr.select(is_regular, chance, self.pdf(ctx, si, wo, active))
        code = _pick(lobe, [int(kind) for kind in _LOBES])
        bs.sampled_type = code if _SCALAR else mi.UInt32(code)
        bs.sampled_component = lobe if _SCALAR else mi.UInt32(lobe)
        active = active & (bs.pdf > 0)

        scaling = dr.select(transmitted, self._scaling(ctx, wi), 1.0)
        regular = self._regular(component, theta_i, si, active) * scaling
        value = dr.select(is_regular, regular, self.eval(ctx, si, wo, active))
        weight = value / dr.select(active, bs.pdf, 1.0)
        return bs, dr.select(active, weight, mi.Spectrum(0.0))

    @staticmethod
    def _straight(wi, transmitted, ratio):
        """Specular or refracted direction."""
        sine2 = ratio * ratio * (1 - wi.z * wi.z)
        beyond = _root(1 - sine2)
        z = dr.select(transmitted, -dr.sign(wi.z) * beyond, wi.z)
        scale = dr.select(transmitted, ratio, 1.0)
        return mi.Vector3f(-scale * wi.x, -scale * wi.y, z)

    def _drawn(self, component, wi, theta_i, transmitted, rest, sample2, active):
        """Direction drawn from a diffuse lobe."""
        i, u = self.theta.find(theta_i)
        first = component * self.theta.size + i
        low = _at(self.diffuse_power, first, active) * (1 - u)
        high = _at(self.diffuse_power, first + 1, active) * u
        split = low / dr.select(low + high > 0, low + high, 1.0)
        upper = rest >= split
        row = first + dr.select(upper, 1, 0)
        chance = dr.select(upper, 1 - split, split)
        rest = (rest - dr.select(upper, split, 0.0)) / dr.select(chance > 0, chance, 1.0)
        rest = _within(rest, 0.0, 1 - 1e-7)
        cell = _search(self.cumulated, row * (self.n_cells + 1), self.n_cells, rest)
        n_phi = self.phi.size - 1
        o = cell // n_phi
        p = cell - o * n_phi
        # Within the cell, and on which side of the plane of incidence.
        mirrored = sample2.y < 0.5
        across = dr.select(mirrored, 2 * sample2.y, 2 * sample2.y - 1)
        sine2 = dr.lerp(_at(self.sine2, o), _at(self.sine2, o + 1), sample2.x)
        phi = dr.lerp(_at(self.phi.buffer, p), _at(self.phi.buffer, p + 1), across)
        phi = dr.select(mirrored, -phi, phi)
        sine, cosine = _root(sine2), _root(1 - sine2)
        length = _root(wi.x * wi.x + wi.y * wi.y)
        safe = dr.select(length > 0, length, 1.0)
        x, y = dr.select(length > 0, wi.x / safe, 1.0), dr.select(length > 0, wi.y / safe, 0.0)
        z = dr.sign(wi.z) * dr.select(transmitted, -cosine, cosine)
        return mi.Vector3f(
            sine * (dr.cos(phi) * x - dr.sin(phi) * y), sine * (dr.sin(phi) * x + dr.cos(phi) * y), z
        )

    def eval_pdf(self, ctx, si, wo, active=True):
        """Both at once."""
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        """Name and wavelengths."""
        known = ", ".join(f"{w:g}" for w in self.wavelengths)
        return f"JaxinkTable[wavelengths = {known} nm, index ratio = {self.index_ratio:.4g}]"


mi.register_bsdf("jaxink_table", JaxinkTable)
