"""What a user's type checker sees of the library; mypy reads this file, nothing runs it."""

from typing import assert_type

import numpy as np

import jaxink


def fitted() -> None:
    data = jaxink.read("measurement.csv")
    assert_type(data, jaxink.GonioData)
    assert_type(len(data.scans), int)
    assert_type(jaxink.read(["R.csv", "T.xlsx"], side=["R", "T"]), jaxink.GonioData)
    data.mask.sum(), data.used_directions[0].mean()
    sample = jaxink.load_sample("sample.toml")
    assert_type(sample, jaxink.Sample)
    result = jaxink.fit(data, sample, jaxink.FitOptions(method="gradient", starts=3))
    assert_type(result, jaxink.FitResult)
    assert_type(jaxink.fit(["R.csv", "T.csv"], "sample.toml"), jaxink.FitResult)
    assert_type(result.merit.chi_square, float | None)
    assert_type(result.config, jaxink.SolverConfig)
    assert_type(result.parameters["ink.scattering_per_mm"].standard_error, float | None)
    assert_type(sample.parameters["ink.scattering_per_mm"], jaxink.Parameter)
    assert_type(result.covariance.names, tuple[str, ...])
    assert_type(result.log_density.free, tuple[str, ...])
    assert_type(result.summary(), str)
    assert_type(jaxink.load_result("result"), jaxink.FitResult)
    assert_type(jaxink.predict(sample, data), np.ndarray)
    assert_type(jaxink.ink_table(result), jaxink.InkTable)


def diagnosed() -> None:
    found = jaxink.diagnose("measurement.csv", "sample.toml", jaxink.DiagnosisOptions(max_effects=1))
    assert_type(found, jaxink.Diagnosis)
    assert_type(found.verdict.sentence, str)


def predicted(sample: jaxink.Sample) -> None:
    model = jaxink.ForwardModel(sample, [30.0], [0.0], [180.0], [550.0], [False])
    assert_type(model.wavelengths_nm, tuple[float, ...])
    assert_type(jaxink.SolverConfig(nodes_escaping=8), jaxink.SolverConfig)


def refused(sample: jaxink.Sample) -> None:
    jaxink.fit("measurement.csv", sample, method="simplex")  # type: ignore[call-arg]
    jaxink.load_sample(3)  # type: ignore[arg-type]
    sample.title = "frozen"  # type: ignore[misc]
