"""Files of instruments and of ray tracers, read as measurements; docs/formats-in.md describes each."""
