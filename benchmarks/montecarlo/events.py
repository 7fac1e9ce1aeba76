"""Next-event estimation: what each event sends to each detector.

Let E be the regular flux per horizontal area, on its way from the detector, that unit irradiance from the
detector's direction gives at a point: at the depth of a scattering both inward and back from the faces
beyond, all reflections by smooth faces summed. Power that an event sends into dOmega around the reverse of
such a beam, in a medium of index n, leaves towards the detector with the transmittance E of the same path,
and n^2 mu dOmega is the same in all media. A weight w with the density p per steradian adds to the BSDF

    w p E n_out^2 / (n^2 mu).

A rough face ends the beam: light that interacts there is an event of its own.
"""

import numpy as np

from benchmarks.montecarlo.facets import N_BATCHES, fresnel

# Numbers handled at once: they stay in the cache.
CHUNK = 2**15


class _Beam:
    """Regular light from the detectors of one side; media are numbered from that side here.

    ``arriving[f]``: flux on face f; ``entering[k]``: flux into medium k at its near face; ``returning[k]``:
    flux that comes back from its far face, there; shapes ``(detectors,)``. ``cosine[k]``: 0 where evanescent.
    """

    def __init__(self, sine, indices, depths, rough):
        kappa, n_media = indices[0] * sine, len(indices)
        self.cosine = [np.sqrt(np.maximum(1 - (kappa / n) ** 2, 0.0)) for n in indices]
        travels = [
            np.where(c > 0, depth / np.where(c > 0, c, 1.0), np.inf)
            for c, depth in zip(self.cosine, depths, strict=True)
        ]
        passage = [np.exp(-t) for t in travels]
        self.rough_face = next((f for f in range(n_media - 1) if rough[f] is not None), None)
        n_faces = n_media - 1 if self.rough_face is None else self.rough_face
        reflectance = [self._face(indices, f) for f in range(n_faces)]
        # Reflectance of all that lies behind the near side of each face.
        behind = [np.zeros_like(kappa)]
        for f in reversed(range(n_faces)):
            back = passage[f + 1] ** 2 * behind[0]
            behind.insert(0, reflectance[f] + (1 - reflectance[f]) ** 2 * back / (1 - reflectance[f] * back))
        self.arriving, self.entering, self.returning = [np.ones_like(kappa)], {}, {}
        for f in range(n_faces):
            back = passage[f + 1] ** 2 * behind[f + 1]
            entering = self.arriving[f] * (1 - reflectance[f]) / (1 - reflectance[f] * back)
            self.entering[f + 1] = entering
            self.returning[f + 1] = entering * passage[f + 1] * behind[f + 1]
            self.arriving.append(entering * passage[f + 1])

    def _face(self, indices, f):
        near, far = self.cosine[f], self.cosine[f + 1]
        both = (near > 0) & (far > 0)
        reflectance, _ = fresnel(indices[f], indices[f + 1], np.where(both, near, 1.0))
        return np.where(both, reflectance, 1.0)


