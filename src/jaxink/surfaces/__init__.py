"""Rough surfaces: reflection and transmission by facets or by wave optics."""
