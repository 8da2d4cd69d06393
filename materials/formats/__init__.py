"""Files of materials. `registry` lists the readers; each module that it names is one format.

A format's further parts and its writer bear its name: `gltf_container`, `gltf_json`, `merl_writer`. `pictures` is what
glTF and loose texture maps share, `measured` what all readers do: ids, text fit for a record, hashes, refusals with
their file.
"""
