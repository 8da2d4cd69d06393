"""Sheets: thumbnails, contact sheets, turntables, and one scene in several materials.

Begin with `preview.py`; `material_facts.py` gathers the page of one material.
"""
