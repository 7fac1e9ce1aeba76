"""A first fit: the truth within its errors, drawn and profiled."""


def test_first_fit(run, capsys):
    names = run("first_fit")
    assert "The model fits within the stated noise" in capsys.readouterr().out
    assert {curve.name for curve in names["result"].profiles} == set(names["SIMULATED_TRUTH"])
