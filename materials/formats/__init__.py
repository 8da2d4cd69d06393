"""Files of materials. `registry` lists the readers; each module that it names is one format.

Further modules of a format, such as its writer, are named after it: `gltf_container`, `gltf_json`, `gltf_writer`. All
readers use `naming` (ids, and text that a record can store) and `measured_source` (sources of measured BRDFs, hashes,
errors with their file); glTF and loose texture maps share `pictures`.
"""
