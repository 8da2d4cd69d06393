"""Import: from paths to a filled catalogue, one file a material.

Begin with `importing.py`; `inputs.py` finds files, `import_plan.py` skips what is unchanged, `work.py` fits a material.
"""
