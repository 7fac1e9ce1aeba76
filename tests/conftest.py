import os

# The tests decide the precision and the strictness, before anything imports jax.
os.environ.setdefault("JAX_ENABLE_X64", "1")
os.environ.setdefault("JAX_NUMPY_RANK_PROMOTION", "allow")

from pathlib import Path  # noqa: E402

import pytest  # noqa: E402

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data():
    """Folder of the measured and reference data, which is not part of the repository."""
    if not SHARED.is_dir():
        pytest.skip(f"the folder of measured and reference data is absent: {SHARED}")
    return SHARED
