"""Where the residuals of measured samples stand, by the models that their kept reports ended with.

python -m benchmarks.validation.measured.places [ptfe] [paint]

For a change of how places are told: the accepted effects are fitted again, with the sizes of a diagnosis, but
not looked for again, which takes an hour and more. Renews the place in the kept report and in
docs/validation/measured.md. Fails where the fit is not the one of the report.
"""

import sys

import numpy as np

import jaxink
from benchmarks.validation.measured.diagnosis import SAMPLES, declared, save
from benchmarks.validation.measured.diagnosis_page import REPORTS, write
from jaxink.diagnosis import Points, locate, read_report
from jaxink.diagnosis.search.problem import SearchProblem
from jaxink.effects import Scene
from jaxink.files.encoding import plain
from jaxink.fitting import prepare_data
from jaxink.measurement import noise_of
from jaxink.model.forward import ForwardModel
from jaxink.numerics.precision import computing


def relocate(name: str) -> None:
    """One case."""
    report = read_report(REPORTS / f"{name}.json")
    data, sample_file, options = declared(name)
    sample = jaxink.load_sample(SAMPLES / sample_file)
    data = prepare_data(data, sample)
    directions = [column[data.used] for column in data.directions]
    accuracy = options.fit.accuracy
    with computing():
        config = ForwardModel(sample, *directions, None, accuracy).config
        scene = Scene.of(*directions, data.row[data.used])
        problem = SearchProblem(
            sample,
            data,
            noise_of(data, sample.noise),
            config,
            scene,
            options.catalogue,
            options.screen,
            accuracy,
        )
        values = {p["name"]: p["after"] for p in report["parameters"]}
        accepted = []
        for step in report["steps"]:
            values |= step["terms"]
            terms = set(step["terms"])
            forms = (e for e in problem.listed(()).forms if e.name == step["effect"])
            accepted.append(next(e for e in forms if {t.name for t in e.terms} == terms))
        free = (*(p.name for p in sample.parameters.free), *(t.name for e in accepted for t in e.terms))
        objective = problem.objective(tuple(accepted), len(free))
        solution = objective.fit(values, free)
        jacobian, residual = objective.jacobian(solution.values, free)
    np.testing.assert_allclose(solution.chi_square, report["after"]["chi_square"], rtol=1e-6)
    unit = solution.search.unit
    at_bound = (unit >= 1).astype(int) - (unit <= 0)
    found = locate(residual, jacobian, Points.of(data), at_bound=at_bound)
    verdict = report["verdict"]
    verdict["sentence"] = verdict["sentence"].replace(report["residual"]["sentence"], found.sentence)
    report["residual"] = plain(found.to_dict())
    print(found.sentence)
    save(name, report)


if __name__ == "__main__":
    for case in sys.argv[1:]:
        relocate(case)
    write()
