"""Surfaces: originals and fast forms, their files, their fit, and catalogues of them.

Begin with `core/`, the interfaces; `analytic/`, `factored/`, `measured/`, `effect_coating/`, `svbrdf/` and `btf/` hold
the kinds of surface, `intake/` and `catalogue/` the way from a file to a material by its id.
"""
