"""Files of instruments and of ray tracers, read as measurements; docs/manual/formats-in.md describes each."""
