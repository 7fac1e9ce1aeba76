"""Joined files of different samples are refused, and remounted or noisy readings of one sample are not."""

import numpy as np
import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.measurement import Noise, noise_of
from jaxink.measurement.one_sample import refuse_other_samples

ANGLES = np.arange(0, 75, 5.0)


def written(tmp_path, name, factor=(1.0, 1.0), noise=0.003, sigma=None, seed=0, slope=0.0, angles=ANGLES):
    """A file of R and T at two wavelengths; factors of R and of T, changing with the angle by the slope."""
    random = np.random.default_rng(seed)
    lines = [
        "theta_i_deg,theta_o_deg,phi_deg,wavelength_nm,side,bsdf_per_sr"
        + ",sigma_per_sr" * (sigma is not None)
    ]
    for nm in (450, 650):
        for k, (side, level) in enumerate((("R", 0.25), ("T", 0.08))):
            for angle in angles:
                value = level * factor[k] * (1 + slope * angle / 70) * (1 - 0.002 * angle)
                value *= 1 + noise * random.normal()
                lines.append(
                    f"0,{angle},180,{nm},{side},{value:.8g}" + (f",{sigma * value}" if sigma else "")
                )
    path = tmp_path / name
    path.write_text("\n".join(lines))
    return path


def joined(tmp_path, **other):
    sigma = other.get("sigma")
    noise = other.get("noise", 0.003)
    first = written(tmp_path, "one.csv", sigma=sigma, noise=noise, seed=1)
    return jaxink.read([first, written(tmp_path, "two.csv", seed=2, **other)])


OTHER = {
    "thicker": {"factor": (1.15, 0.7)},
    "R alone": {"factor": (1.08, 1.0)},
    "T alone": {"factor": (1.0, 0.9)},
    "changing with the angle": {"factor": (1.05, 1.0), "slope": 0.1},
    "few directions": {"factor": (1.3, 1.3), "angles": ANGLES[:6]},
    "with standard deviations": {"factor": (1.15, 0.7), "sigma": 0.003},
}
SAME = {
    "the same": {},
    "remounted": {"factor": (1.02, 0.985)},
    "noisy": {"noise": 0.2},
    "within its standard deviations": {"factor": (1.1, 0.9), "sigma": 0.08},
    "too few directions": {"factor": (1.3, 1.3), "angles": ANGLES[:4]},
}


@pytest.mark.parametrize("kind", OTHER)
def test_other_samples_are_refused(kind, tmp_path, told):
    data = joined(tmp_path, **OTHER[kind])
    with pytest.raises(jaxink.InputRefusedError) as problem:
        refuse_other_samples(data)
    told(str(problem.value), "one.csv", "two.csv", "same sample", numbers=False)
    with pytest.raises(jaxink.InputRefusedError, match="same sample"):
        noise_of(data, Noise())


@pytest.mark.parametrize("kind", SAME)
def test_one_sample_passes(kind, tmp_path):
    refuse_other_samples(joined(tmp_path, **SAME[kind]))


def test_declared_noise_allows_for_it(tmp_path):
    data = joined(tmp_path, factor=(1.15, 0.7))
    assert noise_of(data, Noise(relative=0.2)).known
    data = joined(tmp_path, factor=(1.15, 0.7), sigma=0.003)
    assert noise_of(data, Noise(relative=0.2, use_file_sigma=False)).known


def test_one_file_is_not_looked_at(tmp_path):
    refuse_other_samples(jaxink.read(written(tmp_path, "one.csv")))


@pytest.mark.parametrize("command", ["convert", "init", "fit"])
def test_every_command_that_joins_asks(command, tmp_path, monkeypatch, told):
    monkeypatch.chdir(tmp_path)
    files = [written(tmp_path, "one.csv", seed=1).name]
    runner = CliRunner()
    assert runner.invoke(app, ["init", *files, "--out", "sample.toml"]).exit_code == 0
    files.append(written(tmp_path, "two.csv", factor=(1.15, 0.7), seed=2).name)
    out = {
        "convert": ["tidy.csv"],
        "init": ["new.toml"],
        "fit": ["result", "--sample", "sample.toml", "--no-figures"],
    }
    done = runner.invoke(app, [command, *files, "--out", *out[command]])
    assert done.exit_code == 5
    told(done.stderr, "one.csv", "two.csv", "same sample", numbers=False)
    assert not (tmp_path / out[command][0] / "result.json").exists()
    assert not (tmp_path / out[command][0]).is_file()


def in_one_file(tmp_path, factor, noise=0.0, times=2):
    """A file in which each direction is read several times, the later readings by a factor."""
    first = written(tmp_path, "one.csv", noise=noise).read_text().splitlines()
    again = [
        line
        for k in range(1, times)
        for line in written(tmp_path, "again.csv", factor, noise, seed=k).read_text().splitlines()[1:]
    ]
    path = tmp_path / "both.csv"
    path.write_text("\n".join([*first, *again]))
    return jaxink.read(path)


# Without noise, nothing but the common factor tells them apart.
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_two_samples_in_one_file_are_refused(noise, tmp_path, told):
    with pytest.raises(jaxink.InputRefusedError) as refused:
        noise_of(in_one_file(tmp_path, (0.4, 1.0), noise), Noise())
    told(
        str(refused.value),
        "both.csv",
        "second readings",
        "times the first",
        "same sample",
        "[noise]",
        numbers=False,
    )


def test_repeats_that_scatter_are_kept(tmp_path):
    assert noise_of(in_one_file(tmp_path, (1.0, 1.0), 0.2, times=5), Noise()).known
    assert noise_of(in_one_file(tmp_path, (1.03, 0.98), 0.003), Noise()).known