class NextEvents:
    """Adds up the BSDF at the detectors, by batch."""

    def __init__(self, sample, detectors):
        theta = np.deg2rad(np.asarray(detectors.theta_deg, float))
        transmitted = np.asarray(detectors.is_transmission, bool)
        if sample.backing_albedo is not None and transmitted.any():
            raise ValueError("nothing is transmitted where a backing is behind the sample.")
        azimuth = np.deg2rad(180.0 - np.asarray(detectors.phi_deg, float))
        self.sample, self.bsdf = sample, np.zeros((theta.size, N_BATCHES))
        extinction = sample.per_medium("scattering_per_mm") + sample.per_medium("absorption_per_mm")
        thickness = sample.per_medium("thickness_mm")
        depths = np.where(extinction > 0, extinction * np.where(extinction > 0, thickness, 1.0), 0.0)
        self._extinction, self._thickness = extinction, thickness
        rough = [sample.rough(f) for f in range(len(sample.layers) + 1)]
        # For each side with detectors: which they are, the sign of z towards them, horizontal parts, beam.
        self._sides = []
        for side, z in ((False, -1.0), (True, 1.0)):
            which = np.flatnonzero(transmitted == side)
            if which.size:
                turn = slice(None, None, -1 if side else 1)
                sine = np.sin(theta[which])
                beam = _Beam(sine, sample.indices[turn], depths[turn], rough[turn])
                level = sample.indices[turn][0] * sine
                flat = np.stack([level * np.cos(azimuth[which]), level * np.sin(azimuth[which])], axis=1)
                self._sides.append((which, z, flat, beam))

    def _own(self, number, z):
        """Number of a medium as counted from the side of the detectors."""
        return number if z < 0 else len(self.sample.layers) + 1 - number

    def _own_face(self, face, z):
        return face if z < 0 else len(self.sample.layers) - face

    def _add(self, which, contribution, batch):
        """Add contributions (detectors, photons), photons in the order of their batches."""
        present = np.unique(batch)
        starts = np.searchsorted(batch, present)
        self.bsdf[np.ix_(which, present)] += np.add.reduceat(contribution, starts, axis=1)

    def on_scattering(self, number, photons, at, phase=None):
        """Scattering of the photons ``at`` in layer ``number``, by its phase function or another one."""
        layer = self.sample.layers[number - 1]
        phase = layer.phase if phase is None else phase
        depth, weight, batch = photons.depth[at], photons.weight[at], photons.batch[at]
        direction = photons.direction[:, at]
        for which, z, flat, beam in self._sides:
            own = self._own(number, z)
            cosine = beam.cosine[own] if own in beam.entering else np.zeros(which.size)
            use = cosine > 0
            if not use.any():
                continue
            cosine, flat = cosine[use], flat[use] / layer.index
            towards = np.concatenate([flat, z * cosine[:, None]], axis=1)
            from_far = towards * [1.0, 1.0, -1.0]
            factor = (self._outside(z) / layer.index) ** 2 / cosine
            near, far = factor * beam.entering[own][use], factor * beam.returning[own][use]
            # Attenuation depends on the polar angle only.
            distinct, which_polar = np.unique(cosine, return_inverse=True)
            steep = -self._extinction[number] / distinct[:, None]
            from_near = depth if z < 0 else self._thickness[number] - depth
            size = max(1, CHUNK // cosine.size)
            for start in range(0, at.size, size):
                part = slice(start, start + size)
                passage = np.exp(steep * from_near[part])[which_polar]
                sent = phase.value(towards @ direction[:, part])
                sent *= passage
                sent *= near[:, None]
                if far.any():
                    to_far = self._thickness[number] - from_near[part]
                    returned = phase.value(from_far @ direction[:, part])
                    returned *= np.exp(steep * to_far)[which_polar]
                    returned *= far[:, None]
                    sent += returned
                self._add(which[use], weight[part] * sent, batch[part])

    def _outside(self, z):
        return self.sample.index_front if z < 0 else self.sample.index_back

    def on_facet(self, face, weight, batch):
        """Hook of `cross` for a rough face, or None where no detector sees it."""
        sides = [s for s in self._sides if s[3].rough_face == self._own_face(face, s[1])]
        if not sides:
            return None

        def hook(active, direction, above):
            for side in sides:
                self._from_facets(face, side, direction, above, weight[active], batch[active])

        return hook

    def _from_facets(self, face, side, direction, above, weight, batch):
        which, z, flat, beam = side
        facets, own = self.sample.rough(face), self._own_face(face, z)
        index_out, index_other = self.sample.indices[face : face + 2][:: 1 if z < 0 else -1]
        cosine = beam.cosine[own]
        use = (cosine > 0) & (beam.arriving[own] > 0)
        cosine, sine = cosine[use], np.hypot(*flat[use].T) / index_out
        outgoing = np.concatenate([flat[use] / index_out, z * cosine[:, None]], axis=1)
        factor = (self._outside(z) / index_out) ** 2 / cosine * beam.arriving[own][use]
        factor *= facets.escape(cosine, sine)
        near = above == (z < 0)
        size = max(1, CHUNK // max(cosine.size, 1))
        for stays, indices in ((True, (index_out, index_other)), (False, (index_other, index_out))):
            rays = np.flatnonzero(near == stays)
            for start in range(0, rays.size, size):
                ray = rays[start : start + size]
                up = z if stays else -z
                sent = _facet_density(facets, -direction[:, ray], outgoing, up, indices, stays)
                self._add(which[use], weight[ray] * factor[:, None] * sent, batch[ray])

    def on_backing(self, weight, batch):
        """Light that a Lambertian backing has just reflected."""
        for which, z, _, beam in self._sides:
            if beam.rough_face is None:
                back = (self._outside(z) / self.sample.index_back) ** 2 / np.pi * beam.arriving[-1]
                self._add(which, back[:, None] * weight, batch)


def _facet_density(facets, i, o, up, indices, reflects):
    """Density per steradian of ``o`` (detectors, 3) for rays from ``i`` (3, rays), without masking at exit.

    ``up`` is the sign of z of the medium of the rays, ``indices`` are its own and that beyond the facets.

    References
    ----------
    Walter et al. 2007, EGSR, equations 13-17, for the half vectors and their Jacobians.
    """
    index_out = indices[0] if reflects else indices[1]
    half = [indices[0] * i[k] + index_out * o[:, k, None] for k in range(3)]
    squared = half[0] ** 2 + half[1] ** 2 + half[2] ** 2
    scale = np.sign(half[2]) * up / np.sqrt(np.maximum(squared, 1e-300))
    steepness = np.maximum(np.abs(half[2]) / np.sqrt(np.maximum(squared, 1e-300)), 1e-12)
    cosine_in = scale * (half[0] * i[0] + half[1] * i[1] + half[2] * i[2])
    cosine_out = scale * (half[0] * o[:, 0, None] + half[1] * o[:, 1, None] + half[2] * o[:, 2, None])
    slope = np.sqrt(np.maximum(1 - steepness**2, 1e-24)) / steepness
    height, across = i[2] * up, np.hypot(i[0], i[1])
    norm = np.maximum(height, 0.0) + facets.excess(height, across)
    density = facets.density(slope) / (steepness**4 * np.maximum(norm, 1e-300))
    faces_ray = cosine_in > 0
    reflectance, _ = fresnel(*indices, np.where(faces_ray, cosine_in, 1.0))
    if reflects:
        return np.where(faces_ray, 0.25 * density * reflectance, 0.0)
    jacobian = cosine_in * -cosine_out * index_out**2 / np.maximum(squared, 1e-300)
    return np.where(faces_ray & (cosine_out < 0), density * (1 - reflectance) * jacobian, 0.0)
