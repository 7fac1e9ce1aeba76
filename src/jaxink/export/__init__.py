"""The ink as seen from inside the plate, as a table and in the files of ray tracers."""
