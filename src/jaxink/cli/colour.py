"""``jaxink colour``."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.fit_tables import console
from jaxink.cli.one_measurement import is_described
from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError
from jaxink.files.encoding import json_text

if TYPE_CHECKING:
    from jaxink.colour import Arrangement, Illuminant


@dataclasses.dataclass(frozen=True)
class ArrangementOptions:
    """Options that say how the ink is arranged, as they were typed."""

    thickness_um: float | None
    over: str | None
    contact: bool
    lit_from: str
    free: bool
    layer: str | None

    def arrangement(self) -> "Arrangement":
        """What they mean; ``over`` is a number, ``nothing``, or a file."""
        from jaxink.colour import Arrangement, read_card

        over: float | dict[float, float] | str | None = self.over
        if self.over is not None and self.over != "nothing":
            try:
                over = float(self.over.replace(",", ".", 1))
            except ValueError:
                if not Path(self.over).suffix:
                    raise InputRefusedError(
                        f"--over is '{self.over}'; it must be a reflectance from 0 to 1, 'nothing', or a CSV "
                        "file with the columns wavelength_nm and reflectance."
                    ) from None
                over = read_card(self.over)
        given = self.thickness_um, over, self.contact, self.lit_from, self.free, self.layer
        return Arrangement(*given)


def run_colour(
    source: Path,
    geometries: Sequence[str],
    illuminant: str,
    observer_deg: int,
    options: ArrangementOptions,
    output: str,
) -> ExitCode:
    """Print the colours of a fit, or of a sample as its file states it.

    Parameters
    ----------
    source
        Folder of the fit, or a sample file.
    geometries
        See `jaxink.colour.Geometry`; empty: the usual ones.
    illuminant
        Name of a standard illuminant, or a CSV file.
    observer_deg
        2 or 10.
    options
        How the ink is arranged.
    output
        ``tables``, ``json`` or ``quiet``.
    """
    from jaxink.colour import GEOMETRIES, Geometry, colours_of_sample

    chosen = [Geometry.of(one) for one in geometries or GEOMETRIES]
    arrangement = options.arrangement()
    light = _illuminant(illuminant)
    session.prepare_jax()
    seen = chosen, light, observer_deg, arrangement
    if is_described(source):
        # That of readings, too, of a joint fit.
        found = colours_of_sample(jaxink.load_sample(source), *seen)
    else:
        found = jaxink.load_result(source).colour(*seen)
    if output == "json":
        typer.echo(json_text(found.to_dict()))
    elif output == "tables":
        console().print(found.summary(), soft_wrap=True, highlight=False, markup=False)
    return ExitCode.FITTED


def _illuminant(text: str) -> "str | Illuminant":
    from jaxink.colour import read_illuminant

    return read_illuminant(text) if Path(text).suffix else text
