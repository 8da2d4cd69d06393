"""Import: from paths to a filled catalogue, one file per material.

Begin with `importing.py`; `inputs.py` finds files, `import_plan.py` skips unchanged ones, `work.py` fits a material.
"""
