"""Files of spectra. `registry` lists the readers and holds their types; each other module here is one format.

A format's further parts and its writer bear its name: `cxf_metadata`, `mat_library`, `csv_writer`. What several
readers use is in `shared`: the rules for what is taken and said (`entry_rules`), the words that people write beside
numbers (`words`), text and XML. `tables` finds the table in a text; `csv`, `instrument_text` and `spd` read with it.
`exr` is what the pictures stand on. Refusals get their file at the reader (`registry.names_its_file`).
"""
