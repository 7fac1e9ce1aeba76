"""Converged radiances of DISORT's test problems 1 to 5 and 9: the last columns of disort_problems.csv.

The problems are those of DISORT's test programme; column ``published`` holds the radiances printed there
(of 8 to 48 streams, six digits, in the programme's units) where it prints any of light that leaves. Each
problem is solved by cdisort (nanodisort) with 96 to 236 streams. Every row keeps the radiance that
changed least from one number of streams to the next, over the irradiance, and that relative change:
rounding limits it where the beam lies close to a computational angle, or where hardly any light comes
through.

Needs nanodisort (benchmarks/speed/peers/requirements.txt) and nothing of jaxink. About a minute.

python -m benchmarks.validation.accuracy.disort_reference
"""

import csv

import numpy as np

from benchmarks.validation.accuracy.disort_problems import (
    TABLE,
    column,
    is_transmission,
    layers,
    phase_moments,
    read_problems,
)

# With more, cdisort refuses a beam along the normal as too close to a computational angle.
STREAMS = (96, 128, 160, 192, 224, 236)


def radiances(rows: list[dict], streams: int) -> np.ndarray:
    """Radiance over the irradiance of a beam, or over the radiance of diffuse light, of one problem."""
    import nanodisort

    thickness, albedo = layers(rows)
    moments = phase_moments(rows[0]["phase"], streams + 1)
    # cdisort's cosines are negative for light that goes down, its azimuth is 0 straight on where ours is 180.
    cosines, row_cosine = np.unique(
        np.where(is_transmission(rows), -1, 1) * column(rows, "mu"), return_inverse=True
    )
    azimuths, row_azimuth = np.unique(
        [180 - float(row["phi_deg"] or 180) for row in rows], return_inverse=True
    )
    is_beam = bool(rows[0]["mu0"])

    state = nanodisort.DisortState()
    state.nstr, state.nlyr, state.nmom = streams, thickness.size, moments.size - 1
    state.ntau, state.numu, state.nphi = 2, cosines.size, azimuths.size
    state.usrtau, state.usrang, state.lamber, state.quiet = True, True, True, True
    state.planck, state.onlyfl, state.spher = False, False, False
    state.intensity_correction = state.old_intensity_correction = True
    state.phi0 = state.accur = state.albedo = 0.0
    state.fbeam, state.fisot = (1.0, 0.0) if is_beam else (0.0, 1.0)
    state.allocate()
    state.umu0 = float(rows[0]["mu0"]) if is_beam else 0.5
    state.dtauc, state.ssalb = thickness, albedo
    state.pmom = np.asfortranarray(np.repeat(moments[:, None], thickness.size, axis=1))
    state.utau = np.array([0.0, thickness.sum()])
    state.umu, state.phi = cosines, azimuths
    state.solve()
    found = np.asarray(state.uu)[row_cosine, is_transmission(rows).astype(int), row_azimuth]
    return found / state.umu0 if is_beam else found


def converged(rows: list[dict]) -> tuple[np.ndarray, np.ndarray]:
    """Radiances, and by what share they changed when the streams became more."""
    found = np.array([radiances(rows, streams) for streams in STREAMS])
    changes = np.abs(found[1:] / found[:-1] - 1)
    least = np.argmin(changes, axis=0), np.arange(len(rows))
    return found[1:][least], changes[least]


def main() -> None:
    """Solve every problem and write the columns."""
    problems = read_problems()
    for name, rows in problems.items():
        print(name, flush=True)
        for row, value, change in zip(rows, *converged(rows), strict=True):
            row |= {"converged": f"{value:.10g}", "change": f"{change:.0e}"}
    rows = [row for problem in problems.values() for row in problem]
    with open(TABLE, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
