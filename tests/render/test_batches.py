"""Statistics of batches, and renderings that go on where they were."""

import numpy as np
import pytest

from jaxink.render.batches import Kept, batches_of, estimate


def test_standard_error_is_that_of_the_mean():
    random = np.random.default_rng(2)
    means = [estimate(random.normal(3.0, 2.0, (25, 4))) for _ in range(400)]
    assert np.mean([e.value for e in means]) == pytest.approx(3.0, abs=0.05)
    assert np.std([e.value for e in means]) == pytest.approx(2 / 5, rel=0.05)
    assert np.mean([e.error for e in means]) == pytest.approx(2 / 5, rel=0.05)


def test_one_batch_has_no_standard_error(refused):
    with refused("--batches"):
        estimate(np.ones((1, 3)))


def test_finished_batches_are_not_made_again(tmp_path):
    made, steps = [], []

    def make(k):
        made.append(k)
        if k == 2 and len(made) == 3:
            raise KeyboardInterrupt
        return np.full(2, float(k))

    def run(n):
        kept = Kept(tmp_path, {"seed": 1})
        return batches_of(kept, "sheet", n, make, lambda what, step, misfit: steps.append(str(step)), "sheet")

    with pytest.raises(KeyboardInterrupt):
        run(4)
    assert run(4).tolist() == [[0, 0], [1, 1], [2, 2], [3, 3]]
    assert made == [0, 1, 2, 2, 3]
    assert steps[-1] == "4 of 4"


def test_batches_of_another_rendering_are_refused(tmp_path, refused):
    Kept(tmp_path, {"seed": 0})
    # Nothing was made.
    kept = Kept(tmp_path, {"seed": 1})
    kept.batch("one", lambda: np.zeros(1))
    Kept(tmp_path, {"seed": 1})
    with refused("--out"):
        Kept(tmp_path, {"seed": 2})
