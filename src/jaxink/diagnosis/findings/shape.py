"""The shape of the remaining residual, and how much of it the directions of other effects share."""

from jaxink.diagnosis.search.loop import SearchResult
from jaxink.diagnosis.search.stage import Stage
from jaxink.residual import ResidualPoints, ResidualShape, residual_shape


def shape_of(stage: Stage, structured: float | None = None) -> ResidualShape:
    """Shape of a stage's residual, orthogonal to its free parameters; `structured` as of `residual_shape`."""
    return residual_shape(residual_points(stage), stage.projection.basis, structured)


def residual_points(stage: Stage) -> ResidualPoints:
    """The residual of a stage, point by point."""
    setup = stage.setup
    return ResidualPoints.of(
        setup.data,
        stage.solution.predicted_per_sr,
        setup.noise.sigma_per_sr,
        setup.noise.scan_relative,
        stage.residual,
        stage.bench.objective.weight,
    )


def overlaps_with(shape: ResidualShape, found: SearchResult) -> dict[str, float]:
    """Overlap of each effect that was not accepted with the shape, the largest first.

    An overlap is the cosine between both after the projection off the free parameters: of the setting of the
    effect at which it is largest, and of its sign if it has only one. Empty if the last model was not
    screened.
    """
    screening = found.screenings[-1] if found.screenings else None
    if screening is None or screening.stage is not found.last:
        return {}
    overlaps = {}
    for name, directions in screening.directions.items():
        cosines = [shape.overlap(found.last.projection.remove(d.column)) for d in directions]
        overlaps[name] = max(cosines, key=abs if directions[0].effect.sign == 0 else float)
    return dict(sorted(overlaps.items(), key=lambda item: -abs(item[1])))
