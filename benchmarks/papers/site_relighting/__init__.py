"""Colours at the vertices of a scene while materials, lights and views change, beside which the 2007 paper's tensors
stand: tens of milliseconds a change, and no picture.

Begin with `relighting.py`; `interpolation.py` has points between vertices. Pictures take `lighting.transfer.indirect`.
"""
