"""Batches of SIMULATED sheets: troubles, kills, overhead, throughput, and a scheduler on this machine.

python -m benchmarks.batch STAGE ...    (without a stage: the page only, from what has been measured)

Every stage keeps its numbers in benchmarks/batch/results.json; batches themselves are gone on from where
they were stopped, in the folder that the environment variable JAXINK_BATCH_WORK names.
"""

import json
import os
import sys
import tempfile
from pathlib import Path

from benchmarks.batch import page, stages

RESULTS = Path(__file__).with_name("results.json")


def main(names: list[str]) -> None:
    """Run some stages, and write the page."""
    work = Path(os.environ.get("JAXINK_BATCH_WORK") or Path(tempfile.gettempdir()) / "jaxink-batch-benchmark")
    known = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    for name in names:
        known[name] = getattr(stages, name)(work)
        print(name, json.dumps(known[name])[:500], flush=True)
        RESULTS.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")
    page.write(known)


if __name__ == "__main__":
    main(sys.argv[1:])
