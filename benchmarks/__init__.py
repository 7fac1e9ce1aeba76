"""Speed and validation: each page of docs that holds numbers is written by a script from here.

Scripts run from the root of the repository, as `python -m benchmarks.validation.accuracy`; what they keep lies
beside them. Measured, simulated and reference data: the folder that JAXINK_DATA names.
"""
