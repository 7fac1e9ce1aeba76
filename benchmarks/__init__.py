"""Speed and validation: each page of docs that holds numbers is written by a script from here.

Scripts run from the root of the repository, as `python -m benchmarks.validation.accuracy`. What they keep
lies beside them, and so does the text of longer pages (`*.md.in`). Measured, simulated and reference data are
read from the folder that JAXINK_DATA names.
"""
