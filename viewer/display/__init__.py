"""XYZ to the display: chromatic adaptation, OpenColorIO, soft proofs and PNG.

Begin with `transform.py`; `config.py` makes an OpenColorIO configuration of a characterised display.
"""
